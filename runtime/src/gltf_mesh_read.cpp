#include <algorithm>
#include <cmath>
#include <cstring>
#include <exception>
#include <map>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>

#include <tiny_gltf.h>

#include <nms/runtime/polygon_mesh.h>

namespace nms::runtime {

namespace {

using program::Failure;
using Maybe = std::optional<Failure>;

constexpr int kMaxDepth = 64;
constexpr std::size_t kMaxUses = 4096;

/// Numbers of an accessor, where they lie.
struct Numbers {
  const unsigned char* data = nullptr;
  std::size_t count = 0;
  std::size_t stride = 0;
  int type = 0;  ///< component type
  bool normalized = false;
};

/// What puts a mesh where it is shown: its node, or the joints of its skin.
struct Placed {
  std::vector<glm::dmat4> by;
  bool skinned = false;
};

class GltfReader {
 public:
  GltfReader(std::string_view name, const PolygonLimits& limits) : name_(name), limits_(limits) {}

  tl::expected<PolygonMesh, Failure> run(std::string_view bytes) {
    if (bytes.size() > limits_.bytes) return tl::unexpected(too_large(fmt::format("it has {} bytes", bytes.size())));
    if (auto failure = load(bytes)) return tl::unexpected(std::move(*failure));
    if (auto failure = find_parents()) return tl::unexpected(std::move(*failure));
    if (!model_.scenes.empty()) {
      const auto scene =
          static_cast<std::size_t>(std::clamp<int>(model_.defaultScene, 0, static_cast<int>(model_.scenes.size()) - 1));
      for (const int node : model_.scenes[scene].nodes)
        if (auto failure = walk(node, glm::dmat4(1.0), 0)) return tl::unexpected(std::move(*failure));
    } else {
      for (std::size_t m = 0; m < model_.meshes.size(); ++m)
        if (auto failure = mesh(model_.meshes[m], "", {{glm::dmat4(1.0)}, false}))
          return tl::unexpected(std::move(*failure));
    }
    if (triangles_ == 0) {
      return tl::unexpected(Failure{"face_empty", std::string(name_), "its scene shows no triangles",
                                    "give it a mesh of triangles, in a node of its scene"});
    }
    return std::move(mesh_);
  }

 private:
  Failure too_large(std::string cause) const {
    return {"face_too_large", std::string(name_), std::move(cause),
            "a head of 200,000 vertices is plenty: simplify it"};
  }
  Failure bad(std::string where, std::string cause) const {
    return {"face_bad_index", fmt::format("{}: {}", name_, where), std::move(cause),
            "write the file again from the program that made it"};
  }

  // No disk and no pictures: what a face needs is in the file itself.
  Maybe load(std::string_view bytes) {
    tinygltf::TinyGLTF loader;
    loader.SetImageLoader([](tinygltf::Image*, const int, std::string*, std::string*, int, int, const unsigned char*,
                             int, void*) { return true; },
                          nullptr);
    tinygltf::FsCallbacks files{};
    files.FileExists = [](const std::string&, void*) { return false; };
    files.ExpandFilePath = [](const std::string& path, void*) { return path; };
    files.ReadWholeFile = [](std::vector<unsigned char>*, std::string*, const std::string&, void*) { return false; };
    files.WriteWholeFile = [](std::string*, const std::string&, const std::vector<unsigned char>&, void*) {
      return false;
    };
    loader.SetFsCallbacks(files);
    std::string error;
    std::string warning;
    bool read = false;
    try {
      if (bytes.substr(0, 4) == "glTF")
        read =
            loader.LoadBinaryFromMemory(&model_, &error, &warning, reinterpret_cast<const unsigned char*>(bytes.data()),
                                        static_cast<unsigned int>(bytes.size()));
      else
        read = loader.LoadASCIIFromString(&model_, &error, &warning, bytes.data(),
                                          static_cast<unsigned int>(bytes.size()), "");
    } catch (const std::exception& e) {
      error = e.what();
    }
    if (read) return std::nullopt;
    std::string cause = error.substr(0, error.find('\n'));
    if (cause.size() > 200) cause.resize(200);
    return Failure{"face_not_gltf", std::string(name_),
                   fmt::format("it cannot be read as glTF 2.0: {}", cause.empty() ? "no reason given" : cause),
                   "save it as one .glb file, its buffers inside, without compression"};
  }

  template <typename T>
  static bool has(const std::vector<T>& all, int index) {
    return index >= 0 && static_cast<std::size_t>(index) < all.size();
  }

