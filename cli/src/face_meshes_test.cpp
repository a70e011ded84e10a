#include "face_meshes.h"

#include <cmath>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

namespace nms::cli {
namespace {

constexpr double kAspect = 0.8;
constexpr std::size_t kHead = static_cast<std::size_t>(runtime::Frame::head);

picture::Camera camera_at(float yaw_rad) {
  picture::Camera camera;
  camera.target = {0.0F, 0.05F, 0.02F};
  camera.height_m = 0.4F;
  camera.yaw_rad = yaw_rad;
  return camera;
}

runtime::Pose pose_with_head_at(const glm::dvec3& by) {
  runtime::Pose pose;
  pose.placements[kHead].rotation = glm::dmat3(1.0);
  pose.placements[kHead].translation = by;
  return pose;
}

TEST(HeightToHold, IsTheCamerasOwnWhereTheHeadStays) {
  EXPECT_EQ(height_to_hold(camera_at(0.0F), pose_with_head_at(glm::dvec3(0.0)), kAspect), 0.4F);
  EXPECT_EQ(height_to_hold(camera_at(0.0F), pose_with_head_at({0.005, -0.01, 0.0}), kAspect), 0.4F);
}

// Half a metre to the side: as much of the picture lies between the head and its edge as was free at rest, or nothing.
TEST(HeightToHold, GrowsByHowFarTheHeadGoesAcrossThePicture) {
  const float aside = height_to_hold(camera_at(0.0F), pose_with_head_at({0.5, 0.0, 0.0}), kAspect);
  EXPECT_GT(aside, 0.4F + 2.0F * 0.5F / 0.8F - 0.4F * 0.16F);
  EXPECT_LT(aside, 0.4F + 2.0F * 0.5F / 0.8F);
  EXPECT_EQ(height_to_hold(camera_at(0.0F), pose_with_head_at({-0.5, 0.0, 0.0}), kAspect), aside);
  const float up = height_to_hold(camera_at(0.0F), pose_with_head_at({0.0, -0.5, 0.0}), kAspect);
  EXPECT_GT(up, 1.3F);
  EXPECT_LT(up, aside);
}

TEST(HeightToHold, DoesNotGrowByWhatComesTowardsTheCamera) {
  EXPECT_EQ(height_to_hold(camera_at(0.0F), pose_with_head_at({0.0, 0.0, 0.5}), kAspect), 0.4F);
  EXPECT_NEAR(height_to_hold(camera_at(1.5707963F), pose_with_head_at({0.5, 0.0, 0.0}), kAspect), 0.4F, 1e-5F);
  EXPECT_GT(height_to_hold(camera_at(1.5707963F), pose_with_head_at({0.0, 0.0, 0.5}), kAspect), 1.5F);
}

}  // namespace
}  // namespace nms::cli
