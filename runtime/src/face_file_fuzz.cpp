#include <cstddef>
#include <cstdint>
#include <string_view>

#include <nms/runtime/face_file.h>

#include "surface_graph.h"

namespace {

using namespace nms::runtime;

/// A file of every kind, however it begins: what is read hangs together.
void read_as(std::string_view bytes, const char* name, const FaceForm& form) {
  const auto face = read_face(bytes, name, form);
  if (!face) return;
  const std::size_t points = face->skin.points.size();
  if (face->skin.surface.columns != points) __builtin_trap();
  for (const Primitive& p : face->skin.primitives)
    for (const std::uint32_t v : p.triangles)
      if (v >= face->skin.surface.rows) __builtin_trap();
  for (const auto& [region, weights] : face->regions)
    if (weights.size() != points) __builtin_trap();
}

FaceForm every_landmark_at_a_vertex() {
  FaceForm form;
  std::uint32_t v = 0;
  for (const char* name : {"nose_tip", "mouth_corner_L", "mouth_corner_R", "lip_upper_mid", "lip_lower_mid", "stomion",
                           "menton", "jaw_hinge_L", "eye_inner_L", "eye_outer_L", "lid_upper_mid_L", "lid_lower_mid_L"})
    form.landmarks.push_back({name, v++, "", {}});
  return form;
}

}  // namespace

/// The input as a file of each kind, with and without landmarks.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const FaceForm kPlain;
  static const FaceForm kMarked = every_landmark_at_a_vertex();
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  for (const char* name : {"f.x3d", "f.wrl", "f.obj", "f.gltf"}) read_as(bytes, name, kPlain);
  read_as(bytes, "f.obj", kMarked);
  return 0;
}
