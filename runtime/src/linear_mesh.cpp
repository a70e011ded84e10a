#include "linear_mesh.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace nms::runtime {

namespace {

double product(const glm::vec3& a, const glm::vec3& b) {
  return static_cast<double>(a.x) * static_cast<double>(b.x) + static_cast<double>(a.y) * static_cast<double>(b.y) +
         static_cast<double>(a.z) * static_cast<double>(b.z);
}

void add_weighted(const std::vector<glm::vec3>& field, float weight, std::span<glm::vec3> out) {
  if (weight == 0.0F) return;
  for (std::size_t v = 0; v < out.size(); ++v) out[v] += weight * field[v];
}

}  // namespace

void LinearMesh::place(std::span<const float> weights, std::span<glm::vec3> out) const {
  assert(weights.size() == targets.size() && out.size() == positions.size());
  std::copy(positions.begin(), positions.end(), out.begin());
  for (std::size_t t = 0; t < targets.size(); ++t) add_weighted(targets[t].moved, weights[t], out);
}

void LinearMesh::turn(std::span<const float> weights, std::span<glm::vec3> out) const {
  assert(weights.size() == targets.size() && out.size() == normals.size());
  std::copy(normals.begin(), normals.end(), out.begin());
  for (std::size_t t = 0; t < targets.size(); ++t) add_weighted(targets[t].turned, weights[t], out);
}

void ResidualBasis::add(std::vector<glm::vec3> field) {
  assert(field.size() == vertices_);
  std::vector<std::size_t> support;
  for (std::size_t v = 0; v < field.size(); ++v) {
    if (field[v] != glm::vec3(0.0F)) support.push_back(v);
  }
  // One more row of the factor: L y = products with the others, and what is left on the diagonal.
  std::vector<double> row;
  double own = 0.0;
  for (const std::size_t v : support) own += product(field[v], field[v]);
  for (std::size_t j = 0; j < fields_.size(); ++j) {
    double sum = 0.0;
    for (const std::size_t v : support) sum += product(field[v], fields_[j][v]);
    for (std::size_t k = 0; k < j; ++k) sum -= factor_[j][k] * row[k];
    row.push_back(sum / factor_[j][j]);
  }
  double rest = own;
  for (const double r : row) rest -= r * r;
  // Nearly a sum of the others: held away from 0, so that its weight stays bounded.
  row.push_back(std::sqrt(std::max(rest, 1e-9 * own + 1e-30)));
  fields_.push_back(std::move(field));
  support_.push_back(std::move(support));
  factor_.push_back(std::move(row));
}

void ResidualBasis::fit(std::span<const glm::vec3> residual, std::span<double> weights) const {
  const std::size_t n = fields_.size();
  assert(weights.size() == n && residual.size() == vertices_);
  for (std::size_t j = 0; j < n; ++j) {
    double sum = 0.0;
    for (const std::size_t v : support_[j]) sum += product(fields_[j][v], residual[v]);
    for (std::size_t k = 0; k < j; ++k) sum -= factor_[j][k] * weights[k];
    weights[j] = sum / factor_[j][j];
  }
  for (std::size_t j = n; j-- > 0;) {
    for (std::size_t k = j + 1; k < n; ++k) weights[j] -= factor_[k][j] * weights[k];
    weights[j] /= factor_[j][j];
  }
}

void ResidualBasis::subtract(std::span<const double> weights, std::span<glm::vec3> residual) const {
  for (std::size_t j = 0; j < fields_.size(); ++j) {
    const float w = static_cast<float>(weights[j]);
    if (w == 0.0F) continue;
    for (const std::size_t v : support_[j]) residual[v] -= w * fields_[j][v];
  }
}

Largest largest(std::span<const glm::vec3> vectors) {
  Largest most;
  double squared = 0.0;
  for (std::size_t v = 0; v < vectors.size(); ++v) {
    const double s = product(vectors[v], vectors[v]);
    if (s > squared) {
      squared = s;
      most.index = v;
    }
  }
  most.length = std::sqrt(squared);
  return most;
}

}  // namespace nms::runtime
