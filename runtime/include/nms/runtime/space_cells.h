#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include <glm/vec3.hpp>

namespace nms::runtime {

/// Numbered things by the cubes of space that they stand in, to find those near a place. Owns the numbers only.
class SpaceCells {
 public:
  /// @param edge  of a cube: how far away things may be and still be found; above 0 [m]
  explicit SpaceCells(double edge) : edge_(edge) {}

  void add(std::uint32_t item, const glm::dvec3& place) { add(item, place, place); }

  /// What fills the box between two places. False: it is wider than 9 cubes, and left out.
  bool add(std::uint32_t item, const glm::dvec3& low, const glm::dvec3& high) {
    const Cell from = cell(low);
    const Cell to = cell(high);
    for (std::size_t k = 0; k < 3; ++k)
      if (to[k] - from[k] > 8) return false;
    visit(from, to, [&](const Cell& c) { cells_[c].push_back(item); });
    return true;
  }

  /// All things within the edge's length of a place, and some that are further; one may come more than once. Always in
  /// the same order.
  template <typename Visit>
  void visit_near(const glm::dvec3& place, Visit visit_item) const {
    const Cell c = cell(place);
    visit({c[0] - 1, c[1] - 1, c[2] - 1}, {c[0] + 1, c[1] + 1, c[2] + 1}, [&](const Cell& near) {
      const auto found = cells_.find(near);
      if (found == cells_.end()) return;
      for (const std::uint32_t item : found->second) visit_item(item);
    });
  }

 private:
  using Cell = std::array<std::int64_t, 3>;

  [[nodiscard]] Cell cell(const glm::dvec3& p) const {
    const auto part = [&](double x) { return static_cast<std::int64_t>(std::floor(std::clamp(x / edge_, -1e6, 1e6))); };
    return {part(p.x), part(p.y), part(p.z)};
  }

  template <typename Visit>
  static void visit(const Cell& from, const Cell& to, Visit visit_cell) {
    for (std::int64_t x = from[0]; x <= to[0]; ++x)
      for (std::int64_t y = from[1]; y <= to[1]; ++y)
        for (std::int64_t z = from[2]; z <= to[2]; ++z) visit_cell(Cell{x, y, z});
  }

  double edge_;
  std::map<Cell, std::vector<std::uint32_t>> cells_;
};

}  // namespace nms::runtime
