#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <utility>
#include <vector>

#include <tiny_gltf.h>
#include <glm/vec3.hpp>

#include "vertex_grid.h"

namespace nms::runtime {

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
    set_sparse(a, indices);
    a.sparse.values.bufferView = view(flat(stored), 0);
    if (bounds) set_bounds(a, flat(values), 3);
    return push(std::move(a));
  }

  /// Vectors in whole numbers: `scale` times them are the values. Each begins at a multiple of four bytes, as vertices
  /// must (KHR_mesh_quantization).
  template <typename Int>
  int steps(std::span<const glm::vec3> values, float scale, bool bounds) {
    std::vector<std::array<Int, 4>> padded;
    padded.reserve(values.size());
    for (const glm::vec3& v : values) {
      const std::array<Int, 3> s = steps_of<Int>(v, scale);
      padded.push_back({s[0], s[1], s[2], 0});
    }
    tinygltf::Accessor a = accessor(values.size(), component_of<Int>(), TINYGLTF_TYPE_VEC3);
    a.normalized = true;
    a.bufferView = view(std::span<const std::array<Int, 4>>(padded), TINYGLTF_TARGET_ARRAY_BUFFER);
    model_.bufferViews.back().byteStride = sizeof(std::array<Int, 4>);
    if (bounds) set_bounds(a, padded);
    return push(std::move(a));
  }

  /// The displacements and turns of a target, where most are zero: both are stored for the same vertices, close
  /// together.
  /// @returns the accessors of POSITION and NORMAL
  std::pair<int, int> sparse_steps(std::span<const glm::vec3> moved, float scale, std::span<const glm::vec3> turned) {
    std::vector<std::uint32_t> indices;
    std::vector<std::array<std::int16_t, 3>> moves;
    std::vector<std::array<std::int8_t, 3>> turns;
    for (std::size_t i = 0; i < moved.size(); ++i) {
      const auto m = steps_of<std::int16_t>(moved[i], scale);
      const auto n = steps_of<std::int8_t>(turned[i], 1.0F);
      if (m == std::array<std::int16_t, 3>{} && n == std::array<std::int8_t, 3>{}) continue;
      indices.push_back(static_cast<std::uint32_t>(i));
      moves.push_back(m);
      turns.push_back(n);
    }
    const bool whole = indices.size() == moved.size();
    if (indices.empty()) {
      indices.push_back(0);
      moves.emplace_back();
      turns.emplace_back();
    }
    tinygltf::Accessor position = accessor(moved.size(), TINYGLTF_COMPONENT_TYPE_SHORT, TINYGLTF_TYPE_VEC3);
    position.normalized = true;
    set_sparse(position, indices);
    tinygltf::Accessor normal = position;
    normal.componentType = TINYGLTF_COMPONENT_TYPE_BYTE;
    position.sparse.values.bufferView = view(std::span<const std::array<std::int16_t, 3>>(moves), 0);
    normal.sparse.values.bufferView = view(std::span<const std::array<std::int8_t, 3>>(turns), 0);
    if (!whole) moves.emplace_back();
    set_bounds(position, moves);
    const int first = push(std::move(position));
    return {first, push(std::move(normal))};
  }

  // 16-bit shares of 1, which sum up to 1 exactly.
  int shares(std::span<const std::array<std::uint16_t, 4>> values) {
    tinygltf::Accessor a = accessor(values.size(), TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT, TINYGLTF_TYPE_VEC4);
    a.normalized = true;
    a.bufferView = view(values, TINYGLTF_TARGET_ARRAY_BUFFER);
    return push(std::move(a));
  }

  // 8-bit colours; the fourth byte is there for the alignment.
  int colors(std::span<const glm::vec3> values) {
    std::vector<std::array<std::uint8_t, 4>> bytes;
    const auto byte = [](float c) { return static_cast<std::uint8_t>(std::clamp(c, 0.0F, 1.0F) * 255.0F + 0.5F); };
    for (const glm::vec3& c : values) bytes.push_back({byte(c.x), byte(c.y), byte(c.z), 255});
    tinygltf::Accessor a = accessor(values.size(), TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE, TINYGLTF_TYPE_VEC3);
    a.normalized = true;
    a.bufferView = view(std::span<const std::array<std::uint8_t, 4>>(bytes), TINYGLTF_TARGET_ARRAY_BUFFER);
    model_.bufferViews.back().byteStride = 4;
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

  // In the numbers that are stored.
  template <typename Steps>
  static void set_bounds(tinygltf::Accessor& a, const std::vector<Steps>& values) {
    for (std::size_t i = 0; i < 3; ++i) {
      const auto [low, high] = std::minmax_element(values.begin(), values.end(),
                                                   [&](const Steps& p, const Steps& q) { return p[i] < q[i]; });
      a.minValues.push_back(static_cast<double>((*low)[i]));
      a.maxValues.push_back(static_cast<double>((*high)[i]));
    }
  }

  template <typename Int>
  static std::array<Int, 3> steps_of(const glm::vec3& v, float scale) {
    return {step_of<Int>(v.x / scale), step_of<Int>(v.y / scale), step_of<Int>(v.z / scale)};
  }

  template <typename Int>
  static constexpr int component_of() {
    return sizeof(Int) == 1 ? TINYGLTF_COMPONENT_TYPE_BYTE : TINYGLTF_COMPONENT_TYPE_SHORT;
  }

  void set_sparse(tinygltf::Accessor& a, const std::vector<std::uint32_t>& indices) {
    a.bufferView = -1;
    a.sparse.isSparse = true;
    a.sparse.count = static_cast<int>(indices.size());
    a.sparse.indices.byteOffset = 0;
    a.sparse.values.byteOffset = 0;
    if (a.count <= 65536) {
      const std::vector<std::uint16_t> small(indices.begin(), indices.end());
      a.sparse.indices.componentType = TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT;
      a.sparse.indices.bufferView = view(std::span(small), 0);
    } else {
      a.sparse.indices.componentType = TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
      a.sparse.indices.bufferView = view(std::span<const std::uint32_t>(indices), 0);
    }
  }

  int push(tinygltf::Accessor a) {
    model_.accessors.push_back(std::move(a));
    return static_cast<int>(model_.accessors.size()) - 1;
  }

  tinygltf::Model& model_;
};

}  // namespace nms::runtime
