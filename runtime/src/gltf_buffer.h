#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <deque>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <tiny_gltf.h>
#include <glm/vec3.hpp>

#include "vertex_grid.h"

namespace nms::runtime {

/// Fills the one buffer, with its views and accessors. What is read in the same way stands in one view, and what is the
/// same to the byte stands there once: a file has few views, and eyes that share their triangles.
///
/// Views are laid one behind the other by finish(); nothing may be added after it.
class GltfBuffer {
 public:
  explicit GltfBuffer(tinygltf::Model& model) : model_(model) { model_.buffers.emplace_back(); }

  /// What a view is read as; the format wants them apart.
  enum class Use : std::uint8_t { vertices, triangles, sparse_indices, sparse_values, keys, matrices };

  /// Views one behind the other, each at a multiple of four bytes.
  void finish() {
    std::vector<unsigned char>& bytes = model_.buffers[0].data;
    for (Stream& stream : streams_) {
      bytes.resize((bytes.size() + 3) / 4 * 4, 0);
      model_.bufferViews[stream.view].byteOffset = bytes.size();
      model_.bufferViews[stream.view].byteLength = stream.bytes.size();
      bytes.insert(bytes.end(), stream.bytes.begin(), stream.bytes.end());
    }
    streams_.clear();
  }

  // Floats, `width` to an element, with exact bounds where `bounds` asks for them.
  int floats(std::span<const float> values, std::size_t width, int type, Use use, bool bounds) {
    tinygltf::Accessor a = accessor(values.size() / width, TINYGLTF_COMPONENT_TYPE_FLOAT, type);
    put(a, values, use, use == Use::vertices ? width * sizeof(float) : 0);
    if (bounds) set_bounds(a, values, width);
    return push(std::move(a));
  }

  int vectors(std::span<const glm::vec3> values, bool bounds) {
    return floats(flat(values), 3, TINYGLTF_TYPE_VEC3, Use::vertices, bounds);
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
    put_sparse_values(a, flat(stored));
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
    put(a, std::span<const std::array<Int, 4>>(padded), Use::vertices, sizeof padded[0]);
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
    put_sparse_values(position, std::span<const std::array<std::int16_t, 3>>(moves));
    put_sparse_values(normal, std::span<const std::array<std::int8_t, 3>>(turns));
    if (!whole) moves.emplace_back();
    set_bounds(position, moves);
    const int first = push(std::move(position));
    return {first, push(std::move(normal))};
  }

  /// Numbers from 0 to 1 in 16 bits, rounded.
  int shares(std::span<const float> values) {
    std::vector<std::uint16_t> steps;
    for (const float v : values) steps.push_back(share_step(v));
    tinygltf::Accessor a = accessor(values.size(), TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT, TINYGLTF_TYPE_SCALAR);
    a.normalized = true;
    put(a, std::span<const std::uint16_t>(steps), Use::keys, 0);
    return push(std::move(a));
  }

  /// @param share  in [0, 1]
  static std::uint16_t share_step(float share) { return static_cast<std::uint16_t>(share * 65535.0F + 0.5F); }

  /// Four bytes to a vertex: whole numbers, or shares of 1 where `normalized`.
  int bytes(std::span<const std::array<std::uint8_t, 4>> values, int type, bool normalized) {
    tinygltf::Accessor a = accessor(values.size(), TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE, type);
    a.normalized = normalized;
    put(a, values, Use::vertices, 4);
    return push(std::move(a));
  }

  // 8-bit colours; the fourth byte is there for the alignment.
  int colors(std::span<const glm::vec3> values) {
    std::vector<std::array<std::uint8_t, 4>> steps;
    const auto byte = [](float c) { return static_cast<std::uint8_t>(std::clamp(c, 0.0F, 1.0F) * 255.0F + 0.5F); };
    for (const glm::vec3& c : values) steps.push_back({byte(c.x), byte(c.y), byte(c.z), 255});
    return bytes(steps, TINYGLTF_TYPE_VEC3, true);
  }

