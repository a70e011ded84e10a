#include <nms/runtime/mesh_normals.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstring>

#include <glm/geometric.hpp>

#include <nms/program/several_processors.h>

namespace nms::runtime {

namespace {

// Below this a sum is of no triangle, or of triangles without area. [m^4]
constexpr float kLeastSquare = 1e-30F;

// A vector of the compiler's.
using Four = float __attribute__((vector_size(4 * sizeof(float))));
using Vector = NormalScratch::Vector;

inline Four load(const Vector* at) {
  Four v;
  std::memcpy(&v, at, sizeof v);
  return v;
}

inline Four cross(Four a, Four b) {
  const Four r = a * __builtin_shufflevector(b, b, 1, 2, 0, 3) - __builtin_shufflevector(a, a, 1, 2, 0, 3) * b;
  return __builtin_shufflevector(r, r, 1, 2, 0, 3);
}

template <typename Visit>
void visit_triangles(std::span<const Primitive> primitives, Visit visit) {
  for (const Primitive& primitive : primitives) {
    for (std::size_t i = 0; i + 2 < primitive.triangles.size(); i += 3) {
      visit(primitive.triangles[i], primitive.triangles[i + 1], primitive.triangles[i + 2]);
    }
  }
}

}  // namespace

void area_weighted_normals(std::span<const Primitive> primitives, std::span<const glm::vec3> positions,
                           std::span<glm::vec3> normals) {
  for (glm::vec3& n : normals) n = glm::vec3(0.0F);
  visit_triangles(primitives, [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    // Twice the triangle's area along its normal.
    const glm::vec3 n = glm::cross(positions[b] - positions[a], positions[c] - positions[a]);
    normals[a] += n;
    normals[b] += n;
    normals[c] += n;
  });
  for (glm::vec3& n : normals) {
    const float squared = n.x * n.x + n.y * n.y + n.z * n.z;
    if (squared > kLeastSquare) {
      const float length = std::sqrt(squared);
      n = glm::vec3(n.x / length, n.y / length, n.z / length);
    } else {
      n = glm::vec3(0.0F, 0.0F, 1.0F);
    }
  }
}

NormalSums normal_sums(std::span<const Primitive> primitives, const std::vector<bool>& moves) {
  std::vector<bool> changes(moves.size(), false);
  visit_triangles(primitives, [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    if (moves[a] || moves[b] || moves[c]) changes[a] = changes[b] = changes[c] = true;
  });
  NormalSums sums;
  std::vector<std::uint32_t> counts(moves.size() + 1, 0);
  visit_triangles(primitives, [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    if (!changes[a] && !changes[b] && !changes[c]) return;
    for (const std::uint32_t v : {a, b, c}) {
      sums.triangles.push_back(v);
      if (changes[v]) ++counts[v];
    }
  });
  sums.begin.push_back(0);
  std::vector<std::uint32_t> next(moves.size(), 0);
  for (std::uint32_t v = 0; v < moves.size(); ++v) {
    if (!changes[v]) continue;
    next[v] = sums.begin.back();
    sums.vertices.push_back(v);
    sums.begin.push_back(sums.begin.back() + counts[v]);
  }
  sums.around.resize(sums.begin.back());
  for (std::size_t i = 0; i < sums.triangles.size(); ++i) {
    const std::uint32_t v = sums.triangles[i];
    if (changes[v]) sums.around[next[v]++] = static_cast<std::uint32_t>(i / 3);
  }
  return sums;
}

NormalScratch make_normal_scratch(const NormalSums& sums, std::size_t vertex_count) {
  return {std::vector<Vector>(vertex_count), std::vector<Vector>(sums.triangles.size() / 3)};
}

// Four numbers at a time; the fourth, the next place's first, is of no account.
static void widen(std::span<const glm::vec3> positions, std::span<Vector> out) {
  static_assert(sizeof(glm::vec3) == 3 * sizeof(float) && sizeof(Vector) == 4 * sizeof(float));
  if (positions.empty()) return;
  const std::size_t last = positions.size() - 1;
  for (std::size_t v = 0; v < last; ++v) {
    Four four;
    std::memcpy(&four, &positions[v].x, sizeof four);
    std::memcpy(&out[v], &four, sizeof four);
  }
  out[last] = {{positions[last].x, positions[last].y, positions[last].z}, 0.0F};
}

NMS_FOR_SEVERAL_PROCESSORS
static void cross_triangles(std::span<const std::uint32_t> corners, const Vector* __restrict positions,
                            Vector* __restrict out) {
  for (std::size_t i = 0; 3 * i + 2 < corners.size(); ++i) {
    const Four a = load(positions + corners[3 * i]);
    const Four b = load(positions + corners[3 * i + 1]);
    const Four c = load(positions + corners[3 * i + 2]);
    const Four n = cross(b - a, c - a);
    std::memcpy(out + i, &n, sizeof n);
  }
}

// Square roots and quotients of eight vertices side by side.
NMS_FOR_SEVERAL_PROCESSORS
static void sum_triangles(const NormalSums& sums, const Vector* __restrict triangles, glm::vec3* __restrict normals) {
  constexpr std::size_t kLanes = 8;
  const std::size_t count = sums.vertices.size();
  for (std::size_t first = 0; first < count; first += kLanes) {
    const std::size_t lanes = std::min(kLanes, count - first);
    float x[kLanes] = {};
    float y[kLanes] = {};
    float z[kLanes] = {};
    for (std::size_t l = 0; l < lanes; ++l) {
      Four sum{};
      for (std::size_t k = sums.begin[first + l]; k < sums.begin[first + l + 1]; ++k) {
        sum += load(triangles + sums.around[k]);
      }
      x[l] = sum[0];
      y[l] = sum[1];
      z[l] = sum[2];
    }
    for (std::size_t l = 0; l < kLanes; ++l) {
      const float squared = x[l] * x[l] + y[l] * y[l] + z[l] * z[l];
      const bool has_area = squared > kLeastSquare;
      const float length = std::sqrt(has_area ? squared : 1.0F);
      x[l] = has_area ? x[l] / length : 0.0F;
      y[l] = has_area ? y[l] / length : 0.0F;
      z[l] = has_area ? z[l] / length : 1.0F;
    }
    for (std::size_t l = 0; l < lanes; ++l) normals[sums.vertices[first + l]] = glm::vec3(x[l], y[l], z[l]);
  }
}

void area_weighted_normals(const NormalSums& sums, std::span<const glm::vec3> positions, NormalScratch& scratch,
                           std::span<glm::vec3> normals) {
  assert(scratch.positions.size() == positions.size() && normals.size() == positions.size());
  assert(scratch.triangles.size() == sums.triangles.size() / 3);
  widen(positions, scratch.positions);
  cross_triangles(sums.triangles, scratch.positions.data(), scratch.triangles.data());
  sum_triangles(sums, scratch.triangles.data(), normals.data());
}

}  // namespace nms::runtime
