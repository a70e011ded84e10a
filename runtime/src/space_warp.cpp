#include "space_warp.h"

#include <cmath>
#include <cstddef>
#include <utility>

#include <glm/geometric.hpp>

namespace nms::runtime {
namespace {

/// Gauss with the largest pivot of each column; n x n, row by row, three right sides. False: singular.
bool solve(std::vector<double>& m, std::vector<glm::dvec3>& right) {
  const std::size_t n = right.size();
  for (std::size_t c = 0; c < n; ++c) {
    std::size_t pivot = c;
    for (std::size_t r = c + 1; r < n; ++r) {
      if (std::abs(m[r * n + c]) > std::abs(m[pivot * n + c])) pivot = r;
    }
    if (std::abs(m[pivot * n + c]) < 1e-12) return false;
    if (pivot != c) {
      for (std::size_t k = c; k < n; ++k) std::swap(m[pivot * n + k], m[c * n + k]);
      std::swap(right[pivot], right[c]);
    }
    for (std::size_t r = c + 1; r < n; ++r) {
      const double f = m[r * n + c] / m[c * n + c];
      if (f == 0.0) continue;
      for (std::size_t k = c; k < n; ++k) m[r * n + k] -= f * m[c * n + k];
      right[r] -= f * right[c];
    }
  }
  for (std::size_t c = n; c-- > 0;) {
    for (std::size_t k = c + 1; k < n; ++k) right[c] -= m[c * n + k] * right[k];
    right[c] /= m[c * n + c];
  }
  return true;
}

}  // namespace

std::optional<SpaceWarp> SpaceWarp::through(std::span<const glm::dvec3> from, std::span<const glm::dvec3> to,
                                            double stiffness) {
  const std::size_t count = from.size();
  const std::size_t n = count + 4;
  std::vector<double> m(n * n, 0.0);
  std::vector<glm::dvec3> right(n, glm::dvec3(0.0));
  for (std::size_t i = 0; i < count; ++i) {
    // Minus the distance is positive on all that an affine map cannot do.
    for (std::size_t j = 0; j < count; ++j) m[i * n + j] = -glm::distance(from[i], from[j]);
    m[i * n + i] += stiffness;
    const double affine[4] = {1.0, from[i].x, from[i].y, from[i].z};
    for (std::size_t k = 0; k < 4; ++k) m[i * n + count + k] = m[(count + k) * n + i] = affine[k];
    right[i] = to[i] - from[i];
  }
  if (!solve(m, right)) return std::nullopt;
  SpaceWarp warp;
  warp.centres_.assign(from.begin(), from.end());
  warp.weights_.assign(right.begin(), right.begin() + static_cast<std::ptrdiff_t>(count));
  warp.shift_ = right[count];
  for (std::size_t k = 0; k < 3; ++k) warp.columns_[k] = right[count + 1 + k];
  return warp;
}

glm::dvec3 SpaceWarp::operator()(const glm::dvec3& p) const {
  glm::dvec3 moved = p + shift_ + p.x * columns_[0] + p.y * columns_[1] + p.z * columns_[2];
  for (std::size_t i = 0; i < centres_.size(); ++i) moved -= glm::distance(p, centres_[i]) * weights_[i];
  return moved;
}

}  // namespace nms::runtime
