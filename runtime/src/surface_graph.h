#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

namespace nms::runtime {

/// Vertices of a surface and the edges of its triangles: distances along it, paths, and what a line of vertices
/// encloses.
///
/// Distances are those along edges, some percent longer than on the surface itself. All results are deterministic and
/// the same on a mirrored surface.
class SurfaceGraph {
 public:
  static constexpr double kFar = std::numeric_limits<double>::infinity();

  /// @param positions  V, kept by reference                     [m]
  /// @param triangles  indices into positions, three each
  SurfaceGraph(std::span<const glm::dvec3> positions, std::span<const std::array<std::uint32_t, 3>> triangles);

  /// From the nearest of the sources, kFar beyond `limit`. O(V log V). [m]
  [[nodiscard]] std::vector<double> distances(std::span<const std::uint32_t> sources, double limit = kFar) const;

  /// The vertices of a shortest path, both ends included; empty: there is none within `limit`.
  [[nodiscard]] std::vector<std::uint32_t> path(std::uint32_t from, std::uint32_t to, double limit = kFar) const;

  /// Every vertex that can be reached from `start` without stepping on the wall.
  [[nodiscard]] std::vector<bool> reached(std::uint32_t start, std::span<const std::uint32_t> wall) const;

  /// The vertex nearest to p in space that a triangle uses; the number of vertices if there is none.
  [[nodiscard]] std::uint32_t nearest(const glm::dvec3& p) const;

  [[nodiscard]] std::size_t size() const { return positions_.size(); }

 private:
  struct Edge {
    std::uint32_t to = 0;
    double length = 0.0;
  };
  [[nodiscard]] std::span<const Edge> edges(std::uint32_t v) const {
    return std::span(edges_).subspan(begin_[v], begin_[v + 1] - begin_[v]);
  }

  std::span<const glm::dvec3> positions_;
  std::vector<std::uint32_t> begin_;
  std::vector<Edge> edges_;
};

}  // namespace nms::runtime
