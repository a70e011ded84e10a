#include "linear_mesh.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>

#include <nms/program/several_processors.h>

namespace nms::runtime {

namespace {

double product(const glm::vec3& a, const glm::vec3& b) {
  return static_cast<double>(a.x) * static_cast<double>(b.x) + static_cast<double>(a.y) * static_cast<double>(b.y) +
         static_cast<double>(a.z) * static_cast<double>(b.z);
}

// Between two vertices that count no more than so many others stand, or the run goes on.
constexpr std::size_t kGap = 6;

template <typename Counts>
std::vector<VertexRun> runs_of(std::size_t count, Counts counts) {
  std::vector<VertexRun> runs;
  for (std::size_t v = 0; v < count; ++v) {
    if (!counts(v)) continue;
    const auto at = static_cast<std::uint32_t>(v);
    if (runs.empty() || v > runs.back().end + kGap) runs.push_back({at, at});
    runs.back().end = at + 1;
  }
  return runs;
}

void add_weighted(const std::vector<glm::vec3>& field, const std::vector<VertexRun>& runs, float weight,
                  std::span<glm::vec3> out) {
  if (weight == 0.0F) return;
  for (const VertexRun& run : runs) {
    for (std::size_t v = run.begin; v < run.end; ++v) out[v] += weight * field[v];
  }
}

// The compiler's vectors: eight sums side by side, so that none waits for the other.
constexpr std::size_t kLanes = 8;
using Floats = float __attribute__((vector_size(kLanes * sizeof(float))));
using Doubles = double __attribute__((vector_size(kLanes * sizeof(double))));

}  // namespace

// The sum of products of two fields, where the first is not 0.
NMS_FOR_SEVERAL_PROCESSORS
static double product_of_fields(const float* __restrict a, const float* __restrict b, const VertexRun* runs,
                                std::size_t run_count) {
  Doubles sums{};
  double rest = 0.0;
  for (std::size_t r = 0; r < run_count; ++r) {
    std::size_t i = 3 * std::size_t{runs[r].begin};
    const std::size_t end = 3 * std::size_t{runs[r].end};
    for (; i + kLanes <= end; i += kLanes) {
      Floats x;
      Floats y;
      std::memcpy(&x, a + i, sizeof x);
      std::memcpy(&y, b + i, sizeof y);
      sums += __builtin_convertvector(x, Doubles) * __builtin_convertvector(y, Doubles);
    }
    for (; i < end; ++i) rest += static_cast<double>(a[i]) * static_cast<double>(b[i]);
  }
  for (std::size_t l = 0; l < kLanes; ++l) rest += sums[l];
  return rest;
}

static double product_of_fields(std::span<const glm::vec3> a, std::span<const glm::vec3> b,
                                const std::vector<VertexRun>& runs) {
  static_assert(sizeof(glm::vec3) == 3 * sizeof(float));
  return a.empty() ? 0.0 : product_of_fields(&a[0].x, &b[0].x, runs.data(), runs.size());
}

void LinearMesh::note_reach() {
  for (std::size_t t = reach.size(); t < targets.size(); ++t) {
    const Target& target = targets[t];
    reach.push_back(runs_of(target.moved.size(), [&](std::size_t v) {
      return target.moved[v] != glm::vec3(0.0F) || target.turned[v] != glm::vec3(0.0F);
    }));
  }
}

void LinearMesh::place(std::span<const float> weights, std::span<glm::vec3> out) const {
  assert(weights.size() == targets.size() && reach.size() == targets.size() && out.size() == positions.size());
  std::copy(positions.begin(), positions.end(), out.begin());
  for (std::size_t t = 0; t < targets.size(); ++t) add_weighted(targets[t].moved, reach[t], weights[t], out);
}

void LinearMesh::turn(std::span<const float> weights, std::span<glm::vec3> out) const {
  assert(weights.size() == targets.size() && reach.size() == targets.size() && out.size() == normals.size());
  std::copy(normals.begin(), normals.end(), out.begin());
  for (std::size_t t = 0; t < targets.size(); ++t) add_weighted(targets[t].turned, reach[t], weights[t], out);
}

void ResidualBasis::add(std::vector<glm::vec3> field) {
  assert(field.size() == vertices_);
  std::vector<VertexRun> reach = runs_of(field.size(), [&](std::size_t v) { return field[v] != glm::vec3(0.0F); });
  // One more row of the factor: L y = products with the others, and what is left on the diagonal.
  std::vector<double> row;
  const double own = product_of_fields(field, field, reach);
  for (std::size_t j = 0; j < fields_.size(); ++j) {
    double sum = product_of_fields(field, fields_[j], reach);
    for (std::size_t k = 0; k < j; ++k) sum -= factor_[j][k] * row[k];
    row.push_back(sum / factor_[j][j]);
  }
  double rest = own;
  for (const double r : row) rest -= r * r;
  // Nearly a sum of the others: held away from 0, so that its weight stays bounded.
  row.push_back(std::sqrt(std::max(rest, 1e-9 * own + 1e-30)));
  fields_.push_back(std::move(field));
  reach_.push_back(std::move(reach));
  factor_.push_back(std::move(row));
}

void ResidualBasis::fit(std::span<const glm::vec3> residual, std::span<double> weights) const {
  const std::size_t n = fields_.size();
  assert(weights.size() == n && residual.size() == vertices_);
  for (std::size_t j = 0; j < n; ++j) {
    double sum = product_of_fields(fields_[j], residual, reach_[j]);
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
    add_weighted(fields_[j], reach_[j], -static_cast<float>(weights[j]), residual);
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
