#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace nms::compiler {

/// The layer a contribution belongs to, low to high: grammar stays readable on an angry face, and a face that only
/// lives gives way to one that says something.
enum class Layer : std::uint8_t { ambient, affect, prosody, mouthing, lexical, morphological, syntactic, discourse };
inline constexpr int kLayerCount = 8;

/// Language, and not affect or what a face does by itself.
[[nodiscard]] constexpr bool linguistic(Layer layer) { return layer > Layer::affect; }

/// The layer an entry's function puts it in; nothing for a word that is no function. No entry is ambient.
[[nodiscard]] std::optional<Layer> read_layer(std::string_view function);
[[nodiscard]] std::string_view layer_name(Layer layer);

}  // namespace nms::compiler
