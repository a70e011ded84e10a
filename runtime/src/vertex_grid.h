#pragma once

#include <cstdint>
#include <span>

#include <glm/vec3.hpp>

#include "linear_mesh.h"

namespace nms::runtime {

/// Vertices in whole numbers, as KHR_mesh_quantization has them: a place is middle + scale q, where q in [-1, 1] is
/// written in 16 bits; a displacement is scale q. Normals and what targets add to them are written in 8 bits.
struct VertexGrid {
  glm::vec3 middle{0.0F};  ///< [m]
  float scale = 1.0F;      ///< [m]
};

/// The finest grid that holds these places, and the displacements of the targets.
[[nodiscard]] VertexGrid grid_of(std::span<const glm::vec3> positions, std::span<const LinearMesh::Target> targets);

/// The whole number that stands for q: q / Largest, rounded, and no further than 1 from 0.
template <typename Int>
[[nodiscard]] Int step_of(float q);

/// The nearest place, displacement, normal and change of a normal that the file can hold.
[[nodiscard]] glm::vec3 place_on(const VertexGrid& grid, glm::vec3 p);
/// @param least_m  a vertex that a target moves by no more, nor turns by more than a step, it leaves where it is   [m]
void put_on(const VertexGrid& grid, LinearMesh& mesh, float least_m);
void put_on(const VertexGrid& grid, LinearMesh::Target& target);

/// Makes a target whose weight is free as large as the file can hold it: rounding then counts least.
void fill_range(const VertexGrid& grid, LinearMesh::Target& target);

}  // namespace nms::runtime
