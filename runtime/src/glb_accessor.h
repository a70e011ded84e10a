#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <nlohmann/json.hpp>

namespace nms::runtime {

/// The numbers of an accessor, element by element, sparse ones put in; normalized ones are left as they are.
/// Nothing: it does not lie plainly in the binary chunk (compressed, outside the file, or broken).
/// @param json    the document
/// @param binary  buffer 0
/// @param width   components of an element, 1 to 4: those of its type
[[nodiscard]] std::optional<std::vector<float>> read_accessor(const nlohmann::json& json,
                                                              std::span<const std::byte> binary, std::uint32_t index,
                                                              std::size_t width);

}  // namespace nms::runtime
