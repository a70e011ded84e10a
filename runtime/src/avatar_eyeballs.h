#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <nlohmann/json.hpp>

namespace nms::runtime {

/// A morph target of a node's mesh.
struct NodeTarget {
  std::uint32_t node = 0;
  std::size_t index = 0;
};

enum class EyeballsMove : std::uint8_t { yes, no, unknown };

/// Whether morph targets turn the eyeballs, and not the lids alone, as Apple defines eyeLook...: then the eyeballs are
/// left to the bones. Eyeballs are the vertices that hang on the bones given, by their heaviest joint or as a mesh
/// below the bone. Unknown: no such vertices, or none that can be read (compressed).
/// @param json     the document
/// @param binary   buffer 0
/// @param parents  of every node
[[nodiscard]] EyeballsMove eyeballs_move(const nlohmann::json& json, std::span<const std::byte> binary,
                                         std::span<const std::uint32_t> parents,
                                         std::span<const std::uint32_t> eye_bones, std::span<const NodeTarget> targets);

}  // namespace nms::runtime
