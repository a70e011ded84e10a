#include "avatar_eyeballs.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <tuple>

#include "avatar_nodes.h"
#include "glb_accessor.h"

namespace nms::runtime {
namespace {

constexpr float kLeastShare = 0.001F;  // of a target's furthest vertex: what moves less is rounding

class Eyeballs {
 public:
  Eyeballs(const Json& json, std::span<const std::byte> binary, std::span<const std::uint32_t> parents,
           std::span<const std::uint32_t> bones)
      : json_(json), binary_(binary), parents_(parents), bones_(bones) {}

  /// Which vertices of a primitive hang on an eye bone; empty: none, or they cannot be read.
  std::vector<char> on_bones(std::uint32_t node, const Json& primitive) const {
    const Json& attributes = member(primitive, "attributes");
    const Json& shown = member(json_, "nodes")[node];
    const auto position = index_of(member(attributes, "POSITION"));
    const std::size_t count =
        !position ? 0 : index_of(member(element(member(json_, "accessors"), *position), "count")).value_or(0);
    const auto skin = index_of(member(shown, "skin"));
    if (!skin) return std::vector<char>(below(node) ? std::min(count, kMost) : 0, 1);
    const auto joints = read(attributes, "JOINTS_0", 4);
    const auto weights = read(attributes, "WEIGHTS_0", 4);
    if (!joints || !weights || joints->size() != weights->size()) return {};
    const Json& nodes = member(element(member(json_, "skins"), *skin), "joints");
    std::vector<char> result(joints->size() / 4, 0);
    std::map<float, bool> known;
    for (std::size_t v = 0; v < result.size(); ++v) {
      const auto first = weights->begin() + static_cast<std::ptrdiff_t>(4 * v);
      const float joint = (*joints)[4 * v + static_cast<std::size_t>(std::max_element(first, first + 4) - first)];
      const auto [found, is_new] = known.emplace(joint, false);
      if (is_new) {
        const auto bone = index_of(element(nodes, static_cast<std::size_t>(joint)));
        found->second = bone && *bone < parents_.size() && below(*bone);
      }
      result[v] = found->second ? 1 : 0;
    }
    if (std::find(result.begin(), result.end(), 1) == result.end()) result.clear();
    return result;
  }

  std::optional<std::vector<float>> read(const Json& attributes, const char* name, std::size_t width) const {
    const auto index = index_of(member(attributes, name));
    return index ? read_accessor(json_, binary_, *index, width) : std::nullopt;
  }

 private:
  static constexpr std::size_t kMost = std::size_t{1} << 22U;

  bool below(std::uint32_t node) const {
    for (; node != kNoNode; node = parents_[node])
      if (std::find(bones_.begin(), bones_.end(), node) != bones_.end()) return true;
    return false;
  }

  const Json& json_;
  std::span<const std::byte> binary_;
  std::span<const std::uint32_t> parents_;
  std::span<const std::uint32_t> bones_;
};

/// Whether a target moves any of `vertices`.
bool moves(const std::vector<float>& shifts, const std::vector<char>& vertices) {
  float furthest = 0.0F;
  float there = 0.0F;
  for (std::size_t v = 0; v < shifts.size() / 3; ++v) {
    float length = 0.0F;
    for (std::size_t k = 0; k < 3; ++k) length = std::max(length, std::fabs(shifts[3 * v + k]));
    furthest = std::max(furthest, length);
    if (v < vertices.size() && vertices[v] != 0) there = std::max(there, length);
  }
  return there > kLeastShare * furthest;
}

}  // namespace

EyeballsMove eyeballs_move(const nlohmann::json& json, std::span<const std::byte> binary,
                           std::span<const std::uint32_t> parents, std::span<const std::uint32_t> eye_bones,
                           std::span<const NodeTarget> targets) {
  const Eyeballs eyeballs(json, binary, parents, eye_bones);
  const Json& nodes = member(json, "nodes");
  const Json& meshes = member(json, "meshes");
  bool seen = false;
  for (std::uint32_t n = 0; n < parents.size(); ++n) {
    const auto mesh = index_of(member(nodes[n], "mesh"));
    if (!mesh) continue;
    for (const Json& primitive : member(element(meshes, *mesh), "primitives")) {
      const std::vector<char> vertices = eyeballs.on_bones(n, primitive);
      if (vertices.empty()) continue;
      seen = true;
      for (const NodeTarget& t : targets) {
        if (t.node != n) continue;
        const auto shifts = eyeballs.read(element(member(primitive, "targets"), t.index), "POSITION", 3);
        if (!shifts) return EyeballsMove::unknown;
        if (moves(*shifts, vertices)) return EyeballsMove::yes;
      }
    }
  }
  return seen ? EyeballsMove::no : EyeballsMove::unknown;
}

}  // namespace nms::runtime
