#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace nms::compiler {

/// The layer a contribution belongs to, low to high: grammar stays readable on an angry face.
enum class Layer : std::uint8_t { affect, prosody, mouthing, lexical, morphological, syntactic, discourse };
inline constexpr int kLayerCount = 7;

/// The layer an entry's function puts it in; nothing for a word that is no function.
[[nodiscard]] std::optional<Layer> read_layer(std::string_view function);
[[nodiscard]] std::string_view layer_name(Layer layer);

}  // namespace nms::compiler
