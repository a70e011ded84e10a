// What is put where it may not be is brought out again: vertices out of eyeballs and teeth, and each lip to its side.
// On ada muscles alone hardly ever need it of eyeballs; another face may.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <nms/runtime/contact.h>
#include <nms/runtime/rig.h>

#include "ada_fixture.h"

namespace nms::ada {
namespace {

runtime::Pose at_rest() {
  runtime::Pose pose = runtime::make_pose(face(), all_units().rig);
  runtime::pose_face(face(), all_units().rig, std::vector<float>(all_units().rig.channel_count(), 0.0F), pose);
  return pose;
}

TEST(AdaContact, what_is_inside_an_eyeball_goes_straight_out) {
  const runtime::RigTables& tables = all_units().rig.tables();
  for (const runtime::RigTables::Eye& eye : tables.eyes) {
    ASSERT_GT(eye.vertices.size(), 500U);
    runtime::Pose pose = at_rest();
    for (const runtime::RigTables::EyeVertex& v : eye.vertices) {
      glm::vec3& p = pose.positions[v.vertex];
      p = glm::vec3(eye.centre + 0.6 * (glm::dvec3(p) - eye.centre));
    }
    const std::vector<glm::vec3> before = pose.positions;
    runtime::hold_vertices_apart(all_units().rig, pose);
    for (const runtime::RigTables::EyeVertex& v : eye.vertices) {
      const glm::dvec3 from = glm::dvec3(before[v.vertex]) - eye.centre;
      const glm::dvec3 now = glm::dvec3(pose.positions[v.vertex]) - eye.centre;
      ASSERT_GE(glm::length(now), std::min(eye.radius, v.least) - 1e-7);
      ASSERT_LT(glm::length(glm::cross(glm::normalize(from), glm::normalize(now))), 1e-4);
    }
  }
}

TEST(AdaContact, lips_that_were_pushed_through_one_another_meet) {
  runtime::Pose pose = at_rest();
  const runtime::RigTables& tables = all_units().rig.tables();
  for (const runtime::RigTables::LipVertex& v : tables.lip_vertices)
    pose.positions[v.vertex].y += v.upper ? -0.002F : 0.002F;
  runtime::hold_vertices_apart(all_units().rig, pose);
  for (const runtime::RigTables::LipVertex& v : tables.lip_vertices) {
    const glm::vec3& p = pose.positions[v.vertex];
    const double past = (v.upper ? 1.0 : -1.0) * (pose.lip_line.height_at(p.x) - static_cast<double>(p.y)) - v.slack;
    ASSERT_LE(past, 0.0002);
  }
}

double along(std::mt19937& random, double low, double high) {
  return low + (high - low) * static_cast<double>(random()) / 4294967296.0;
}

/// About a row of teeth, behind its front and before it.
glm::dvec3 near_teeth(std::mt19937& random, const runtime::TeethWall& wall) {
  const double top = wall.bottom_y + wall.row_height * runtime::TeethWall::kRows;
  return {along(random, -0.03, 0.03), along(random, wall.bottom_y - 0.004, top + 0.004),
          wall.back_z + along(random, 0.02, 0.06)};
}

TEST(AdaContact, what_is_inside_the_teeth_comes_out) {
  std::mt19937 random(3);
  for (const runtime::TeethWall& wall : all_units().rig.tables().walls) {
    ASSERT_TRUE(wall.exists);
    int inside = 0;
    for (int i = 0; i < 20'000; ++i) {
      const glm::dvec3 p = near_teeth(random, wall);
      const glm::dvec3 way = wall.push(p, 0.0);
      if (way == glm::dvec3(0.0)) continue;
      ++inside;
      ASSERT_LT(glm::length(wall.push(p + way, 0.0)), 0.0001) << p.x << " " << p.y << " " << p.z;
    }
    EXPECT_GT(inside, 1000);
  }
}

// What is next to one another inside is next to one another outside: on no way through the teeth is there a step.
TEST(AdaContact, neighbours_inside_the_teeth_come_out_as_neighbours) {
  constexpr double kStep_m = 5e-6;
  constexpr double kSteepest = 60.0;  // of what a step changes, by its length
  std::mt19937 random(5);
  for (const runtime::TeethWall& wall : all_units().rig.tables().walls) {
    for (int line = 0; line < 200; ++line) {
      glm::dvec3 p = near_teeth(random, wall);
      const glm::dvec3 step = kStep_m * glm::normalize(near_teeth(random, wall) - p);
      glm::dvec3 last = wall.push(p, 0.0);
      for (int i = 0; i < 2000; ++i) {
        p += step;
        const glm::dvec3 way = wall.push(p, 0.0);
        ASSERT_LE(glm::distance(way, last), kSteepest * kStep_m) << p.x << " " << p.y << " " << p.z;
        last = way;
      }
    }
  }
}

}  // namespace
}  // namespace nms::ada
