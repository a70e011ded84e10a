#include "glb_accessor.h"

#include <cstring>

#include "avatar_nodes.h"

namespace nms::runtime {
namespace {

constexpr std::size_t kMaxElements = std::size_t{1} << 22U;  // far above any head, and bounds our memory

std::size_t size_of(std::uint32_t component) {
  switch (component) {
    case 5120:
    case 5121:
      return 1;
    case 5122:
    case 5123:
      return 2;
    case 5125:
    case 5126:
      return 4;
    default:
      return 0;
  }
}

template <typename T>
float load(const std::byte* at) {
  T value{};
  std::memcpy(&value, at, sizeof value);
  return static_cast<float>(value);
}

float component_at(const std::byte* at, std::uint32_t component) {
  switch (component) {
    case 5120:
      return load<std::int8_t>(at);
    case 5121:
      return load<std::uint8_t>(at);
    case 5122:
      return load<std::int16_t>(at);
    case 5123:
      return load<std::uint16_t>(at);
    case 5125:
      return load<std::uint32_t>(at);
    default:
      return load<float>(at);
  }
}

/// Elements as they lie in a buffer view.
struct Lying {
  const std::byte* data = nullptr;
  std::size_t stride = 0;
  std::uint32_t component = 0;
};

std::optional<Lying> elements_at(const Json& json, std::span<const std::byte> binary, const Json& where,
                                 std::uint32_t component, std::size_t count, std::size_t width) {
  const auto index = index_of(member(where, "bufferView"));
  if (!index) return std::nullopt;
  const Json& view = element(member(json, "bufferViews"), *index);
  const std::size_t size = size_of(component) * width;
  if (size == 0 || count == 0 || !view.is_object() || view.contains("extensions") ||
      index_of(member(view, "buffer")) != 0U)
    return std::nullopt;
  const std::size_t begin =
      std::size_t{index_of(member(view, "byteOffset")).value_or(0)} + index_of(member(where, "byteOffset")).value_or(0);
  const std::size_t stride = index_of(member(view, "byteStride")).value_or(static_cast<std::uint32_t>(size));
  if (begin + stride * (count - 1) + size > binary.size()) return std::nullopt;
  return Lying{binary.data() + begin, stride, component};
}

}  // namespace

std::optional<std::vector<float>> read_accessor(const nlohmann::json& json, std::span<const std::byte> binary,
                                                std::uint32_t index, std::size_t width) {
  const Json& accessor = element(member(json, "accessors"), index);
  const std::size_t count = index_of(member(accessor, "count")).value_or(0);
  const std::uint32_t component = index_of(member(accessor, "componentType")).value_or(0);
  constexpr const char* kTypes[] = {"SCALAR", "VEC2", "VEC3", "VEC4"};
  if (count == 0 || count > kMaxElements || size_of(component) == 0 ||
      text_of(member(accessor, "type")) != kTypes[width - 1])
    return std::nullopt;
  std::vector<float> out(count * width, 0.0F);
  const auto copy = [&](const Lying& from, std::size_t i, std::size_t to) {
    for (std::size_t k = 0; k < width; ++k)
      out[to * width + k] = component_at(from.data + i * from.stride + k * size_of(from.component), from.component);
  };
  if (accessor.contains("bufferView")) {
    const auto base = elements_at(json, binary, accessor, component, count, width);
    if (!base) return std::nullopt;
    for (std::size_t i = 0; i < count; ++i) copy(*base, i, i);
  }
  const Json& sparse = member(accessor, "sparse");
  if (sparse.is_null()) return out;
  const std::size_t set = index_of(member(sparse, "count")).value_or(0);
  const Json& at = member(sparse, "indices");
  const auto values = elements_at(json, binary, member(sparse, "values"), component, set, width);
  const auto places = elements_at(json, binary, at, index_of(member(at, "componentType")).value_or(0), set, 1);
  if (!values || !places) return std::nullopt;
  for (std::size_t i = 0; i < set; ++i) {
    const float place = component_at(places->data + i * places->stride, places->component);
    if (!(place >= 0.0F && place < static_cast<float>(count))) return std::nullopt;
    copy(*values, i, static_cast<std::size_t>(place));
  }
  return out;
}

}  // namespace nms::runtime
