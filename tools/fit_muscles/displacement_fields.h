#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <glm/vec3.hpp>
#include <tl/expected.hpp>

#include <nms/program/failure.h>
#include <nms/program/program.h>
#include <nms/runtime/face.h>
#include <nms/runtime/polygon_mesh.h>

namespace nms::fit_muscles {

/// A face at rest, as points that muscles move.
struct RestMesh {
  std::vector<glm::dvec3> points;   ///< P, in the face's coordinates                            [m]
  std::vector<glm::dvec3> normals;  ///< P, unit, weighted by area
  /// How much of each point belongs to a region of the face, P each, in [0, 1]; none known: muscles take all points.
  std::map<std::string, std::vector<float>> regions;
};

/// Where the points go when action units are at their maximum.
struct Expression {
  std::string name;  ///< "AU12", "AU12L+AU6L"
  std::vector<program::ChannelId> units;
  std::vector<glm::dvec3> displacement;  ///< P                                                   [m]
};

/// @param unit_m  metres in one of the file's units
[[nodiscard]] RestMesh rest_mesh(const runtime::PolygonMesh& neutral, double unit_m);

/// Gives the points the regions of the face's nearest place, if that is within 10 mm; points further off have none.
void take_regions(RestMesh& rest, const runtime::Face& face);

/// Failures: fit_other_mesh (not the neutral's number of vertices), unknown_unit (a name that is no unit of the
/// program; one with sides may be named without).
[[nodiscard]] tl::expected<Expression, program::Failure> expression_of(std::string_view name,
                                                                       const runtime::PolygonMesh& moved,
                                                                       const RestMesh& rest, double unit_m,
                                                                       const program::Program& program);

}  // namespace nms::fit_muscles
