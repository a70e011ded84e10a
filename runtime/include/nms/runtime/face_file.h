#pragma once

#include <string>
#include <string_view>

#include <tl/expected.hpp>

#include <nms/program/failure.h>
#include <nms/runtime/face.h>
#include <nms/runtime/face_form.h>
#include <nms/runtime/face_scale.h>
#include <nms/runtime/polygon_mesh.h>

namespace nms::runtime {

/// Faces from files of any kind that is read: NURBS surfaces (X3D as .x3d or .x3dv, VRML97 .wrl) and polygons (.obj,
/// .gltf, .glb). What the file says of itself counts, its name's ending only where that says nothing.
///
/// The face has its parts in place, the landmarks that its geometry tells, and all regions that can be made of them.
///
/// @param bytes  the file; nothing is assumed of it
/// @param name   what to call it in a failure's place
/// Failures: face_unknown_format; those of read_face_x3d(), read_obj() and read_gltf_mesh(); face_no_part (a part is
/// not in the file, or all of it is left out), face_bad_landmark (a vertex or a surface that the file does not have).
[[nodiscard]] tl::expected<Face, program::Failure> read_face(std::string_view bytes, std::string_view name,
                                                             const FaceForm& form);

/// Polygons to a face: vertices are control points, T = 1. Failures: face_no_part, face_bad_landmark.
[[nodiscard]] tl::expected<Face, program::Failure> make_polygon_face(const PolygonMesh& mesh, std::string_view name,
                                                                     const FaceForm& form);

/// All that is known of places on a face: the positions that its declaration gives, and what its geometry tells.
[[nodiscard]] Landmarks landmarks_of(const Face& face, const program::Program& program);

/// The landmark nearest to a place at rest; "face" where there is none.
[[nodiscard]] std::string nearest_landmark(const Landmarks& landmarks, const glm::dvec3& place);

}  // namespace nms::runtime
