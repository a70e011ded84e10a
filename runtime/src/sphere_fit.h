#pragma once

#include <optional>
#include <span>

#include <glm/vec3.hpp>

namespace nms::runtime {

struct Sphere {
  glm::dvec3 centre{0.0};  ///< [m]
  double radius = 0.0;     ///< [m]
};

/// The sphere that lies nearest to the points, by least squares of the algebraic distance |p - c|^2 - r^2. Nothing for
/// fewer than four points, or points in a plane.
[[nodiscard]] std::optional<Sphere> fit_sphere(std::span<const glm::vec3> points);

}  // namespace nms::runtime
