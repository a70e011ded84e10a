#pragma once

#include <string>

#include <nms/runtime/face_form.h>
#include <nms/runtime/face_scale.h>
#include <nms/runtime/polygon_mesh.h>

/// The front of a head, made up of triangles: an ellipsoid with a nose, lips that touch at rest and have linings, lids
/// about open eyes, two eyeballs. Mirrored exactly. For tests and benchmarks that need a head of any size which nobody
/// modelled.
namespace nms::test {

struct SyntheticHead {
  runtime::PolygonMesh mesh;  ///< in metres, +y up, +z forward; pieces "skin", "eye_left", "eye_right"
  runtime::FaceForm form;     ///< its parts, and every landmark by position
};

/// @param spacing_mm  of the grid; 4 mm makes some 2,600 vertices, 0.45 mm some 200,000
[[nodiscard]] SyntheticHead synthetic_head(double spacing_mm);

/// The same as Wavefront OBJ.
[[nodiscard]] std::string obj_text(const runtime::PolygonMesh& mesh);

}  // namespace nms::test
