#include "sphere_fit.h"

#include <array>
#include <cmath>
#include <utility>

namespace nms::runtime {

// |p|^2 = 2 c.p + (r^2 - |c|^2): linear in c and the bracket. Coordinates count from the points' mean, in units of
// their spread, so that the sums are of one size.
std::optional<Sphere> fit_sphere(std::span<const glm::vec3> points) {
  if (points.size() < 4) return std::nullopt;
  glm::dvec3 mean(0.0);
  for (const glm::vec3& p : points) mean += glm::dvec3(p);
  mean /= static_cast<double>(points.size());
  double spread = 0.0;
  for (const glm::vec3& p : points) {
    const glm::dvec3 d = glm::dvec3(p) - mean;
    spread += d.x * d.x + d.y * d.y + d.z * d.z;
  }
  spread = std::sqrt(spread / static_cast<double>(points.size()));
  if (!(spread > 0.0) || !std::isfinite(spread)) return std::nullopt;

  std::array<std::array<double, 5>, 4> m{};
  for (const glm::vec3& p : points) {
    const glm::dvec3 q = (glm::dvec3(p) - mean) / spread;
    const std::array<double, 5> row{q.x, q.y, q.z, 1.0, q.x * q.x + q.y * q.y + q.z * q.z};
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t k = 0; k < 5; ++k) m[i][k] += row[i] * row[k];
  }
  for (std::size_t column = 0; column < 4; ++column) {
    std::size_t best = column;
    for (std::size_t row = column + 1; row < 4; ++row)
      if (std::abs(m[row][column]) > std::abs(m[best][column])) best = row;
    std::swap(m[column], m[best]);
    if (std::abs(m[column][column]) < 1e-9 * static_cast<double>(points.size())) return std::nullopt;
    for (std::size_t row = 0; row < 4; ++row) {
      if (row == column) continue;
      const double factor = m[row][column] / m[column][column];
      for (std::size_t k = column; k < 5; ++k) m[row][k] -= factor * m[column][k];
    }
  }
  std::array<double, 4> x{};
  for (std::size_t i = 0; i < 4; ++i) x[i] = m[i][4] / m[i][i];
  const glm::dvec3 c = 0.5 * glm::dvec3(x[0], x[1], x[2]);
  const double squared = x[3] + c.x * c.x + c.y * c.y + c.z * c.z;
  if (!(squared > 0.0)) return std::nullopt;
  return Sphere{mean + spread * c, spread * std::sqrt(squared)};
}

}  // namespace nms::runtime