  Maybe walk(int index, const glm::dmat4& parent, int depth) {
    if (!has(model_.nodes, index)) return bad("scene", fmt::format("there is no node {}", index));
    if (depth > kMaxDepth) return bad(fmt::format("node {}", index), "nodes are nested without end");
    if (++uses_ > kMaxUses) return too_large(fmt::format("it shows more than {} nodes", kMaxUses));
    const tinygltf::Node& node = model_.nodes[static_cast<std::size_t>(index)];
    const glm::dmat4 here = parent * local(node);
    if (node.mesh >= 0) {
      if (!has(model_.meshes, node.mesh)) return bad(fmt::format("node {}", index), "its mesh is not there");
      Placed placed{{here}, false};
      if (node.skin >= 0) {
        if (auto failure = joints_at_rest(node.skin, placed)) return failure;
      }
      if (auto failure = mesh(model_.meshes[static_cast<std::size_t>(node.mesh)], node.name, placed)) return failure;
    }
    for (const int child : node.children)
      if (auto failure = walk(child, here, depth + 1)) return failure;
    return std::nullopt;
  }

  Maybe find_parents() {
    parents_.assign(model_.nodes.size(), -1);
    for (std::size_t n = 0; n < model_.nodes.size(); ++n)
      for (const int child : model_.nodes[n].children) {
        if (!has(model_.nodes, child)) return bad(fmt::format("node {}", n), fmt::format("there is no node {}", child));
        parents_[static_cast<std::size_t>(child)] = static_cast<int>(n);
      }
    return std::nullopt;
  }

  /// A skin's joints in the scene, each behind its inverse bind matrix: they place vertices, whatever the mesh's own
  /// node says (glTF 2.0, 3.7.3.3).
  Maybe joints_at_rest(int index, Placed& out) const {
    if (!has(model_.skins, index)) return bad("skins", fmt::format("there is no skin {}", index));
    const tinygltf::Skin& skin = model_.skins[static_cast<std::size_t>(index)];
    const std::string where = fmt::format("skin '{}'", skin.name.substr(0, 60));
    if (skin.joints.empty() || skin.joints.size() > kMaxUses) return bad(where, "it has no joints, or too many");
    std::optional<Numbers> binds;
    if (skin.inverseBindMatrices >= 0) {
      binds = numbers(skin.inverseBindMatrices, 16);
      if (!binds || binds->count < skin.joints.size()) return bad(where, "its inverse bind matrices are not there");
    }
    out = {{}, true};
    for (std::size_t j = 0; j < skin.joints.size(); ++j) {
      glm::dmat4 m(1.0);
      for (std::size_t i = 0; binds && i < 16; ++i)
        m[static_cast<int>(i / 4)][static_cast<int>(i % 4)] = number(*binds, j, i);
      int depth = 0;
      for (int n = skin.joints[j]; n >= 0; n = parents_[static_cast<std::size_t>(n)]) {
        if (!has(model_.nodes, n)) return bad(where, fmt::format("there is no node {}", n));
        if (++depth > kMaxDepth) return bad(fmt::format("node {}", n), "nodes are nested without end");
        m = local(model_.nodes[static_cast<std::size_t>(n)]) * m;
      }
      out.by.push_back(m);
    }
    return std::nullopt;
  }

  static glm::dmat4 local(const tinygltf::Node& node) {
    glm::dmat4 m(1.0);
    if (node.matrix.size() == 16) {
      for (int c = 0; c < 4; ++c)
        for (int r = 0; r < 4; ++r) m[c][r] = node.matrix[static_cast<std::size_t>(4 * c + r)];
      return m;
    }
    if (node.rotation.size() == 4) {
      const auto& r = node.rotation;
      m = glm::mat4_cast(glm::dquat(r[3], r[0], r[1], r[2]));
    }
    if (node.scale.size() == 3)
      for (int k = 0; k < 3; ++k) m[k] *= node.scale[static_cast<std::size_t>(k)];
    if (node.translation.size() == 3)
      m[3] = glm::dvec4(node.translation[0], node.translation[1], node.translation[2], 1.0);
    return m;
  }

