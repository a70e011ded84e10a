#pragma once

#include <nms/runtime/face_x3d.h>

#include "materials.h"
#include "model.h"

namespace nms::fit_face {

/// Adds what is rigid: eyeball, teeth, gums, tongue, the cap that closes the nostril, the bag behind the mouth.
void add_parts(const Model& model, const Materials& materials, runtime::FaceFile& file);

}  // namespace nms::fit_face
