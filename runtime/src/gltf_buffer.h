#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <tiny_gltf.h>
#include <glm/vec3.hpp>

namespace nms::runtime {

/// Unique names of [A-Za-z0-9_-]: some viewers strip other characters, and bind by name.
class GltfNames {
 public:
  std::string unique(std::string_view wanted) {
    std::string base;
    for (const char c : wanted) {
      const bool plain =
          (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
      base += plain ? c : '_';
    }
    if (base.empty()) base = "unnamed";
    std::string name = base;
    for (int i = 2; !taken_.insert(name).second; ++i) name = fmt::format("{}_{}", base, i);
    return name;
  }

 private:
  std::set<std::string> taken_;
};

/// Appends data to the one buffer, with its views and accessors.
class GltfBuffer {
 public:
  explicit GltfBuffer(tinygltf::Model& model) : model_(model) { model_.buffers.emplace_back(); }

  template <typename T>
  int view(std::span<const T> data, int target) {
    std::vector<unsigned char>& bytes = model_.buffers[0].data;
    while (bytes.size() % 4 != 0) bytes.push_back(0);
    const std::size_t begin = bytes.size();
    bytes.resize(begin + data.size_bytes());
    if (!data.empty()) std::memcpy(bytes.data() + begin, data.data(), data.size_bytes());
    tinygltf::BufferView v;
    v.buffer = 0;
    v.byteOffset = begin;
    v.byteLength = data.size_bytes();
    v.target = target;
    model_.bufferViews.push_back(std::move(v));
    return static_cast<int>(model_.bufferViews.size()) - 1;
  }

  // Floats, `width` to an element, with exact bounds where `bounds` asks for them.
  int floats(std::span<const float> values, std::size_t width, int type, int target, bool bounds) {
    tinygltf::Accessor a = accessor(values.size() / width, TINYGLTF_COMPONENT_TYPE_FLOAT, type);
    a.bufferView = view(values, target);
    if (bounds) set_bounds(a, values, width);
    return push(std::move(a));
  }

  int vectors(std::span<const glm::vec3> values, bool bounds) {
    return floats(flat(values), 3, TINYGLTF_TYPE_VEC3, TINYGLTF_TARGET_ARRAY_BUFFER, bounds);
  }

  // Vectors that are zero but for some. At least one element is stored: a count of 0 is not allowed, and an accessor
  // with neither a view nor sparse data breaks importers.
  int sparse_vectors(std::span<const glm::vec3> values, bool bounds) {
    std::vector<std::uint32_t> indices;
    std::vector<glm::vec3> stored;
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (values[i] == glm::vec3(0.0F)) continue;
      indices.push_back(static_cast<std::uint32_t>(i));
      stored.push_back(values[i]);
    }
    if (indices.empty()) {
      indices.push_back(0);
      stored.emplace_back(0.0F);
    }
    tinygltf::Accessor a = accessor(values.size(), TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_VEC3);
    a.bufferView = -1;
    a.sparse.isSparse = true;
    a.sparse.count = static_cast<int>(indices.size());
    a.sparse.indices.byteOffset = 0;
    a.sparse.values.byteOffset = 0;
    if (values.size() <= 65536) {
      const std::vector<std::uint16_t> small(indices.begin(), indices.end());
      a.sparse.indices.componentType = TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT;
      a.sparse.indices.bufferView = view(std::span(small), 0);
    } else {
      a.sparse.indices.componentType = TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
      a.sparse.indices.bufferView = view(std::span<const std::uint32_t>(indices), 0);
    }
    a.sparse.values.bufferView = view(flat(stored), 0);
    if (bounds) set_bounds(a, flat(values), 3);
    return push(std::move(a));
  }

  int triangles(std::span<const std::uint32_t> indices, std::size_t vertex_count) {
    // 65535 itself is the restart value and may not be used.
    const bool small = vertex_count <= 65535;
    tinygltf::Accessor a =
        accessor(indices.size(), small ? TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT : TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT,
                 TINYGLTF_TYPE_SCALAR);
    if (small) {
      const std::vector<std::uint16_t> shorts(indices.begin(), indices.end());
      a.bufferView = view(std::span(shorts), TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER);
    } else {
      a.bufferView = view(indices, TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER);
    }
    return push(std::move(a));
  }

  int joints(std::span<const std::array<std::uint8_t, 4>> values) {
    tinygltf::Accessor a = accessor(values.size(), TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE, TINYGLTF_TYPE_VEC4);
    a.bufferView = view(values, TINYGLTF_TARGET_ARRAY_BUFFER);
    return push(std::move(a));
  }

  static std::span<const float> flat(std::span<const glm::vec3> values) {
    static_assert(sizeof(glm::vec3) == 3 * sizeof(float));
    return values.empty() ? std::span<const float>() : std::span<const float>(&values[0].x, values.size() * 3);
  }

 private:
  static tinygltf::Accessor accessor(std::size_t count, int component, int type) {
    tinygltf::Accessor a;
    a.byteOffset = 0;
    a.count = count;
    a.componentType = component;
    a.type = type;
    a.normalized = false;
    a.sparse.isSparse = false;
    return a;
  }

  static void set_bounds(tinygltf::Accessor& a, std::span<const float> values, std::size_t width) {
    a.minValues.assign(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(width));
    a.maxValues = a.minValues;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const double value = static_cast<double>(values[i]);
      a.minValues[i % width] = std::min(a.minValues[i % width], value);
      a.maxValues[i % width] = std::max(a.maxValues[i % width], value);
    }
    // -0 and 0 compare equal, and which one is kept depends on the order; write 0.
    for (double& v : a.minValues) v += 0.0;
    for (double& v : a.maxValues) v += 0.0;
  }

  int push(tinygltf::Accessor a) {
    model_.accessors.push_back(std::move(a));
    return static_cast<int>(model_.accessors.size()) - 1;
  }

  tinygltf::Model& model_;
};

}  // namespace nms::runtime
