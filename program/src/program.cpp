#include <nms/program/program.h>

#include <cassert>

namespace nms::program {

std::string_view Program::string(StringId id) const {
  const auto index = static_cast<std::size_t>(id);
  assert(index + 1 < string_begin.size());
  const std::uint32_t begin = string_begin[index];
  return {string_bytes.data() + begin, string_begin[index + 1] - begin};
}

const Clip* Program::find_clip(std::string_view name) const {
  for (const Clip& clip : clips) {
    if (string(clip.name) == name) {
      return &clip;
    }
  }
  return nullptr;
}

}  // namespace nms::program