  int triangles(std::span<const std::uint32_t> indices, std::size_t vertex_count) {
    // 65535 itself is the restart value and may not be used.
    const bool small = vertex_count <= 65535;
    tinygltf::Accessor a =
        accessor(indices.size(), small ? TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT : TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT,
                 TINYGLTF_TYPE_SCALAR);
    if (small) {
      const std::vector<std::uint16_t> shorts(indices.begin(), indices.end());
      put(a, std::span(shorts), Use::triangles, 0);
    } else {
      put(a, indices, Use::triangles, 0);
    }
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
    if (a.count <= 65536) {
      const std::vector<std::uint16_t> small(indices.begin(), indices.end());
      a.sparse.indices.componentType = TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT;
      put_sparse_indices(a, std::span(small));
    } else {
      a.sparse.indices.componentType = TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
      put_sparse_indices(a, std::span<const std::uint32_t>(indices));
    }
  }

  // No view begins a piece behind this: offsets into sparse data are counted in 31 bits.
  static constexpr std::size_t kFull = std::size_t{1} << 30;

  struct Stream {
    Use use = Use::vertices;
    std::size_t stride = 0;  // between vertices
    std::size_t view = 0;
    std::vector<unsigned char> bytes;
    std::map<std::string, std::size_t> offsets;  // of what is there
  };

  Stream& stream(Use use, std::size_t stride) {
    for (Stream& s : streams_) {
      if (s.use == use && s.stride == stride && s.bytes.size() < kFull) return s;
    }
    tinygltf::BufferView view;
    view.buffer = 0;
    view.byteStride = stride;
    view.target = use == Use::vertices    ? TINYGLTF_TARGET_ARRAY_BUFFER
                  : use == Use::triangles ? TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER
                                          : 0;
    model_.bufferViews.push_back(std::move(view));
    Stream& fresh = streams_.emplace_back();
    fresh.use = use;
    fresh.stride = stride;
    fresh.view = model_.bufferViews.size() - 1;
    return fresh;
  }

  struct Place {
    int view = 0;
    std::size_t offset = 0;  // in it
  };

  template <typename T>
  Place place(std::span<const T> data, Use use, std::size_t stride) {
    Stream& s = stream(use, stride);
    std::string bytes(data.size_bytes(), '\0');
    if (!data.empty()) std::memcpy(bytes.data(), data.data(), data.size_bytes());
    const auto [known, fresh] = s.offsets.try_emplace(std::move(bytes), 0);
    if (fresh) {
      s.bytes.resize((s.bytes.size() + 3) / 4 * 4, 0);
      known->second = s.bytes.size();
      s.bytes.insert(s.bytes.end(), known->first.begin(), known->first.end());
    }
    return {static_cast<int>(s.view), known->second};
  }

  template <typename T>
  void put(tinygltf::Accessor& a, std::span<const T> data, Use use, std::size_t stride) {
    const Place at = place(data, use, stride);
    a.bufferView = at.view;
    a.byteOffset = at.offset;
  }

  template <typename T>
  void put_sparse_indices(tinygltf::Accessor& a, std::span<const T> data) {
    const Place at = place(data, Use::sparse_indices, 0);
    a.sparse.indices.bufferView = at.view;
    a.sparse.indices.byteOffset = static_cast<int>(at.offset);
  }

  template <typename T>
  void put_sparse_values(tinygltf::Accessor& a, std::span<const T> data) {
    const Place at = place(data, Use::sparse_values, 0);
    a.sparse.values.bufferView = at.view;
    a.sparse.values.byteOffset = static_cast<int>(at.offset);
  }

  int push(tinygltf::Accessor a) {
    model_.accessors.push_back(std::move(a));
    return static_cast<int>(model_.accessors.size()) - 1;
  }

  tinygltf::Model& model_;
  std::deque<Stream> streams_;
};

}  // namespace nms::runtime
