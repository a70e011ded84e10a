#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include <nms/runtime/face.h>

namespace nms::runtime {

/// Area-weighted unit normals over all primitives, summed in the order of the triangles.
void area_weighted_normals(std::span<const Primitive> primitives, std::span<const glm::vec3> positions,
                           std::span<glm::vec3> normals);

/// The same for the vertices whose normals can change, made ready for many frames: first every triangle's normal, then
/// every vertex's sum. The same sums in the same order, so the same bits.
struct NormalSums {
  std::vector<std::uint32_t> triangles;  ///< three vertices each, those about `vertices`
  std::vector<std::uint32_t> vertices;   ///< ascending
  std::vector<std::uint32_t> begin;      ///< one more than there are vertices, into `around`
  std::vector<std::uint32_t> around;     ///< triangles about each vertex, ascending
};

/// @param moves  one for each vertex: whether its position can change
[[nodiscard]] NormalSums normal_sums(std::span<const Primitive> primitives, const std::vector<bool>& moves);

/// What the sums need room for; one for each thread.
struct NormalScratch {
  struct alignas(16) Vector {
    float xyz[3];
    float unused;
  };
  std::vector<Vector> positions;  ///< V
  std::vector<Vector> triangles;  ///< one for each triangle: twice its area along its normal
};

[[nodiscard]] NormalScratch make_normal_scratch(const NormalSums& sums, std::size_t vertex_count);

/// Writes the normals of sums.vertices; the others stay. No allocation.
void area_weighted_normals(const NormalSums& sums, std::span<const glm::vec3> positions, NormalScratch& scratch,
                           std::span<glm::vec3> normals);

}  // namespace nms::runtime
