// Head, torso, shoulders and eyes go where their units say, the face and the bust with them.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <nms/runtime/rig.h>

#include "ada_fixture.h"

namespace nms::ada {
namespace {

struct Placed {
  std::vector<glm::vec3> positions;
  runtime::Pose pose;
};

Placed placed(std::string_view unit) {
  const runtime::Rig& rig = all_units().rig;
  Placed out{std::vector<glm::vec3>(rest().size()), runtime::make_pose(face(), rig)};
  std::vector<glm::vec3> normals(rest().size());
  runtime::pose_face(face(), rig, values_of(all_units(), {std::string(unit)}), out.pose);
  runtime::place_skin(rig, out.pose, out.positions, normals);
  return out;
}

std::size_t vertex_at(std::string_view name) {
  const glm::dvec3 p = landmark(all_units(), name);
  std::size_t best = 0;
  for (std::size_t v = 0; v < rest().size(); ++v)
    if (glm::distance(rest()[v], p) < glm::distance(rest()[best], p)) best = v;
  return best;
}

struct Course {
  const char* unit;
  const char* place;
  int axis;       // 0 to the left, 1 up, 2 forward
  double sign;    // which way
  bool of_torso;  // the bust goes too
};

TEST(AdaBody, units_go_where_they_say) {
  const Course courses[] = {
      {"AU51", "nose_tip", 0, 1.0, false},  {"AU52", "nose_tip", 0, -1.0, false}, {"AU53", "nose_tip", 1, 1.0, false},
      {"AU54", "nose_tip", 1, -1.0, false}, {"AU55", "trichion", 0, 1.0, false},  {"AU56", "trichion", 0, -1.0, false},
      {"AU57", "nose_tip", 2, 1.0, false},  {"AU58", "nose_tip", 2, -1.0, false}, {"AU101", "trichion", 2, 1.0, true},
      {"AU102", "trichion", 2, -1.0, true}, {"AU103", "trichion", 0, 1.0, true},  {"AU104", "trichion", 0, -1.0, true},
      {"AU105", "nose_tip", 0, 1.0, true},  {"AU106", "nose_tip", 0, -1.0, true}, {"AU107", "menton", 0, 1.0, true},
      {"AU108", "menton", 0, -1.0, true},
  };
  const std::span<const float> head = all_units().rig.head_share();
  for (const Course& course : courses) {
    const Placed now = placed(course.unit);
    const std::size_t v = vertex_at(course.place);
    const glm::dvec3 moved = glm::dvec3(now.positions[v]) - rest()[v];
    EXPECT_GT(course.sign * moved[course.axis], 0.03) << course.unit;
    double bust = 0.0;
    for (std::size_t i = 0; i < rest().size(); ++i)
      if (head[i] == 0.0F) bust = std::max(bust, glm::distance(glm::dvec3(now.positions[i]), rest()[i]));
    if (course.of_torso) {
      EXPECT_GT(bust, 0.005) << course.unit;
    } else {
      EXPECT_LT(bust, 1e-6) << course.unit;
    }
  }
}

TEST(AdaBody, shoulders_rise_by_themselves) {
  const Placed now = placed("AU82L");
  double own = 0.0;
  double other = 0.0;
  for (std::size_t v = 0; v < rest().size(); ++v) {
    const bool shoulder = std::abs(rest()[v].x) > 0.08 && rest()[v].y < -0.12;
    const glm::dvec3 moved = glm::dvec3(now.positions[v]) - rest()[v];
    if (shoulder && rest()[v].x > 0.0) own = std::max(own, moved.y);
    if (rest()[v].x < 0.0) other = std::max(other, glm::length(moved));
  }
  EXPECT_GT(own, 0.01);
  EXPECT_LT(other, 1e-4);
}

TEST(AdaBody, eyes_look_where_their_units_say) {
  struct Look {
    const char* unit;
    int axis;
    double left, right;  // which way each eye looks
  };
  for (const Look& look : {Look{"AU61", 0, 1.0, 1.0}, Look{"AU62", 0, -1.0, -1.0}, Look{"AU63", 1, 1.0, 1.0},
                           Look{"AU64", 1, -1.0, -1.0}, Look{"AU65", 0, 1.0, -1.0}, Look{"AU66", 0, -1.0, 1.0}}) {
    const Placed now = placed(look.unit);
    const auto forward = [&](runtime::Frame frame) {
      return now.pose.placements[static_cast<std::size_t>(frame)].rotation[2];
    };
    EXPECT_GT(look.left * forward(runtime::Frame::eye_left)[look.axis], 0.2) << look.unit;
    EXPECT_GT(look.right * forward(runtime::Frame::eye_right)[look.axis], 0.2) << look.unit;
  }
}

}  // namespace
}  // namespace nms::ada
