#include "vertex_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace nms::runtime {

template <typename Int>
Int step_of(float q) {
  constexpr auto kMost = static_cast<float>(std::numeric_limits<Int>::max());
  return static_cast<Int>(std::floor(std::clamp(q, -1.0F, 1.0F) * kMost + 0.5F));
}

template std::int8_t step_of<std::int8_t>(float q);
template std::int16_t step_of<std::int16_t>(float q);

namespace {

// One step of one component of what a target adds to a normal: 0.45 degrees.
constexpr float kLeastTurn = 1.01F / 127.0F;

template <typename Int>
float rounded(float q) {
  return static_cast<float>(step_of<Int>(q)) / static_cast<float>(std::numeric_limits<Int>::max());
}

template <typename Int>
glm::vec3 rounded(glm::vec3 q) {
  return {rounded<Int>(q.x), rounded<Int>(q.y), rounded<Int>(q.z)};
}

// A target adds no more than 1 to an axis of a normal. What turns further gets a shorter normal of the same direction.
glm::vec3 within_range(glm::vec3 normal, glm::vec3 turned) {
  constexpr float kShortest = 0.1F;
  const glm::vec3 whole = normal + turned;
  float length = 1.0F;
  for (int i = 0; i < 3; ++i) {
    const float added = length * whole[i] - normal[i];
    if (std::abs(added) > 1.0F) length = std::max((normal[i] + std::copysign(1.0F, added)) / whole[i], kShortest);
  }
  return length < 1.0F ? length * whole - normal : turned;
}

float square(glm::vec3 v) { return v.x * v.x + v.y * v.y + v.z * v.z; }

float longest_side(glm::vec3 v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

}  // namespace

VertexGrid grid_of(std::span<const glm::vec3> positions, std::span<const LinearMesh::Target> targets) {
  VertexGrid grid;
  if (positions.empty()) return grid;
  glm::vec3 low = positions[0];
  glm::vec3 high = positions[0];
  for (const glm::vec3& p : positions) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  grid.middle = 0.5F * (low + high);
  grid.scale = 0.0F;
  for (const glm::vec3& p : positions) grid.scale = std::max(grid.scale, longest_side(p - grid.middle));
  for (const LinearMesh::Target& target : targets) {
    for (const glm::vec3& d : target.moved) grid.scale = std::max(grid.scale, longest_side(d));
  }
  if (grid.scale <= 0.0F) grid.scale = 1.0F;
  return grid;
}

glm::vec3 place_on(const VertexGrid& grid, glm::vec3 p) {
  return grid.middle + grid.scale * rounded<std::int16_t>((p - grid.middle) / grid.scale);
}

void put_on(const VertexGrid& grid, LinearMesh& mesh, float least_m) {
  for (glm::vec3& p : mesh.positions) p = place_on(grid, p);
  for (glm::vec3& n : mesh.normals) n = rounded<std::int8_t>(n);
  for (LinearMesh::Target& target : mesh.targets) {
    for (std::size_t v = 0; v < target.turned.size(); ++v)
      target.turned[v] = within_range(mesh.normals[v], target.turned[v]);
    put_on(grid, target);
    for (std::size_t v = 0; v < target.moved.size(); ++v) {
      if (square(target.moved[v]) > least_m * least_m || square(target.turned[v]) > kLeastTurn * kLeastTurn) continue;
      target.moved[v] = glm::vec3(0.0F);
      target.turned[v] = glm::vec3(0.0F);
    }
  }
}

void fill_range(const VertexGrid& grid, LinearMesh::Target& target) {
  float most = 0.0F;  // 1: the range
  for (const glm::vec3& d : target.moved) most = std::max(most, longest_side(d) / grid.scale);
  for (const glm::vec3& n : target.turned) most = std::max(most, longest_side(n));
  if (most <= 0.0F) return;
  for (glm::vec3& d : target.moved) d /= most;
  for (glm::vec3& n : target.turned) n /= most;
}

void put_on(const VertexGrid& grid, LinearMesh::Target& target) {
  for (glm::vec3& d : target.moved) d = grid.scale * rounded<std::int16_t>(d / grid.scale);
  for (glm::vec3& n : target.turned) n = rounded<std::int8_t>(n);
}

}  // namespace nms::runtime
