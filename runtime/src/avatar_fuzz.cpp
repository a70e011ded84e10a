#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>

#include <nms/program/text.h>
#include <nms/runtime/gltf_avatar.h>

#include "glb_chunks.h"
#include "test_face.h"

namespace {

using namespace nms;

constexpr const char* kClip = R"(
clip ask utterance -0.2s..1s hash 0000000000000001
  curve AU12L
    -0.2s 0 smooth
    0.1s 0.8 smooth
    1s 0 hold
  curve head_yaw
    0s 0 smooth
    0.5s 0.5 smooth
    1s 0 hold
  curve gaze_pitch
    0s 0 smooth
    0.5s -0.5 smooth
    1s 0 hold
)";

void animate(std::span<const std::byte> glb) {
  static const program::Image image = runtime::test_program(kClip);
  static const program::Clip* const clips[] = {image.program().find_clip("ask")};
  const auto made = runtime::animate_avatar(glb, "fuzz", image.program(), clips);
  if (!made) return;
  // What comes out is a GLB again, and has the clip: it is not taken twice.
  if (!runtime::read_glb(made->glb, "fuzz")) std::abort();
}

}  // namespace

/// The input as a whole file, and as the JSON of one.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto* bytes = reinterpret_cast<const std::byte*>(data);
  animate({bytes, size});
  runtime::GlbChunks chunks;
  chunks.text.assign(reinterpret_cast<const char*>(data), size);
  animate(runtime::write_glb(chunks));
  return 0;
}
