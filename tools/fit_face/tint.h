#pragma once

#include <glm/vec3.hpp>

#include <nms/runtime/face_x3d.h>

#include "model.h"

namespace nms::fit_face {

/// Fills `tint`: blood under cheeks, nose, chin and ears, shade in the sockets, and lashes as a dark seam on the lids'
/// edges. Lips, lining and nostrils have materials of their own and stay white.
void add_tint(const Model& model, runtime::FaceFileSurface& surface);

/// How far the light gets into a mouth, which a file without shadows needs to be told.
///
/// @param z  forward [mm]
/// @return   a tint, grey
glm::vec3 light_in_mouth(double z);

}  // namespace nms::fit_face
