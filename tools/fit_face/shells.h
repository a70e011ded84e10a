#pragma once

#include <nms/runtime/face_x3d.h>

#include "materials.h"
#include "skin_mesh.h"

namespace nms::fit_face {

/// Adds the left brow and the left half of the hair: thin shells that ride on the skin.
void add_shells(const SkinMesh& skin, const Materials& materials, runtime::FaceFile& file);

}  // namespace nms::fit_face
