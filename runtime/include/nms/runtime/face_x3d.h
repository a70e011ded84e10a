#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <glm/vec3.hpp>
#include <tl/expected.hpp>

#include <nms/program/failure.h>
#include <nms/runtime/face.h>
#include <nms/runtime/seams.h>
#include <nms/runtime/tessellate.h>

namespace nms::runtime {

/// Face files: X3D 3.3 in its XML form, which any X3D viewer shows. What X3D has no word for stands in metadata, which
/// a viewer skips. docs: tools/fit_face/README.md; sources: ISO/IEC 19775-1 (NURBS component), ISO/IEC 19776-1 (XML).
///
/// A `NurbsPatchSurface` whose metadata set "surface" lists four sides belongs to the net of seams (seams.h). One
/// without owns all its control points, so surfaces from any other program work too. Other strings and numbers in that
/// set:
///   part      "skin" unless given; what shells ride on, and the name of a rigid part's mesh
///   frame     torso | head | jaw | eye_left | eye_right: the surface is rigid and rides on that frame
///   rides     a part: the surface is a shell (a brow, hair) that keeps its distance to that part's skin
///   samples   two numbers, vertices per knot span in u and v
///   tint      three numbers for each control point, a factor on the material's colour
///   region:X  one number in [0, 1] for each control point (of a curve or surface): weight of the region X
/// Under a mirroring transform "_left" and "_right" at the end of a region's, frame's or part's name change places, and
/// points on the mirror plane are shared, so the halves hang together.

/// Most a file may ask for; far above any face, low enough for any machine.
struct FaceLimits {
  std::size_t bytes = 64U << 20U;
  std::size_t control_points = 1'000'000;
  std::size_t surface_uses = 4096;
};

/// A border curve with its control points; ends that do not hang on another curve are nodes, named.
struct FaceFileCurve {
  MasterCurve curve;                                  ///< ends hold indices into FaceFile::curves and ::nodes
  std::vector<glm::dvec3> points;                     ///< [m]
  std::map<std::string, std::vector<float>> regions;  ///< one weight for each control point
};

/// One surface of a face file.
struct FaceFileSurface {
  NetSurface geometry;             ///< sides hold indices into FaceFile::curves
  std::vector<glm::dvec3> points;  ///< u fastest  [m]
  std::string part = "skin";
  std::string frame;  ///< empty: deforms
  std::string rides;  ///< empty: not a shell
  SurfaceSamples samples;
  std::vector<glm::vec3> tint;  ///< one for each control point, or empty
  std::map<std::string, std::vector<float>> regions;
  std::uint32_t material = 0;  ///< index into FaceFile::materials
  bool mirrored = false;       ///< for the writer: stands in the half that is shown twice
};

struct FaceFile {
  std::string title;
  std::vector<Material> materials;  ///< base_color linear
  std::vector<std::string> nodes;
  std::vector<FaceFileCurve> curves;
  std::vector<FaceFileSurface> surfaces;
};

/// Reads and tessellates a face.
///
/// @param text  the file's bytes; nothing is assumed of them
/// @param name  what to call the file in a failure's place
/// Failures: "face_too_large", "face_not_xml", "face_not_x3d", "face_bad_number", "face_bad_reference",
/// "face_bad_surface", "face_seam_apart", "face_empty", and those of build_seams(). Deterministic; safe from many
/// threads.
tl::expected<Face, program::Failure> read_face_x3d(std::string_view text, std::string_view name,
                                                   const TessellationSettings& settings = {},
                                                   const FaceLimits& limits = {});

/// The file as X3D. Numbers are rounded to 1e-7 m; what is exactly on the mirror plane stays there.
std::string write_face_x3d(const FaceFile& file);

}  // namespace nms::runtime
