#pragma once

#include <random>

#include <glm/vec3.hpp>

#include <nms/runtime/face.h>

/// Heads of other sizes and shapes, made of those at hand.
namespace nms::test {

/// A smooth warp that keeps left and right alike.
struct Warp {
  glm::dvec3 scale{1.0};
  double bend = 0.0;  ///< [m]
  double phase = 0.0;

  [[nodiscard]] glm::dvec3 operator()(const glm::dvec3& p) const;
};

/// From 0.6 to 1.7 times the size, its three directions up to 14 % apart.
[[nodiscard]] Warp random_warp(std::mt19937& random);

/// ada's surfaces, parts and landmarks where the warp takes them. Eyeballs stay balls, and lids fit them.
[[nodiscard]] runtime::Face warped_ada(const Warp& warp);

}  // namespace nms::test
