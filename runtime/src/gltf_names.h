#pragma once

#include <cstddef>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include <nms/program/program.h>

namespace nms::runtime {

/// A name of [A-Za-z0-9_-] alone: some viewers strip other characters, and bind by name.
inline std::string gltf_name(std::string_view wanted) {
  std::string name;
  for (const char c : wanted) {
    const bool plain =
        (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
    name += plain ? c : '_';
  }
  return name.empty() ? "unnamed" : name;
}

/// Plain names, each once.
class GltfNames {
 public:
  std::string unique(std::string_view wanted) {
    const std::string base = gltf_name(wanted);
    std::string name = base;
    for (int i = 2; !taken_.insert(name).second; ++i) name = fmt::format("{}_{}", base, i);
    return name;
  }

 private:
  std::set<std::string> taken_;
};

/// A clip's name in files does not hang on what else is exported: one whose name is plain already keeps it (`d_x`), the
/// others take what is left, in the program's order (`d.x` becomes `d_x_2`).
/// @returns one for each clip of the program
inline std::vector<std::string> clip_names(const program::Program& program) {
  GltfNames names;
  std::vector<std::string> result(program.clips.size());
  for (const bool plain : {true, false}) {
    for (std::size_t c = 0; c < result.size(); ++c) {
      const std::string_view own = program.string(program.clips[c].name);
      if ((gltf_name(own) == own) == plain) result[c] = names.unique(own);
    }
  }
  return result;
}

}  // namespace nms::runtime
