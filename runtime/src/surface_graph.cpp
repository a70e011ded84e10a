#include "surface_graph.h"

#include <algorithm>
#include <cmath>
#include <queue>
#include <utility>

#include <glm/geometric.hpp>

namespace nms::runtime {

namespace {

using Entry = std::pair<double, std::uint32_t>;
using Queue = std::priority_queue<Entry, std::vector<Entry>, std::greater<>>;

}  // namespace

SurfaceGraph::SurfaceGraph(std::span<const glm::dvec3> positions,
                           std::span<const std::array<std::uint32_t, 3>> triangles)
    : positions_(positions), begin_(positions.size() + 1, 0) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  pairs.reserve(triangles.size() * 6);
  for (const auto& t : triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      pairs.emplace_back(t[k], t[(k + 1) % 3]);
      pairs.emplace_back(t[(k + 1) % 3], t[k]);
    }
  }
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  edges_.reserve(pairs.size());
  for (const auto& [from, to] : pairs) {
    ++begin_[from + 1];
    edges_.push_back({to, glm::distance(positions[from], positions[to])});
  }
  for (std::size_t v = 0; v < positions.size(); ++v) begin_[v + 1] += begin_[v];
}

std::vector<double> SurfaceGraph::distances(std::span<const std::uint32_t> sources, double limit) const {
  std::vector<double> result(size(), kFar);
  Queue queue;
  for (const std::uint32_t s : sources) {
    result[s] = 0.0;
    queue.emplace(0.0, s);
  }
  while (!queue.empty()) {
    const auto [d, v] = queue.top();
    queue.pop();
    if (d > result[v]) continue;
    for (const Edge& e : edges(v)) {
      const double there = d + e.length;
      if (there >= result[e.to] || there > limit) continue;
      result[e.to] = there;
      queue.emplace(there, e.to);
    }
  }
  return result;
}

std::vector<std::uint32_t> SurfaceGraph::path(std::uint32_t from, std::uint32_t to, double limit) const {
  const std::uint32_t sources[] = {to};
  const std::vector<double> left = distances(sources, limit);
  if (left[from] == kFar) return {};
  std::vector<std::uint32_t> result{from};
  while (result.back() != to && result.size() <= size()) {
    // Downhill; of two ways of one length the first vertex.
    std::uint32_t best = result.back();
    double least = kFar;
    for (const Edge& e : edges(result.back())) {
      if (left[e.to] >= left[result.back()]) continue;
      const double way = e.length + left[e.to];
      if (way < least) {
        least = way;
        best = e.to;
      }
    }
    if (best == result.back()) return {};
    result.push_back(best);
  }
  return result;
}

std::vector<bool> SurfaceGraph::reached(std::uint32_t start, std::span<const std::uint32_t> wall) const {
  std::vector<bool> seen(size(), false);
  for (const std::uint32_t w : wall) seen[w] = true;
  std::vector<std::uint32_t> open;
  if (!seen[start]) {
    seen[start] = true;
    open.push_back(start);
  }
  while (!open.empty()) {
    const std::uint32_t v = open.back();
    open.pop_back();
    for (const Edge& e : edges(v)) {
      if (seen[e.to]) continue;
      seen[e.to] = true;
      open.push_back(e.to);
    }
  }
  for (const std::uint32_t w : wall) seen[w] = false;
  return seen;
}

std::uint32_t SurfaceGraph::nearest(const glm::dvec3& p) const {
  auto best = static_cast<std::uint32_t>(size());
  double least = kFar;
  for (std::uint32_t v = 0; v < size(); ++v) {
    if (begin_[v] == begin_[v + 1]) continue;
    const glm::dvec3 d = positions_[v] - p;
    const double squared = d.x * d.x + d.y * d.y + d.z * d.z;
    if (squared < least) {
      least = squared;
      best = v;
    }
  }
  return best;
}

}  // namespace nms::runtime
