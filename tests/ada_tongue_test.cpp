// The tongue moves as its units do: little by little. Every unit of it is swept alone, with every other at full, put
// out and not, with the jaw shut and open.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <nms/runtime/rig.h>

#include "ada_fixture.h"
#include "pose_sweep.h"
#include "under_sanitizers.h"

namespace nms::ada {
namespace {

constexpr int kCoarse = 25;  // steps of a sweep
constexpr int kFine = 40;    // and of the fastest of them
// A vertex may move by so much where its unit goes from nothing to all.
constexpr double kFastest_mm = 400.0;

class Tongue {
 public:
  explicit Tongue(const Bound& b) : b_(b), pose_(runtime::make_pose(face(), b.rig)) {
    while (face().rigid[part_].name != "tongue") ++part_;
  }

  const std::vector<glm::vec3>& at(const std::vector<float>& values) {
    runtime::pose_face(face(), b_.rig, values, pose_);
    return pose_.parts[part_];
  }

 private:
  const Bound& b_;
  runtime::Pose pose_;
  std::size_t part_ = 0;
};

/// What comes out of the mouth by itself: it is not put out twice.
bool puts_out(const std::string& unit) { return unit == "AU19" || unit == "AU37" || unit == "AU116"; }

/// Two sides of one axis.
bool opposed(const std::string& a, const std::string& b) {
  const auto axis = [](const std::string& unit) {
    return unit == "AU111" || unit == "AU112" ? 1 : unit == "AU113" || unit == "AU114" ? 2 : 0;
  };
  return axis(a) != 0 && axis(a) == axis(b);
}

TEST(AdaTongue, moves_little_by_little) {
  const Bound& b = all_units();
  Tongue tongue(b);
  const std::vector<std::string> units{"AU19", "AU37", "AU111", "AU112", "AU113", "AU114", "AU115", "AU116"};
  const std::size_t every = one_case_of(6);
  std::size_t sweeps = 0;
  for (const std::string jaw : {"", "AU26", "AU27"}) {
    for (const bool out : {false, true}) {
      for (const std::string& swept : units) {
        for (const std::string& held : units) {
          if (out && (puts_out(swept) || puts_out(held))) continue;
          if (opposed(swept, held) || (puts_out(swept) && puts_out(held) && swept != held)) continue;
          if (++sweeps % every != 0) continue;
          std::vector<std::string> names;
          if (!jaw.empty()) names.push_back(jaw);
          if (out) names.emplace_back("AU19");
          if (held != swept) names.push_back(held);
          const std::vector<float> from = values_of(b, names);
          names.push_back(swept);
          const std::vector<float> to = values_of(b, names);
          const auto [coarse, fine] = sweep(
              [&](const std::vector<float>& values) -> const std::vector<glm::vec3>& { return tongue.at(values); },
              from, to, kCoarse, kFine);
          EXPECT_GT(coarse.mm, 0.0) << fmt::format("{}", fmt::join(names, " + "));
          EXPECT_LE(fine.mm * kCoarse * kFine, kFastest_mm)
              << fmt::format("{}: {:.2f} mm at once, at {:.0f} % of the last", fmt::join(names, " + "), fine.mm,
                             100.0 * coarse.number / kCoarse);
        }
      }
    }
  }
  EXPECT_GT(sweeps, 150U);
}

TEST(AdaTongue, goes_where_its_units_say) {
  const Bound& b = all_units();
  Tongue tongue(b);
  const auto tip = [&](const std::vector<std::string>& names) {
    const std::vector<glm::vec3>& at = tongue.at(values_of(b, names));
    // The last ring is the tip.
    return glm::dvec3(at.back()) * 1000.0;
  };
  const glm::dvec3 out = tip({"AU19"});
  const glm::dvec3 lip = landmark(b, "lip_lower_mid") * 1000.0;
  EXPECT_GT(out.z, lip.z + 10.0);
  EXPECT_GT(tip({"AU19", "AU111"}).x, out.x + 10.0);
  EXPECT_LT(tip({"AU19", "AU112"}).x, out.x - 10.0);
  EXPECT_GT(tip({"AU19", "AU113"}).y, out.y + 10.0);
  EXPECT_LT(tip({"AU19", "AU114"}).y, out.y - 5.0);
  EXPECT_LT(tip({"AU19", "AU115"}).z, out.z - 5.0);
}

}  // namespace
}  // namespace nms::ada
