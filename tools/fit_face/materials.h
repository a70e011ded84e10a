#pragma once

#include <cstdint>

#include <nms/runtime/face_x3d.h>

namespace nms::fit_face {

/// Indices into FaceFile::materials.
struct Materials {
  std::uint32_t skin, lips, mouth_lining, cheek, dark, sclera, iris, limbus, pupil, brow, hair, teeth, gums, tongue;
};

Materials add_materials(runtime::FaceFile& file);

}  // namespace nms::fit_face
