// Lids at every gaze: what shuts an eye shuts it, and a lid's edge lies on the eyeball wherever the eye looks.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <nms/runtime/face_file.h>
#include <nms/runtime/rig.h>

#include "ada_fixture.h"
#include "face_artefacts.h"

namespace nms::ada {
namespace {

// A lid's edge may come so much nearer to the eyeball's centre than it rests, or go so much further from it.
constexpr double kRides_mm = 0.2;
constexpr float kEdgeShare = 0.99F;  // of a lid's region: its edge

using Units = std::vector<std::string>;

/// Straight ahead, to all four sides and between them.
const std::vector<Units>& gazes() {
  static const std::vector<Units> all{{},
                                      {"AU61"},
                                      {"AU62"},
                                      {"AU63"},
                                      {"AU64"},
                                      {"AU61", "AU63"},
                                      {"AU62", "AU63"},
                                      {"AU61", "AU64"},
                                      {"AU62", "AU64"}};
  return all;
}

std::string named(const Units& units) { return fmt::format("{}", fmt::join(units, " + ")); }

Units with(Units units, const std::string& one) {
  units.push_back(one);
  return units;
}

runtime::Pose posed(const std::vector<float>& values) {
  runtime::Pose pose = runtime::make_pose(face(), all_units().rig);
  runtime::pose_face(face(), all_units().rig, values, pose);
  return pose;
}

double shut(const runtime::LidState& lids) { return lids.upper + lids.lower; }

// The inspector looks for light between lids where the rig says that they are shut: here the unit says it.
TEST(AdaLids, what_shuts_an_eye_shuts_it_at_every_gaze) {
  const Bound& b = all_units();
  test::Inspector inspector(face(), b.rig, runtime::landmarks_of(face(), b.image.program()));
  test::ArtefactTally tally;
  for (const Units& gaze : gazes()) {
    for (const char* shuts : {"AU43", "AU45", "AU46"}) {
      for (const char* other : {"", "AU4", "AU6", "AU7", "AU12"}) {
        const Units units = with(*other == '\0' ? gaze : with(gaze, other), shuts);
        const std::vector<float> values = values_of(b, units);
        for (const runtime::LidState& lids : posed(values).lids) EXPECT_GE(shut(lids), 1.0) << named(units);
        tally.add(inspector.look(values), named(units));
      }
    }
  }
  EXPECT_TRUE(tally.empty()) << tally.text(4);
}

TEST(AdaLids, shut_little_by_little_and_never_open_again_on_the_way) {
  const Bound& b = all_units();
  for (const Units& gaze : gazes()) {
    double last = -1.0;
    for (int k = 0; k <= 20; ++k) {
      std::vector<float> values = values_of(b, gaze);
      const std::vector<float> shuts = values_of(b, {"AU45"}, static_cast<float>(k) / 20.0F);
      for (std::size_t i = 0; i < values.size(); ++i) values[i] += shuts[i];
      const double now = shut(posed(values).lids[0]);
      EXPECT_GE(now, last) << named(gaze) << " at " << 5 * k << " %";
      last = now;
    }
  }
}

TEST(AdaLids, lie_on_the_eyeball_at_every_gaze) {
  const Bound& b = all_units();
  const glm::dvec3 centre = landmark(b, "eye_centre_L");
  const std::vector<float> upper = vertex_weights("lid_upper_left");
  const std::vector<float> lower = vertex_weights("lid_lower_left");
  std::vector<std::size_t> edge;
  for (std::size_t v = 0; v < rest().size(); ++v)
    if (std::max(upper[v], lower[v]) > kEdgeShare) edge.push_back(v);
  ASSERT_GT(edge.size(), 100U);
  for (const Units& gaze : gazes()) {
    for (const char* lid : {"", "AU5", "AU7", "AU41", "AU42", "AU43", "AU44", "AU6"}) {
      const Units units = *lid == '\0' ? gaze : with(gaze, lid);
      for (const float amount : {0.5F, 1.0F}) {
        const runtime::Pose pose = posed(values_of(b, units, amount));
        double most_mm = 0.0;
        std::size_t at = edge.front();
        for (const std::size_t v : edge) {
          const double mm = 1000.0 * std::abs(glm::distance(glm::dvec3(pose.positions[v]), centre) -
                                              glm::distance(rest()[v], centre));
          if (mm > most_mm) most_mm = mm, at = v;
        }
        EXPECT_LE(most_mm, kRides_mm) << fmt::format("{:.0f} % {} near {}", 100.0F * amount, named(units),
                                                     nearest_landmark(b, rest()[at]));
      }
    }
  }
}

TEST(AdaLids, a_tightened_lid_comes_from_below) {
  for (const runtime::LidState& lids : posed(values_of(all_units(), {"AU7"})).lids) {
    EXPECT_GT(lids.lower, 0.15);
    EXPECT_GT(lids.lower, lids.upper);
    EXPECT_GT(lids.upper, 0.0);
  }
}

TEST(AdaLids, a_wink_shuts_one_eye) {
  const auto& lids = posed(values_of(all_units(), {"AU46L"})).lids;
  EXPECT_GE(shut(lids[0]), 1.0);
  EXPECT_EQ(shut(lids[1]), 0.0);
}

}  // namespace
}  // namespace nms::ada
