#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include <tl/expected.hpp>

#include <nms/program/failure.h>

namespace nms::runtime {

/// A chunk that glTF 2.0 does not know: extensions may add some, and who edits a file keeps them.
struct OtherChunk {
  std::uint32_t type = 0;
  std::vector<std::byte> data;
};

/// A binary glTF file taken apart.
struct GlbChunks {
  std::string text;  ///< the JSON chunk as it is written
  std::vector<std::byte> binary;
  std::vector<OtherChunk> others;
};

/// A binary glTF file with what its JSON says.
struct GlbFile {
  GlbChunks chunks;
  nlohmann::json json;  ///< an object
};

/// Failures: bad_avatar (not a GLB of version 2, cut short, no JSON object in it, more than 32 MiB of JSON).
/// @param place  what messages call the file
[[nodiscard]] tl::expected<GlbFile, program::Failure> read_glb(std::span<const std::byte> bytes,
                                                               const std::string& place);

[[nodiscard]] std::vector<std::byte> write_glb(const GlbChunks& chunks);

}  // namespace nms::runtime
