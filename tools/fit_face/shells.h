#pragma once

#include <nms/runtime/face_x3d.h>

#include "materials.h"
#include "model.h"

namespace nms::fit_face {

/// Adds the left brow, the left half of the hair and the left cheek's inside: thin shells that ride on the skin.
void add_shells(const Model& model, const Materials& materials, runtime::FaceFile& file);

}  // namespace nms::fit_face
