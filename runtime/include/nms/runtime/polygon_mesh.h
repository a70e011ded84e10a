#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <tl/expected.hpp>

#include <nms/program/failure.h>

namespace nms::runtime {

/// Polygons as a file gives them, before anybody says what part of a face they are.
struct PolygonMesh {
  /// Triangles that go by the same names.
  struct Piece {
    std::vector<std::string> names;                       ///< groups, object, mesh, material
    std::string material;                                 ///< its name, which is among them too
    std::optional<glm::vec4> color;                       ///< linear RGBA, where the file says it
    std::vector<std::array<std::uint32_t, 3>> triangles;  ///< counter-clockwise from outside
  };
  std::vector<glm::dvec3> positions;      ///< by vertex of the file, in its own units and axes
  std::vector<std::uint32_t> same_place;  ///< by vertex: the one that stands for it, or empty: each for itself
  std::vector<Piece> pieces;
};

/// Most that a file of polygons may hold.
struct PolygonLimits {
  std::size_t bytes = 256U << 20U;
  std::size_t vertices = 1'000'000;
  std::size_t triangles = 2'000'000;
  std::size_t corners = 256;  ///< of one polygon
  std::size_t pieces = 10'000;
};

/// Reads Wavefront OBJ: v, f, g, o, usemtl; all else is skipped. A quad is cut along its shorter diagonal, so that
/// mirrored quads are cut alike; a polygon of more corners is a fan about its first.
///
/// @param name  what to call the file in a failure's place
/// Failures: face_too_large, face_bad_number, face_bad_index, face_empty; the place says the line.
[[nodiscard]] tl::expected<PolygonMesh, program::Failure> read_obj(std::string_view text, std::string_view name,
                                                                   const PolygonLimits& limits = {});

/// Reads the meshes of a glTF 2.0 file, .gltf with its buffers inside or .glb, each where its node puts it. Vertices at
/// one place within one primitive are one point: glTF splits them where normals or texture coordinates do.
///
/// Failures: face_not_gltf, face_too_large, face_bad_index, face_empty.
[[nodiscard]] tl::expected<PolygonMesh, program::Failure> read_gltf_mesh(std::string_view bytes, std::string_view name,
                                                                         const PolygonLimits& limits = {});

}  // namespace nms::runtime
