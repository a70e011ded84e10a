#pragma once

#include <optional>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

namespace nms::runtime {

/// A smooth map of space: p -> p + a + A p + sum of w_i |p - c_i|, the least bent one that brings samples where they
/// belong, or near it (Duchon's splines: thin plates of three dimensions).
class SpaceWarp {
 public:
  /// @param stiffness  0: samples are met exactly; more: the map bends less                              [m]
  /// Nothing: the samples lie in one plane, or two in one place want to go to different ones.
  [[nodiscard]] static std::optional<SpaceWarp> through(std::span<const glm::dvec3> from,
                                                        std::span<const glm::dvec3> to, double stiffness);

  [[nodiscard]] glm::dvec3 operator()(const glm::dvec3& p) const;

 private:
  std::vector<glm::dvec3> centres_;
  std::vector<glm::dvec3> weights_;
  glm::dvec3 shift_{0.0};
  glm::dvec3 columns_[3] = {};
};

}  // namespace nms::runtime
