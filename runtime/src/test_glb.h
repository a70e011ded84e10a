#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>
#include <tiny_gltf.h>
#include <glm/vec3.hpp>

namespace nms::runtime {

/// A GLB as tinygltf reads it; errors and warnings fail the test.
inline tinygltf::Model read_model(const std::vector<std::byte>& bytes) {
  tinygltf::Model model;
  tinygltf::TinyGLTF reader;
  std::string error;
  std::string warning;
  EXPECT_TRUE(reader.LoadBinaryFromMemory(&model, &error, &warning,
                                          reinterpret_cast<const unsigned char*>(bytes.data()),
                                          static_cast<unsigned int>(bytes.size())));
  EXPECT_EQ(error, "");
  EXPECT_EQ(warning, "");
  return model;
}

inline const tinygltf::Accessor& accessor(const tinygltf::Model& model, int index) {
  return model.accessors[static_cast<std::size_t>(index)];
}

inline const unsigned char* view_bytes(const tinygltf::Model& model, int view) {
  return model.buffers[0].data.data() + model.bufferViews[static_cast<std::size_t>(view)].byteOffset;
}

/// The floats of an accessor that has nothing else.
inline const float* floats(const tinygltf::Model& model, int index) {
  const tinygltf::Accessor& a = accessor(model, index);
  EXPECT_EQ(a.componentType, TINYGLTF_COMPONENT_TYPE_FLOAT);
  return reinterpret_cast<const float*>(view_bytes(model, a.bufferView) + a.byteOffset);
}

/// One number of a vertex attribute, as a viewer reads it (glTF 2.0, 3.11).
inline float component(const unsigned char* at, int type, bool normalized) {
  const auto load = [&](auto value) {
    std::memcpy(&value, at, sizeof value);
    return value;
  };
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_FLOAT:
      return load(0.0F);
    case TINYGLTF_COMPONENT_TYPE_BYTE: {
      const auto c = static_cast<float>(load(std::int8_t{}));
      return normalized ? std::fmax(c / 127.0F, -1.0F) : c;
    }
    case TINYGLTF_COMPONENT_TYPE_SHORT: {
      const auto c = static_cast<float>(load(std::int16_t{}));
      return normalized ? std::fmax(c / 32767.0F, -1.0F) : c;
    }
    default:
      ADD_FAILURE() << "component type " << type;
      return 0.0F;
  }
}

/// A VEC3 accessor with its sparse data put in, scaled where it is normalized.
inline std::vector<glm::vec3> vectors(const tinygltf::Model& model, int index) {
  const tinygltf::Accessor& a = accessor(model, index);
  const auto size =
      static_cast<std::size_t>(tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(a.componentType)));
  std::vector<glm::vec3> result(a.count, glm::vec3(0.0F));
  const auto read = [&](const unsigned char* at) {
    return glm::vec3(component(at, a.componentType, a.normalized), component(at + size, a.componentType, a.normalized),
                     component(at + 2 * size, a.componentType, a.normalized));
  };
  if (a.bufferView >= 0) {
    const std::size_t given = model.bufferViews[static_cast<std::size_t>(a.bufferView)].byteStride;
    const std::size_t stride = given != 0 ? given : 3 * size;
    const unsigned char* data = view_bytes(model, a.bufferView) + a.byteOffset;
    for (std::size_t i = 0; i < a.count; ++i) result[i] = read(data + i * stride);
  }
  if (a.sparse.isSparse) {
    const unsigned char* values = view_bytes(model, a.sparse.values.bufferView) + a.sparse.values.byteOffset;
    const auto* indices = reinterpret_cast<const std::uint16_t*>(view_bytes(model, a.sparse.indices.bufferView) +
                                                                 a.sparse.indices.byteOffset);
    for (std::size_t i = 0; i < static_cast<std::size_t>(a.sparse.count); ++i) {
      if (i > 0) {
        EXPECT_LT(indices[i - 1], indices[i]);
      }
      result[indices[i]] = read(values + i * 3 * size);
    }
  }
  return result;
}

inline std::vector<std::string> target_names(const tinygltf::Model& model, std::size_t mesh = 0) {
  std::vector<std::string> names;
  const tinygltf::Value& list = model.meshes[mesh].extras.Get("targetNames");
  for (std::size_t i = 0; i < list.ArrayLen(); ++i) names.push_back(list.Get(static_cast<int>(i)).Get<std::string>());
  return names;
}

inline int node_named(const tinygltf::Model& model, std::string_view name) {
  for (std::size_t i = 0; i < model.nodes.size(); ++i) {
    if (model.nodes[i].name == name) return static_cast<int>(i);
  }
  ADD_FAILURE() << "no node " << name;
  return -1;
}

}  // namespace nms::runtime
