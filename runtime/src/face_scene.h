#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <glm/mat4x4.hpp>
#include <tl/expected.hpp>

#include <nms/program/failure.h>
#include <nms/runtime/face_form.h>
#include <nms/runtime/face_x3d.h>

namespace nms::runtime {

/// One use of a surface of a face file, under a transform.
struct SurfaceUse {
  std::size_t surface = 0;    ///< index into FaceFile::surfaces
  std::size_t transform = 0;  ///< index into FaceScene::transforms
};

/// What an X3D file says, before anything is tessellated.
struct FaceScene {
  FaceFile file;
  std::vector<glm::dmat4> transforms;  ///< distinct
  std::vector<SurfaceUse> uses;
};

/// How the same nodes are written: X3D's XML, or the braces of VRML97 and of X3D's Classic VRML encoding.
enum class NurbsText { xml, vrml };

/// X3D text to a scene. Failures: those of read_face_x3d() that speak of the text.
tl::expected<FaceScene, program::Failure> read_scene_x3d(std::string_view text, std::string_view name,
                                                         NurbsText encoding, const FaceLimits& limits);

/// A face of NURBS surfaces whose declaration says how the file counts, which surfaces are which part, and where places
/// on surfaces are. Failures: those of read_face_x3d(), face_no_part, face_bad_landmark.
tl::expected<Face, program::Failure> read_nurbs_face(std::string_view text, std::string_view name, NurbsText encoding,
                                                     const FaceForm& form);

/// A scene to a face: net, tessellation, shells, rigid parts, regions. Failures: those of read_face_x3d() that speak of
/// seams and sizes.
tl::expected<Face, program::Failure> build_face(const FaceScene& scene, std::string_view name,
                                                const TessellationSettings& settings);

/// Writes out what the scene shows under a mirror (x to -x): afterwards each half has surfaces and curves of its own,
/// which meet in those of the midline, and nothing is mirrored. The face is the same.
/// @return false: the scene shows its surfaces under other transforms too, and is left as it is
bool write_out_halves(FaceScene& scene);

/// Under a mirror "_left" and "_right" at the end of a name change places.
std::string mirrored_name(const std::string& name);

/// The frame of that name, if there is one.
std::optional<Frame> frame_named(std::string_view name);

}  // namespace nms::runtime
