#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <glm/vec3.hpp>

#include "layout.h"
#include "scan.h"
#include "triangle_tree.h"

namespace nms::fit_face {

/// The part of the scan that one surface stands for. A cut doubles the vertices along it.
struct Piece {
  std::vector<std::uint32_t> vertex;  ///< of the scan, for each local vertex
  std::vector<Triangle> triangles;    ///< local
  std::vector<std::uint32_t> loop;    ///< local, counter-clockwise, from the surface's corner (0, 0)
  std::vector<double> u;              ///< parameters on the surface, one for each local vertex
  std::vector<double> v;
};

/// The half x >= 0 of the scan, cut along the layout's curves.
class Pieces {
 public:
  /// Turns surfaces of the layout round where they would face inwards. Ends the program where the flood between the
  /// curves does not find exactly the surfaces listed.
  Pieces(const Scan& scan, Layout& layout);

  const std::map<std::uint32_t, Piece>& pieces() const { return pieces_; }
  /// Where a vertex lies once the paths are smoothed.
  const glm::dvec3& place(std::uint32_t vertex) const { return place_[vertex]; }
  /// Parameters of a curve's vertices.
  const std::vector<double>& parameters(const std::string& curve) const { return at_.at(curve); }
  const LayoutCurve& layout_curve(const std::string& name) const;
  /// Vertices and parameters along a side, corner to corner.
  std::vector<std::pair<std::uint32_t, double>> side_vertices(const LayoutSurface::Side& side) const;

 private:
  using Edge = std::pair<std::uint32_t, std::uint32_t>;
  using TrianglesByEdge = std::map<Edge, std::vector<std::uint32_t>>;

  void cut();
  void smooth_paths();
  void set_parameters();
  std::vector<std::uint32_t> surface_loop(const LayoutSurface& surface) const;
  std::vector<std::vector<std::uint32_t>> flood(const TrianglesByEdge& by_edge) const;
  Piece piece_of(const std::vector<std::uint32_t>& member, const TrianglesByEdge& by_edge) const;
  bool claim(LayoutSurface& surface, Piece& piece) const;
  void make_pieces();
  void parametrise(const LayoutSurface& surface, Piece& piece) const;

  const Scan& scan_;
  Layout& layout_;
  std::set<Edge> cut_edges_;
  std::vector<Triangle> triangles_;
  std::unique_ptr<TriangleTree> tree_;
  std::vector<glm::dvec3> place_;
  std::map<std::string, std::vector<double>> at_;
  std::map<std::uint32_t, Piece> pieces_;
};

}  // namespace nms::fit_face
