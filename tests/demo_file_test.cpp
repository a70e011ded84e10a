// The files that `nmsc build` writes, read back with tinygltf: the brows of a question move, and every build of nmsc
// writes the same bytes. The hashes stand in tests/golden/file_hashes.txt; they change with the face, the muscles, the
// library and the exporter. NMS_REFRESH=1 rewrites them.
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#define XXH_INLINE_ALL
#include <tiny_gltf.h>
#include <xxhash.h>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

namespace {

namespace fs = std::filesystem;
const fs::path kRoot = NMS_SOURCE_DIR;

std::string read(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

/// A file that the command under test makes of an example.
fs::path built(const std::string& example, const std::string& flags) {
  const fs::path out =
      fs::temp_directory_path() / fmt::format("nms_demo_file_test_{}{}_{}.glb", example, flags, ::getpid());
  const std::string command = fmt::format("\"{}\" build \"{}\" -o \"{}\" {} 2>/dev/null", NMSC,
                                          (kRoot / "examples" / (example + ".nms")).string(), out.string(), flags);
  EXPECT_EQ(std::system(command.c_str()), 0) << command;
  return out;
}

template <typename T>
std::vector<T> values(const tinygltf::Model& model, int accessor_index) {
  const tinygltf::Accessor& a = model.accessors[static_cast<std::size_t>(accessor_index)];
  const tinygltf::BufferView& view = model.bufferViews[static_cast<std::size_t>(a.bufferView)];
  const unsigned char* data = model.buffers[0].data.data() + view.byteOffset + a.byteOffset;
  const auto stride = static_cast<std::size_t>(a.ByteStride(view));
  std::vector<T> out(a.count);
  for (std::size_t i = 0; i < a.count; ++i) std::memcpy(&out[i], data + i * stride, sizeof(T));
  return out;
}

/// Indices of a primitive, whatever their width.
std::vector<std::uint32_t> indices(const tinygltf::Model& model, int accessor_index) {
  if (model.accessors[static_cast<std::size_t>(accessor_index)].componentType ==
      TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT) {
    const auto narrow = values<std::uint16_t>(model, accessor_index);
    return {narrow.begin(), narrow.end()};
  }
  return values<std::uint32_t>(model, accessor_index);
}

TEST(DemoFile, a_question_moves_the_brows_by_three_millimetres) {
  const fs::path path = built("wh_question", "--dense");
  tinygltf::Model model;
  tinygltf::TinyGLTF loader;
  std::string error, warning;
  ASSERT_TRUE(loader.LoadBinaryFromFile(&model, &error, &warning, path.string())) << error;
  fs::remove(path);

  const auto mesh = std::find_if(model.meshes.begin(), model.meshes.end(),
                                 [](const tinygltf::Mesh& m) { return !m.weights.empty() && m.name == "skin"; });
  ASSERT_NE(mesh, model.meshes.end());
  const auto animation = std::find_if(model.animations.begin(), model.animations.end(),
                                      [](const tinygltf::Animation& a) { return a.name == "where_is_the_book"; });
  ASSERT_NE(animation, model.animations.end());
  std::vector<float> weights;
  for (const tinygltf::AnimationChannel& channel : animation->channels) {
    if (channel.target_path != "weights") continue;
    const auto node = static_cast<std::size_t>(channel.target_node);
    if (model.meshes[static_cast<std::size_t>(model.nodes[node].mesh)].name != "skin") continue;
    weights = values<float>(model, animation->samplers[static_cast<std::size_t>(channel.sampler)].output);
  }
  const std::size_t targets = mesh->weights.size();
  ASSERT_FALSE(weights.empty());

  std::size_t brow_primitives = 0;
  double most = 0.0;
  for (const tinygltf::Primitive& primitive : mesh->primitives) {
    if (model.materials[static_cast<std::size_t>(primitive.material)].name != "brow") continue;
    ++brow_primitives;
    std::vector<std::vector<glm::vec3>> delta;
    for (const auto& target : primitive.targets) delta.push_back(values<glm::vec3>(model, target.at("POSITION")));
    std::vector<std::uint32_t> used = indices(model, primitive.indices);
    std::sort(used.begin(), used.end());
    used.erase(std::unique(used.begin(), used.end()), used.end());
    for (std::size_t key = 0; key * targets < weights.size(); ++key)
      for (const std::uint32_t v : used) {
        glm::vec3 moved(0.0F);
        for (std::size_t t = 0; t < targets; ++t) moved += weights[key * targets + t] * delta[t][v];
        most = std::max(most, static_cast<double>(glm::length(moved)));
      }
  }
  EXPECT_EQ(brow_primitives, 1U);
  EXPECT_GE(most, 0.003);
  EXPECT_LE(most, 0.020);
}

TEST(DemoFile, every_build_writes_the_same_bytes) {
  const fs::path table = kRoot / "tests/golden/file_hashes.txt";
  std::string found;
  for (const char* example : {"lexical", "six_emotions", "thesis_smile", "wh_question"}) {
    const fs::path path = built(example, "");
    const std::string bytes = read(path);
    fs::remove(path);
    found += fmt::format("{} {} bytes {:016x}\n", example, bytes.size(), XXH3_64bits(bytes.data(), bytes.size()));
  }
  if (std::getenv("NMS_REFRESH") != nullptr) std::ofstream(table, std::ios::binary) << found;
  EXPECT_EQ(found, read(table));
}

}  // namespace
