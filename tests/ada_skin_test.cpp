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
#include <glm/geometric.hpp>

#include <nms/runtime/rig.h>

#include "ada_fixture.h"
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

struct Step {
  double mm = 0.0;  // the furthest that a vertex goes in it
  int number = 0;
  std::size_t vertex = 0;
};

class Skin {
 public:
  explicit Skin(const Bound& b) : b_(b), pose_(runtime::make_pose(face(), b.rig)) {}

  Step fastest(const std::vector<float>& from, const std::vector<float>& to, int steps) {
    Step most;
    std::vector<glm::vec3> last = at(from);
    for (int k = 1; k <= steps; ++k) {
      const std::vector<glm::vec3>& now = at(between(from, to, k, steps));
      for (std::size_t v = 0; v < now.size(); ++v) {
        const glm::vec3 d = now[v] - last[v];
        const double mm = 1000.0 * static_cast<double>(glm::length(d));
        if (mm > most.mm) most = {mm, k, v};
      }
      last = now;
    }
    return most;
  }

  static std::vector<float> between(const std::vector<float>& from, const std::vector<float>& to, int step, int steps) {
    std::vector<float> values(from.size());
    const float u = static_cast<float>(step) / static_cast<float>(steps);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = from[i] + u * (to[i] - from[i]);
    return values;
  }

 private:
  const std::vector<glm::vec3>& at(const std::vector<float>& values) {
    runtime::pose_face(face(), b_.rig, values, pose_);
    return pose_.positions;
  }

  const Bound& b_;
  runtime::Pose pose_;
};

TEST(AdaSkin, moves_little_by_little) {
  const Bound& b = all_units();
  Skin skin(b);
  std::map<std::string, std::vector<float>> units;
  for (const fit_face::FacePose& pose : fit_face::each_unit(b.image.program(), b.rig)) units[pose.what] = pose.values;
  std::vector<std::pair<double, std::string>> found;
  const std::size_t every = one_case_of(8);
  std::size_t pairs = 0;
  for (const fit_face::FacePose& pair : fit_face::each_pair(b.image.program(), b.rig)) {
    const std::size_t plus = pair.what.find(" + ");
    const std::array<std::string, 2> both{pair.what.substr(0, plus), pair.what.substr(plus + 3)};
    if (!brings_lips_to_teeth(both[0]) && !brings_lips_to_teeth(both[1])) continue;
    if (pairs++ % every != 0) continue;
    for (const std::string& held : both) {
      const std::vector<float>& from = units.at("100 % " + held);
      const Step coarse = skin.fastest(from, pair.values, kCoarse);
      const Step fine = skin.fastest(Skin::between(from, pair.values, coarse.number - 1, kCoarse),
                                     Skin::between(from, pair.values, coarse.number, kCoarse), kFine);
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
