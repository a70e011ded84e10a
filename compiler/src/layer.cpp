#include "layer.h"

#include <cstddef>

namespace nms::compiler {
namespace {

constexpr std::string_view kNames[kLayerCount] = {"ambient", "affect",        "prosody",   "mouthing",
                                                  "lexical", "morphological", "syntactic", "discourse"};

}  // namespace

std::optional<Layer> read_layer(std::string_view function) {
  for (int i = static_cast<int>(Layer::affect); i < kLayerCount; ++i)
    if (kNames[i] == function) return static_cast<Layer>(i);
  return std::nullopt;
}

std::string_view layer_name(Layer layer) { return kNames[static_cast<std::size_t>(layer)]; }

}  // namespace nms::compiler