  /// Where an accessor's numbers lie, all of them inside its buffer.
  std::optional<Numbers> numbers(int index, int components) const {
    if (!has(model_.accessors, index)) return std::nullopt;
    const tinygltf::Accessor& a = model_.accessors[static_cast<std::size_t>(index)];
    if (a.sparse.isSparse || tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(a.type)) != components)
      return std::nullopt;
    const int width = tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(a.componentType));
    if (!has(model_.bufferViews, a.bufferView) || width <= 0) return std::nullopt;
    const tinygltf::BufferView& view = model_.bufferViews[static_cast<std::size_t>(a.bufferView)];
    if (!has(model_.buffers, view.buffer)) return std::nullopt;
    const std::vector<unsigned char>& bytes = model_.buffers[static_cast<std::size_t>(view.buffer)].data;
    const std::size_t size = static_cast<std::size_t>(width) * static_cast<std::size_t>(components);
    const std::size_t stride = view.byteStride == 0 ? size : view.byteStride;
    if (view.byteOffset > bytes.size() || view.byteLength > bytes.size() - view.byteOffset ||
        a.byteOffset > view.byteLength || stride > 4096)
      return std::nullopt;
    const std::size_t room = view.byteLength - a.byteOffset;
    if (a.count == 0 || size > room || (a.count - 1) > (room - size) / stride) return std::nullopt;
    return Numbers{bytes.data() + view.byteOffset + a.byteOffset, a.count, stride, a.componentType, a.normalized};
  }

  template <typename T>
  static T at(const unsigned char* p) {
    T value;
    std::memcpy(&value, p, sizeof(T));
    return value;
  }

  static double number(const Numbers& n, std::size_t i, std::size_t k) {
    const unsigned char* p = n.data + i * n.stride;
    const auto scaled = [&](double value, double most) { return n.normalized ? std::max(value / most, -1.0) : value; };
    switch (n.type) {
      case TINYGLTF_COMPONENT_TYPE_FLOAT:
        return static_cast<double>(at<float>(p + 4 * k));
      case TINYGLTF_COMPONENT_TYPE_BYTE:
        return scaled(at<std::int8_t>(p + k), 127.0);
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
        return scaled(at<std::uint8_t>(p + k), 255.0);
      case TINYGLTF_COMPONENT_TYPE_SHORT:
        return scaled(at<std::int16_t>(p + 2 * k), 32767.0);
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
        return scaled(at<std::uint16_t>(p + 2 * k), 65535.0);
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
        return static_cast<double>(at<std::uint32_t>(p + 4 * k));
      default:
        return std::nan("");
    }
  }

  Maybe mesh(const tinygltf::Mesh& mesh, const std::string& node, const Placed& placed) {
    same_.clear();
    for (std::size_t i = 0; i < mesh.primitives.size(); ++i)
      if (auto failure = primitive(mesh, i, node, placed)) return failure;
    return std::nullopt;
  }

  /// What vertex `i` of a skinned primitive is moved by. Nothing: a joint is not there.
  static std::optional<glm::dmat4> skinned(const Placed& placed, const Numbers& joints, const Numbers& weights,
                                           std::size_t i) {
    glm::dmat4 sum(0.0);
    double all = 0.0;
    for (std::size_t k = 0; k < 4; ++k) {
      const double weight = number(weights, i, k);
      const double joint = number(joints, i, k);
      if (!(weight > 0.0)) continue;
      if (!(joint >= 0.0 && joint < static_cast<double>(placed.by.size()))) return std::nullopt;
      sum += weight * placed.by[static_cast<std::size_t>(joint)];
      all += weight;
    }
    if (!(all > 0.0)) return std::nullopt;
    return sum / all;
  }

  /// The numbers of an attribute, one for each of `count` vertices.
  std::optional<Numbers> attribute(const tinygltf::Primitive& primitive, const char* name, std::size_t count) const {
    const auto found = primitive.attributes.find(name);
    if (found == primitive.attributes.end()) return std::nullopt;
    const auto all = numbers(found->second, 4);
    return all && all->count >= count ? all : std::nullopt;
  }

