#include <nms/picture/render.h>

#include <cmath>
#include <cstring>

#include <gtest/gtest.h>

namespace nms::picture {
namespace {

/// A ball about the origin, as latitudes and longitudes.
Mesh ball(float radius, glm::vec3 color) {
  constexpr int kAround = 48;
  constexpr int kUp = 24;
  Mesh m;
  m.color = color;
  for (int j = 0; j <= kUp; ++j)
    for (int i = 0; i <= kAround; ++i) {
      const float a = 6.2831853F * static_cast<float>(i) / kAround;
      const float b = 3.1415927F * (static_cast<float>(j) / kUp - 0.5F);
      const glm::vec3 n(std::cos(b) * std::sin(a), std::sin(b), std::cos(b) * std::cos(a));
      m.positions.push_back(radius * n);
      m.normals.push_back(n);
    }
  for (std::uint32_t j = 0; j < kUp; ++j)
    for (std::uint32_t i = 0; i < kAround; ++i) {
      const std::uint32_t p = j * (kAround + 1) + i;
      for (const std::uint32_t v : {p, p + 1, p + kAround + 2, p, p + kAround + 2, p + kAround + 1})
        m.triangles.push_back(v);
    }
  return m;
}

int red(const Image& image, int x, int y) { return image.pixels[static_cast<std::size_t>(y * image.width + x) * 3]; }

/// Pixels of a row that are brighter than half of the ball's red.
int red_pixels(const Image& image, int y) {
  int count = 0;
  for (int x = 0; x < image.width; ++x) {
    const std::uint8_t* p = &image.pixels[static_cast<std::size_t>(y * image.width + x) * 3];
    count += p[0] > 2 * p[2] ? 1 : 0;
  }
  return count;
}

TEST(Render, a_ball_is_as_wide_as_the_camera_says) {
  Camera camera;
  camera.height_m = 0.4F;
  const auto images = render({ball(0.1F, {0.9F, 0.05F, 0.05F})}, {camera}, {200, 200, 1});
  ASSERT_TRUE(images.has_value());
  ASSERT_EQ(images->size(), 1U);
  EXPECT_NEAR(red_pixels(images->front(), 100), 100, 4);  // 0.2 m of 0.4 m
  EXPECT_EQ(red_pixels(images->front(), 10), 0);
}

TEST(Render, the_key_lights_the_upper_left) {
  const auto images = render({ball(0.1F, {0.9F, 0.3F, 0.3F})}, {Camera{}}, {200, 200, 1});
  ASSERT_TRUE(images.has_value());
  EXPECT_GT(red(images->front(), 80, 70), red(images->front(), 120, 140) + 20);
}

TEST(Render, what_stands_before_another_hides_and_shades_it) {
  Mesh small = ball(0.02F, {0.05F, 0.05F, 0.9F});
  for (glm::vec3& p : small.positions) p.z += 0.2F;
  Mesh large = ball(0.1F, {0.9F, 0.05F, 0.05F});
  Camera camera;
  camera.height_m = 0.4F;
  const auto images = render({large, small}, {camera}, {200, 200, 1});
  ASSERT_TRUE(images.has_value());
  const std::uint8_t* middle = &images->front().pixels[(100 * 200 + 100) * 3];
  EXPECT_GT(middle[2], middle[0]);
  camera.yaw_rad = 3.14159265F;  // from behind it is hidden
  const auto behind = render({large, small}, {camera}, {200, 200, 1});
  const std::uint8_t* back = &behind->front().pixels[(100 * 200 + 100) * 3];
  EXPECT_GT(back[0], back[2]);
}

TEST(Render, threads_do_not_change_the_picture) {
  const Mesh m = ball(0.1F, {0.7F, 0.5F, 0.4F});
  const auto one = render({m}, {Camera{}}, {64, 80, 1});
  const auto three = render({m}, {Camera{}}, {64, 80, 3});
  ASSERT_TRUE(one && three);
  EXPECT_EQ(one->front().pixels, three->front().pixels);
}

TEST(Render, broken_meshes_are_refused) {
  Mesh m = ball(0.1F, {0.7F, 0.5F, 0.4F});
  m.triangles.push_back(0);
  EXPECT_FALSE(render({m}, {Camera{}}, {8, 8, 1}));
  m = ball(0.1F, {0.7F, 0.5F, 0.4F});
  m.triangles[5] = 1U << 30U;
  EXPECT_FALSE(render({m}, {Camera{}}, {8, 8, 1}));
  m = ball(0.1F, {0.7F, 0.5F, 0.4F});
  m.positions[7].y = std::nanf("");
  EXPECT_FALSE(render({m}, {Camera{}}, {8, 8, 1}));
  m = ball(0.1F, {0.7F, 0.5F, 0.4F});
  m.normals.pop_back();
  EXPECT_FALSE(render({m}, {Camera{}}, {8, 8, 1}));
  EXPECT_FALSE(render({ball(0.1F, {})}, {Camera{}}, {0, 8, 1}));
}

}  // namespace
}  // namespace nms::picture
