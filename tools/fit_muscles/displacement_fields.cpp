#include "displacement_fields.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include <nms/runtime/places_at_rest.h>
#include <nms/runtime/space_cells.h>

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

namespace {

constexpr double kNear = 0.010;  // how far a point may be from the face that tells its regions [m]

/// The skin's vertices in cells as wide as that.
class SkinVertices {
 public:
  explicit SkinVertices(const runtime::Skin& skin) : places_(runtime::places_at_rest(skin)) {
    std::vector<bool> known(places_.size(), false);
    for (const runtime::Primitive& primitive : skin.primitives) {
      for (const std::uint32_t v : primitive.triangles) {
        if (known[v]) continue;
        known[v] = true;
        cells_.add(v, places_[v]);
      }
    }
  }

  [[nodiscard]] std::optional<std::uint32_t> nearest(const glm::dvec3& p) const {
    std::optional<std::uint32_t> best;
    double least = kNear;
    cells_.visit_near(p, [&](std::uint32_t v) {
      const double d = glm::distance(places_[v], p);
      if (d < least) least = d, best = v;
    });
    return best;
  }

 private:
  std::vector<glm::dvec3> places_;
  runtime::SpaceCells cells_{kNear};
};

}  // namespace

void take_regions(RestMesh& rest, const runtime::Face& face) {
  const runtime::SparseMatrix& t = face.skin.surface;
  const SkinVertices skin(face.skin);
  std::vector<std::optional<std::uint32_t>> vertex;
  for (const glm::dvec3& p : rest.points) vertex.push_back(skin.nearest(p));
  for (const auto& [name, of_point] : face.regions) {
    std::vector<float>& weights = rest.regions[name];
    weights.assign(vertex.size(), 0.0F);
    for (std::size_t i = 0; i < vertex.size(); ++i) {
      if (!vertex[i]) continue;
      for (std::uint32_t k = t.row_begin[*vertex[i]]; k < t.row_begin[*vertex[i] + 1]; ++k) {
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
