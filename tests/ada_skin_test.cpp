// The skin moves as its units do: little by little. Where lips lie on teeth and on one another, what is pushed out of
// the way on one side must not be on the other side a moment later. Pairs with a unit that brings lips to the teeth:
// from either unit alone to both.
#include <algorithm>
#include <array>
#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <nms/runtime/rig.h>

#include "ada_fixture.h"
#include "pose_sweep.h"
#include "under_sanitizers.h"

#include "../tools/fit_face/poses.h"

namespace nms::ada {
namespace {

constexpr int kCoarse = 16;  // steps of a sweep
constexpr int kFine = 24;    // and of the fastest of them
// A vertex may move by so much where its unit goes from nothing to all. AU27 takes the chin 44 mm down; a lip that
// slips from below the teeth to their front goes 8 mm in a hundredth of the way, and what jumped went 6 mm in none.
constexpr double kFastest_mm = 800.0;

bool brings_lips_to_teeth(const std::string& unit) {
  const std::array<std::string_view, 10> units{"AU8",  "AU12", "AU16", "AU18",  "AU23",
                                               "AU24", "AU28", "AU29", "AU30L", "AU32"};
  return std::find(units.begin(), units.end(), unit) != units.end();
}

TEST(AdaSkin, moves_little_by_little) {
  const Bound& b = all_units();
  runtime::Pose pose = runtime::make_pose(face(), b.rig);
  const auto skin = [&](const std::vector<float>& values) -> const std::vector<glm::vec3>& {
    runtime::pose_face(face(), b.rig, values, pose);
    return pose.positions;
  };
  std::map<std::string, std::vector<float>> units;
  for (const fit_face::FacePose& unit : fit_face::each_unit(b.image.program(), b.rig)) units[unit.what] = unit.values;
  std::vector<std::pair<double, std::string>> found;
  const std::size_t every = one_case_of(8);
  std::size_t pairs = 0;
  for (const fit_face::FacePose& pair : fit_face::each_pair(b.image.program(), b.rig)) {
    const std::size_t plus = pair.what.find(" + ");
    const std::array<std::string, 2> both{pair.what.substr(0, plus), pair.what.substr(plus + 3)};
    if (!brings_lips_to_teeth(both[0]) && !brings_lips_to_teeth(both[1])) continue;
    if (pairs++ % every != 0) continue;
    for (const std::string& held : both) {
      const auto [coarse, fine] = sweep(skin, units.at("100 % " + held), pair.values, kCoarse, kFine);
      if (fine.mm * kCoarse * kFine <= kFastest_mm) continue;
      found.emplace_back(
          fine.mm, fmt::format("{}, {} held: {:.2f} mm at once near {}, at {:.0f} % of the other", pair.what, held,
                               fine.mm, nearest_landmark(b, rest()[fine.vertex]), 100.0 * coarse.number / kCoarse));
    }
  }
  EXPECT_GT(pairs, 300U);
  std::sort(found.begin(), found.end(), std::greater<>());
  for (const auto& [mm, what] : found) ADD_FAILURE() << what;
}

}  // namespace
}  // namespace nms::ada