  Maybe primitive(const tinygltf::Mesh& mesh, std::size_t index, const std::string& node, const Placed& placed) {
    const tinygltf::Primitive& primitive = mesh.primitives[index];
    const std::string where = fmt::format("mesh '{}', primitive {}", mesh.name.substr(0, 60), index);
    if (primitive.mode != TINYGLTF_MODE_TRIANGLES && primitive.mode != -1) return std::nullopt;
    const auto position = primitive.attributes.find("POSITION");
    if (position == primitive.attributes.end()) return std::nullopt;
    const auto places = numbers(position->second, 3);
    if (!places) return bad(where, "its positions lie outside the file, or are stored sparsely");
    const auto first = static_cast<std::uint32_t>(mesh_.positions.size());
    if (places->count > limits_.vertices - first)
      return too_large(fmt::format("it has more than {} vertices", limits_.vertices));
    std::optional<Numbers> joints;
    std::optional<Numbers> weights;
    if (placed.skinned) {
      joints = attribute(primitive, "JOINTS_0", places->count);
      weights = attribute(primitive, "WEIGHTS_0", places->count);
      if (!joints || !weights) return bad(where, "it has a skin, but no joints or weights for its vertices");
      joints->normalized = false;
    }
    std::optional<glm::dmat4> moved = placed.skinned ? std::nullopt : std::optional(placed.by.front());
    for (std::size_t i = 0; i < places->count; ++i) {
      if (placed.skinned) moved = skinned(placed, *joints, *weights, i);
      if (!moved) return bad(where, fmt::format("vertex {} hangs on no joint", i));
      const glm::dvec3 p(*moved * glm::dvec4(number(*places, i, 0), number(*places, i, 1), number(*places, i, 2), 1.0));
      if (!(std::abs(p.x) < 1e9 && std::abs(p.y) < 1e9 && std::abs(p.z) < 1e9))
        return bad(where, fmt::format("vertex {} has no place", i));
      const auto v = static_cast<std::uint32_t>(mesh_.positions.size());
      mesh_.positions.push_back(p);
      mesh_.same_place.push_back(same_.try_emplace(std::tuple(p.x, p.y, p.z), v).first->second);
    }
    PolygonMesh::Piece piece;
    for (const std::string& n : {node, mesh.name})
      if (!n.empty()) piece.names.push_back(n);
    if (has(model_.materials, primitive.material)) {
      const tinygltf::Material& m = model_.materials[static_cast<std::size_t>(primitive.material)];
      piece.material = m.name;
      if (!m.name.empty()) piece.names.push_back(m.name);
      const std::vector<double>& c = m.pbrMetallicRoughness.baseColorFactor;
      // A colour that hides behind a picture says nothing.
      if (c.size() == 4 && m.pbrMetallicRoughness.baseColorTexture.index < 0) {
        glm::vec4 color(1.0F);
        for (int k = 0; k < 4; ++k) color[k] = static_cast<float>(std::clamp(c[static_cast<std::size_t>(k)], 0.0, 1.0));
        piece.color = color;
      }
    }
    // What is mirrored is inside out, unless its corners go round the other way (glTF 2.0, 3.7.4).
    const bool inside_out = moved && glm::determinant(glm::dmat3(*moved)) < 0.0;
    if (auto failure = triangles(primitive, where, first, places->count, inside_out, piece)) return failure;
    if (mesh_.pieces.size() >= limits_.pieces)
      return too_large(fmt::format("it has more than {} meshes", limits_.pieces));
    mesh_.pieces.push_back(std::move(piece));
    return std::nullopt;
  }

  Maybe triangles(const tinygltf::Primitive& primitive, const std::string& where, std::uint32_t first,
                  std::size_t vertices, bool inside_out, PolygonMesh::Piece& piece) {
    std::optional<Numbers> indices;
    if (primitive.indices >= 0) {
      indices = numbers(primitive.indices, 1);
      if (!indices || indices->type == TINYGLTF_COMPONENT_TYPE_FLOAT)
        return bad(where, "its indices lie outside the file");
      indices->normalized = false;
    }
    const std::size_t count = (indices ? indices->count : vertices) / 3;
    if (count > limits_.triangles - triangles_)
      return too_large(fmt::format("it has more than {} triangles", limits_.triangles));
    triangles_ += count;
    for (std::size_t t = 0; t < count; ++t) {
      std::array<std::uint32_t, 3> corners{};
      for (std::size_t k = 0; k < 3; ++k) {
        const double i = indices ? number(*indices, 3 * t + k, 0) : static_cast<double>(3 * t + k);
        if (!(i >= 0.0 && i < static_cast<double>(vertices)))
          return bad(where, fmt::format("triangle {} names a vertex that is not there", t));
        corners[k] = first + static_cast<std::uint32_t>(i);
      }
      if (inside_out) std::swap(corners[1], corners[2]);
      if (corners[0] == corners[1] || corners[1] == corners[2] || corners[0] == corners[2]) continue;
      piece.triangles.push_back(corners);
    }
    return std::nullopt;
  }

  std::string_view name_;
  const PolygonLimits& limits_;
  tinygltf::Model model_;
  std::vector<int> parents_;  ///< of every node; -1: none
  std::size_t uses_ = 0;
  std::size_t triangles_ = 0;
  std::map<std::tuple<double, double, double>, std::uint32_t> same_;
  PolygonMesh mesh_;
};

}  // namespace

tl::expected<PolygonMesh, Failure> read_gltf_mesh(std::string_view bytes, std::string_view name,
                                                  const PolygonLimits& limits) {
  return GltfReader(name, limits).run(bytes);
}

}  // namespace nms::runtime
