#include "displacement_fields.h"

#include <cmath>
#include <cstddef>
#include <optional>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "../fit_face/triangle_tree.h"

namespace nms::fit_muscles {

using program::Failure;

RestMesh rest_mesh(const runtime::PolygonMesh& neutral, double unit_m) {
  RestMesh rest;
  for (const glm::dvec3& p : neutral.positions) rest.points.push_back(unit_m * p);
  rest.normals.assign(rest.points.size(), glm::dvec3(0.0));
  for (const runtime::PolygonMesh::Piece& piece : neutral.pieces) {
    for (const auto& [a, b, c] : piece.triangles) {
      const glm::dvec3 n = glm::cross(rest.points[b] - rest.points[a], rest.points[c] - rest.points[a]);
      for (const std::uint32_t v : {a, b, c}) rest.normals[v] += n;
    }
  }
  for (glm::dvec3& n : rest.normals) {
    const double length = std::sqrt(glm::dot(n, n));
    n = length > 0.0 ? n / length : glm::dvec3(0.0, 0.0, 1.0);
  }
  return rest;
}

void take_regions(RestMesh& rest, const runtime::Face& face) {
  constexpr double kNear = 0.010;  // [m]
  const runtime::SparseMatrix& t = face.skin.surface;
  std::vector<glm::dvec3> places;
  for (std::uint32_t v = 0; v < t.rows; ++v) {
    glm::dvec3 p(face.skin.offsets[v]);
    for (std::uint32_t k = t.row_begin[v]; k < t.row_begin[v + 1]; ++k) {
      p += static_cast<double>(t.value[k]) * face.skin.points[t.column[k]];
    }
    places.push_back(p);
  }
  std::vector<fit_face::Triangle> triangles;
  for (const runtime::Primitive& p : face.skin.primitives) {
    for (std::size_t i = 0; i + 2 < p.triangles.size(); i += 3) {
      triangles.push_back({p.triangles[i], p.triangles[i + 1], p.triangles[i + 2]});
    }
  }
  const fit_face::TriangleTree tree(std::move(places), std::move(triangles));
  std::vector<std::uint32_t> vertex(rest.points.size(), t.rows);  // the nearest corner of the nearest triangle
  for (std::size_t i = 0; i < vertex.size(); ++i) {
    const fit_face::Nearest near = tree.nearest(rest.points[i]);
    if (!(near.distance <= kNear)) continue;
    double least = 1.0;
    for (const std::uint32_t v : tree.triangles()[near.triangle]) {
      const double d = glm::distance(tree.positions()[v], near.point);
      if (d < least) least = d, vertex[i] = v;
    }
  }
  for (const auto& [name, of_point] : face.regions) {
    std::vector<float>& weights = rest.regions[name];
    weights.assign(vertex.size(), 0.0F);
    for (std::size_t i = 0; i < vertex.size(); ++i) {
      if (vertex[i] == t.rows) continue;
      for (std::uint32_t k = t.row_begin[vertex[i]]; k < t.row_begin[vertex[i] + 1]; ++k) {
        weights[i] += t.value[k] * of_point[t.column[k]];
      }
    }
  }
}

namespace {

std::optional<program::ChannelId> channel_named(const program::Program& program, std::string_view name) {
  for (std::uint32_t c = 0; c < program.channels.size(); ++c) {
    if (program.string(program.channels[c].name) == name) return program::ChannelId{c};
  }
  return std::nullopt;
}

}  // namespace

tl::expected<Expression, Failure> expression_of(std::string_view name, const runtime::PolygonMesh& moved,
                                                const RestMesh& rest, double unit_m, const program::Program& program) {
  Expression expression;
  expression.name = name;
  if (moved.positions.size() != rest.points.size()) {
    return tl::unexpected(
        Failure{"fit_other_mesh", std::string(name),
                fmt::format("it has {} vertices and the neutral face {}", moved.positions.size(), rest.points.size()),
                "give the same mesh, moved: vertex by vertex in the same order"});
  }
  for (std::size_t at = 0; at <= name.size();) {
    const std::size_t end = std::min(name.find('+', at), name.size());
    const std::string unit(name.substr(at, end - at));
    at = end + 1;
    bool found = false;
    for (const std::string& candidate : {unit, unit + "L", unit + "R"}) {
      const auto channel = channel_named(program, candidate);
      if (!channel) continue;
      expression.units.push_back(*channel);
      found = true;
      if (candidate == unit) break;
    }
    if (!found) {
      return tl::unexpected(Failure{"unknown_unit", std::string(name), fmt::format("there is no unit '{}'", unit),
                                    "name units as the library does: AU12, AU12L, AU6+AU12"});
    }
  }
  for (std::size_t i = 0; i < rest.points.size(); ++i) {
    expression.displacement.push_back(unit_m * moved.positions[i] - rest.points[i]);
  }
  return expression;
}

}  // namespace nms::fit_muscles
