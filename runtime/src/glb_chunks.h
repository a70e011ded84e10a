#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include <tl/expected.hpp>

#include <nms/program/failure.h>

namespace nms::runtime {

/// A binary glTF file taken apart: its JSON, members in the file's own order, and its binary chunk.
struct GlbChunks {
  nlohmann::ordered_json json;
  std::vector<std::byte> binary;
};

/// Failures: bad_avatar (not a GLB of version 2, cut short, no JSON object in it).
/// @param place  what messages call the file
[[nodiscard]] tl::expected<GlbChunks, program::Failure> read_glb(std::span<const std::byte> bytes,
                                                                 const std::string& place);

[[nodiscard]] std::vector<std::byte> write_glb(const GlbChunks& chunks);

}  // namespace nms::runtime
