#include <nms/runtime/gltf_avatar.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include <nms/program/evaluate.h>
#include <nms/runtime/trigonometry.h>

#include "animation_keys.h"
#include "avatar_targets.h"
#include "glb_chunks.h"

namespace nms::runtime {
namespace {

using Json = nlohmann::ordered_json;
using program::Failure;

constexpr double kWeightTolerance = 0.002;  // as in gltf_export.h
constexpr std::array<double, 1> kTurnTolerance{0.02 * kRadian};
constexpr std::array<double, 3> kShiftTolerance{1e-5, 1e-5, 1e-5};
constexpr std::size_t kMaxTargets = 4096;  // of one mesh: far above any avatar, and bounds our work
constexpr std::uint32_t kNoNode = 0xFFFFFFFFU;

/// The element of an array, or null.
const Json& element(const Json& array, std::size_t i) {
  static const Json null;
  return array.is_array() && i < array.size() ? array[i] : null;
}

const Json& member(const Json& object, const char* name) {
  static const Json null;
  const auto found = object.is_object() ? object.find(name) : object.end();
  return object.is_object() && found != object.end() ? *found : null;
}

std::optional<std::uint32_t> index_of(const Json& value) {
  if (!value.is_number_unsigned() || value.get<std::uint64_t>() >= kNoNode) return std::nullopt;
  return value.get<std::uint32_t>();
}

std::string text_of(const Json& value) { return value.is_string() ? value.get<std::string>() : std::string(); }

double number_of(const Json& value, double otherwise) {
  const double n = value.is_number() ? value.get<double>() : otherwise;
  return std::isfinite(n) ? n : otherwise;
}

/// One direction of a channel: an AU, or half of an axis.
struct Driver {
  std::uint32_t channel = 0;
  float sign = 1.0F;
  float share = 1.0F;
};

/// A morph target that some clip moves.
struct Target {
  std::size_t index = 0;  ///< in its mesh
  std::vector<Driver> drivers;
  float top = 1.0F;  ///< weight at 100 %: VRM's binds may ask for less
};

struct MeshNode {
  std::uint32_t node = 0;
  std::vector<float> rest;  ///< weights as the file has them
  std::vector<Target> targets;
};

enum class Part : std::uint8_t { head, torso, eye };

struct Bone {
  std::uint32_t node = 0;
  Part part = Part::head;
  glm::dquat parent{1.0, 0.0, 0.0, 0.0};  ///< turn of its parent in the world, at rest
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0};
  glm::dvec3 translation{0.0};
  double scale = 1.0;  ///< of its parent in the world
};

struct Rest {
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0};
  glm::dvec3 translation{0.0};
  glm::dvec3 scale{1.0};
};

double square_root_length(const glm::dvec3& v) { return std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z); }

/// Translation, rotation and scale of a node, from its own members or from its matrix (columns, glTF 2.0, 5.25).
Rest rest_of(const Json& node) {
  Rest rest;
  const Json& matrix = member(node, "matrix");
  if (matrix.is_array() && matrix.size() == 16) {
    glm::dmat3 m(1.0);
    for (int c = 0; c < 3; ++c) {
      for (int r = 0; r < 3; ++r) m[c][r] = number_of(matrix[static_cast<std::size_t>(c * 4 + r)], c == r ? 1.0 : 0.0);
      rest.scale[c] = std::max(1e-12, square_root_length(m[c]));
      m[c] /= rest.scale[c];
      rest.translation[c] = number_of(matrix[static_cast<std::size_t>(12 + c)], 0.0);
    }
    rest.rotation = glm::quat_cast(m);
    return rest;
  }
  const Json& t = member(node, "translation");
  const Json& s = member(node, "scale");
  const Json& r = member(node, "rotation");
  for (int c = 0; c < 3; ++c) {
    rest.translation[c] = number_of(element(t, static_cast<std::size_t>(c)), 0.0);
    rest.scale[c] = number_of(element(s, static_cast<std::size_t>(c)), 1.0);
  }
  const glm::dquat q(number_of(element(r, 3), 1.0), number_of(element(r, 0), 0.0), number_of(element(r, 1), 0.0),
                     number_of(element(r, 2), 0.0));
  const double length = std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  if (length > 1e-6) rest.rotation = q * (1.0 / length);
  return rest;
}

glm::dquat turn_about(int axis, double angle) {
  glm::dquat q(cosine(angle / 2.0), 0.0, 0.0, 0.0);
  (axis == 0 ? q.x : axis == 1 ? q.y : q.z) = sine(angle / 2.0);
  return q;
}

class AvatarWriter {
 public:
  AvatarWriter(GlbChunks chunks, const std::string& place, const program::Program& program,
               std::span<const program::Clip* const> clips)
      : chunks_(std::move(chunks)),
        json_(chunks_.json),
        place_(place),
        program_(program),
        clips_(clips),
        values_(program.channels.size()) {}

  tl::expected<AnimatedAvatar, Failure> run() {
    name_units();
    if (auto failure = read_hierarchy()) return tl::unexpected(std::move(*failure));
    find_expressions();
    find_meshes();
    find_bones();
    if (!known_ && bones_.empty())
      return fail("no_targets", "nothing in it has a name that we know",
                  "its morph targets need ARKit, VRM 1.0 or FACS names (mesh.extras.targetNames), its bones Head, "
                  "LeftEye, RightEye");
    list_unshown();
    if (auto failure = open_buffer()) return tl::unexpected(std::move(*failure));
    for (const program::Clip* clip : clips_)
      if (auto failure = add_clip(*clip)) return tl::unexpected(std::move(*failure));
    json_["buffers"][0]["byteLength"] = chunks_.binary.size();
    if (chunks_.binary.size() > 0x7FFFFFFFU) return fail("too_large", "the file would pass 2 GB", "build fewer clips");
    out_.glb = write_glb(chunks_);
    return std::move(out_);
  }

 private:
  tl::unexpected<Failure> fail(std::string kind, std::string cause, std::string remedy) const {
    return tl::unexpected(Failure{std::move(kind), place_, std::move(cause), std::move(remedy)});
  }

  /// Which directions of which channels the clips move, by the AU's name.
  void name_units() {
    for (const program::Clip* clip : clips_)
      for (std::uint32_t i = 0; i < clip->curve_count; ++i)
        used_.insert(static_cast<std::uint32_t>(program_.curves[clip->first_curve + i].channel));
    for (const std::uint32_t c : used_) {
      const program::Channel& channel = program_.channels[c];
      if (channel.kind == program::ChannelKind::axis) {
        units_[std::string(program_.string(channel.positive))] = {c, 1.0F, 1.0F};
        units_[std::string(program_.string(channel.negative))] = {c, -1.0F, 1.0F};
      } else {
        units_[std::string(program_.string(channel.name))] = {c, 1.0F, 1.0F};
      }
    }
  }

  std::optional<Failure> read_hierarchy() {
    const Json& nodes = member(json_, "nodes");
    if (!nodes.is_array()) return Failure{"bad_avatar", place_, "it has no nodes", "give an avatar"};
    parent_.assign(nodes.size(), kNoNode);
    for (std::uint32_t n = 0; n < nodes.size(); ++n)
      for (const Json& child : member(nodes[n], "children")) {
        const auto c = index_of(child);
        if (!c || *c >= nodes.size() || parent_[*c] != kNoNode)
          return Failure{"bad_avatar", place_, fmt::format("node {} has a child that is missing or has two parents", n),
                         "check the file with the glTF validator"};
        parent_[*c] = n;
      }
    for (std::uint32_t n = 0; n < nodes.size(); ++n) {  // a node that is above itself is found within as many steps
      std::size_t steps = 0;
      for (std::uint32_t at = parent_[n]; at != kNoNode; at = parent_[at])
        if (++steps > nodes.size())
          return Failure{"bad_avatar", place_, fmt::format("node {} is its own ancestor", n),
                         "check the file with the glTF validator"};
      if (steps > 1024) return Failure{"bad_avatar", place_, "its nodes nest too deep", "give an avatar"};
    }
    return std::nullopt;
  }

  std::vector<Driver> drivers_of(std::string_view name) {
    std::vector<Driver> drivers;
    for (const UnitShare& u : units_of_target(name)) {
      known_ = true;
      const auto found = units_.find(u.unit);
      if (found == units_.end()) continue;
      Driver d = found->second;
      d.share = u.share;
      drivers.push_back(d);
      shown_.insert(u.unit);
    }
    return drivers;
  }

  /// VRM 1.0: expressions by name, bound to targets by node and index.
  void find_expressions() {
    const Json& expressions = member(member(member(json_, "extensions"), "VRMC_vrm"), "expressions");
    for (const char* group : {"preset", "custom"}) {
      const Json& all = member(expressions, group);
      if (!all.is_object()) continue;
      for (const auto& [name, expression] : all.items()) {
        const std::vector<Driver> drivers = drivers_of(name);
        if (drivers.empty()) continue;
        for (const Json& bind : member(expression, "morphTargetBinds")) {
          const auto node = index_of(member(bind, "node"));
          const auto index = index_of(member(bind, "index"));
          if (!node || !index) continue;
          const double weight = std::clamp(number_of(member(bind, "weight"), 1.0), 0.0, 1.0);
          expressions_[*node].push_back({*index, drivers, static_cast<float>(weight)});
          expression_names_[{*node, *index}] = name;
        }
      }
    }
  }

  void find_meshes() {
    const Json& nodes = member(json_, "nodes");
    const Json& meshes = member(json_, "meshes");
    for (std::uint32_t n = 0; n < nodes.size(); ++n) {
      const auto m = index_of(member(nodes[n], "mesh"));
      if (!m) continue;
      const Json& mesh = element(meshes, *m);
      const Json& targets = member(element(member(mesh, "primitives"), 0), "targets");
      const std::size_t count = targets.is_array() ? std::min(targets.size(), kMaxTargets) : 0;
      if (count == 0) continue;
      MeshNode found{n, rest_weights(nodes[n], mesh, count), {}};
      const Json& names = target_names(mesh);
      for (std::size_t i = 0; i < count; ++i) {
        const std::string name = text_of(element(names, i));
        std::vector<Driver> drivers = drivers_of(name);
        if (drivers.empty()) continue;
        found.targets.push_back({i, std::move(drivers), 1.0F});
        note(out_.targets, name);
      }
      for (const Target& t : expressions_[n]) {
        const bool named = std::any_of(found.targets.begin(), found.targets.end(),
                                       [&](const Target& other) { return other.index == t.index; });
        if (named || t.index >= count) continue;
        found.targets.push_back(t);
        note(out_.targets, expression_names_[{n, static_cast<std::uint32_t>(t.index)}]);
      }
      if (!found.targets.empty()) meshes_.push_back(std::move(found));
    }
  }

  static const Json& target_names(const Json& mesh) {
    const Json& names = member(member(mesh, "extras"), "targetNames");
    if (names.is_array()) return names;
    return member(member(element(member(mesh, "primitives"), 0), "extras"), "targetNames");
  }

  static std::vector<float> rest_weights(const Json& node, const Json& mesh, std::size_t count) {
    const Json& own = member(node, "weights");
    const Json& weights = own.is_array() ? own : member(mesh, "weights");
    std::vector<float> rest(count, 0.0F);
    for (std::size_t i = 0; i < count; ++i) rest[i] = static_cast<float>(number_of(element(weights, i), 0.0));
    return rest;
  }

  static void note(std::vector<std::string>& names, const std::string& name) {
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }

  std::uint32_t humanoid_bone(const char* name) const {
    const Json& bones = member(member(member(member(json_, "extensions"), "VRMC_vrm"), "humanoid"), "humanBones");
    const auto node = index_of(member(member(bones, name), "node"));
    return node && *node < parent_.size() ? *node : kNoNode;
  }

  std::uint32_t bone_named(std::initializer_list<std::string_view> names) const {
    const Json& nodes = member(json_, "nodes");
    for (const std::string_view wanted : names)
      for (std::uint32_t n = 0; n < nodes.size(); ++n) {
        std::string name = plain_name(text_of(member(nodes[n], "name")));
        if (name.starts_with("mixamorig")) name.erase(0, 9);
        if (name == wanted) return n;
      }
    return kNoNode;
  }

  bool moves(program::Frame frame) const {
    return std::any_of(used_.begin(), used_.end(),
                       [&](std::uint32_t c) { return program_.channels[c].frame == frame; });
  }

  void find_bones() {
    const auto add = [&](std::uint32_t node, Part part) {
      if (node == kNoNode) return;
      bones_.push_back(bone(node, part));
      note(out_.bones, text_of(member(member(json_, "nodes")[node], "name")));
    };
    const auto either = [](std::uint32_t a, std::uint32_t b) { return a != kNoNode ? a : b; };
    if (moves(program::Frame::torso))
      add(either(either(humanoid_bone("upperChest"), humanoid_bone("chest")),
                 bone_named({"upperchest", "spine2", "chest", "spine1", "spine"})),
          Part::torso);
    if (moves(program::Frame::head)) add(either(humanoid_bone("head"), bone_named({"head"})), Part::head);
    for (const Bone& b : bones_) mark_shown(b.part == Part::head ? program::Frame::head : program::Frame::torso);
    const bool looks = std::any_of(units_.begin(), units_.end(), [&](const auto& unit) {
      return program_.channels[unit.second.channel].frame == program::Frame::eyes && shown_.contains(unit.first);
    });
    if (!moves(program::Frame::eyes) || looks) return;
    const std::size_t before = bones_.size();
    add(either(humanoid_bone("leftEye"), bone_named({"lefteye", "eyeleft", "eyel"})), Part::eye);
    add(either(humanoid_bone("rightEye"), bone_named({"righteye", "eyeright", "eyer"})), Part::eye);
    if (bones_.size() > before) mark_shown(program::Frame::eyes);
  }

  void mark_shown(program::Frame frame) {
    for (const auto& [name, driver] : units_)
      if (program_.channels[driver.channel].frame == frame) shown_.insert(name);
  }

  Bone bone(std::uint32_t node, Part part) {
    Json& nodes = json_["nodes"];
    const Rest own = rest_of(nodes[node]);
    Bone b{node, part, {1.0, 0.0, 0.0, 0.0}, own.rotation, own.translation, 1.0};
    for (std::uint32_t at = parent_[node]; at != kNoNode; at = parent_[at]) {
      const Rest rest = rest_of(nodes[at]);
      b.parent = rest.rotation * b.parent;
      b.scale *= rest.scale.y;
    }
    if (nodes[node].contains("matrix")) {  // glTF 2.0, 3.6.2: an animated node must not have a matrix
      nodes[node].erase("matrix");
      const glm::dquat& q = own.rotation;
      nodes[node]["translation"] = {own.translation.x, own.translation.y, own.translation.z};
      nodes[node]["rotation"] = {q.x, q.y, q.z, q.w};
      nodes[node]["scale"] = {own.scale.x, own.scale.y, own.scale.z};
    }
    return b;
  }

  /// Whether a clip takes a channel to that side of rest.
  [[nodiscard]] bool goes(std::uint32_t channel, float sign) const {
    for (const program::Clip* clip : clips_)
      for (std::uint32_t i = 0; i < clip->curve_count; ++i) {
        const program::Curve& curve = program_.curves[clip->first_curve + i];
        if (static_cast<std::uint32_t>(curve.channel) != channel) continue;
        for (std::uint32_t k = 0; k < curve.knot_count; ++k)
          if (program_.knots[curve.first_knot + k].value * sign > 0.0F) return true;
      }
    return false;
  }

  void list_unshown() {
    for (const std::uint32_t c : used_) {
      const program::Channel& channel = program_.channels[c];
      const auto list = [&](program::StringId name, float sign) {
        const std::string unit(program_.string(name));
        if (!shown_.contains(unit) && goes(c, sign)) out_.unshown.push_back(unit);
      };
      if (channel.kind == program::ChannelKind::axis) {
        list(channel.positive, 1.0F);
        list(channel.negative, -1.0F);
      } else {
        list(channel.name, 1.0F);
      }
    }
  }

  std::optional<Failure> open_buffer() {
    for (const char* array : {"buffers", "bufferViews", "accessors", "animations"})
      if (json_.contains(array) && !json_[array].is_array())
        return Failure{"bad_avatar", place_, fmt::format("its {} are no list", array),
                       "check it with the glTF validator"};
    Json& buffers = json_["buffers"];
    if (buffers.empty()) buffers.push_back(Json::object());
    if (!buffers[0].is_object() || buffers[0].contains("uri"))
      return Failure{"bad_avatar", place_, "its first buffer lies outside the file", "embed it: make one .glb of it"};
    const auto length = index_of(member(buffers[0], "byteLength"));
    if (length && *length > chunks_.binary.size())
      return Failure{"bad_avatar", place_, "its buffer is longer than what the file holds",
                     "get the file anew: it is cut"};
    return std::nullopt;
  }

  std::size_t accessor(std::span<const float> data, const char* type, std::size_t width, bool times) {
    while (chunks_.binary.size() % 4 != 0) chunks_.binary.push_back(std::byte{0});
    const std::size_t begin = chunks_.binary.size();
    const auto* bytes = reinterpret_cast<const std::byte*>(data.data());
    chunks_.binary.insert(chunks_.binary.end(), bytes, bytes + data.size_bytes());
    json_["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", begin}, {"byteLength", data.size_bytes()}});
    Json a{{"bufferView", json_["bufferViews"].size() - 1},
           {"componentType", 5126},
           {"count", data.size() / width},
           {"type", type}};
    if (times) {
      a["min"] = {data.front()};
      a["max"] = {data.back()};
    }
    json_["accessors"].push_back(std::move(a));
    return json_["accessors"].size() - 1;
  }

  void add_channel(Json& animation, std::uint32_t node, const char* path, const Keys& keys, const char* type,
                   std::size_t width) {
    auto times = times_.find(keys.times);
    if (times == times_.end()) times = times_.emplace(keys.times, accessor(keys.times, "SCALAR", 1, true)).first;
    const std::size_t values = accessor(keys.values, type, width, false);
    animation["channels"].push_back(
        {{"sampler", animation["samplers"].size()}, {"target", {{"node", node}, {"path", path}}}});
    animation["samplers"].push_back({{"input", times->second}, {"interpolation", "LINEAR"}, {"output", values}});
  }

  void evaluate(const program::Clip& clip, std::int64_t t) {
    std::fill(values_.begin(), values_.end(), 0.0F);
    program::evaluate(program_, clip, t, values_);
  }

  [[nodiscard]] float weight(const Target& target) const {
    float strongest = 0.0F;
    for (const Driver& d : target.drivers) strongest = std::max(strongest, values_[d.channel] * d.sign * d.share);
    return std::clamp(strongest, 0.0F, 1.0F) * target.top;
  }

  /// Turn of a frame in the world: yaw, pitch, roll as in Rig; gaze turns both eyes alike.
  [[nodiscard]] glm::dquat turn(Part part) const {
    const program::Frame frame = frame_of(part);
    std::array<double, 3> angle{};
    for (const std::uint32_t c : used_) {
      const program::Channel& channel = program_.channels[c];
      if (channel.frame != frame || channel.motion < program::Motion::rotate_x ||
          channel.motion > program::Motion::rotate_z)
        continue;
      const auto axis = static_cast<std::size_t>(channel.motion) - static_cast<std::size_t>(program::Motion::rotate_x);
      angle[axis] += static_cast<double>(values_[c]) * static_cast<double>(channel.full_scale);
    }
    return turn_about(1, angle[1]) * turn_about(0, angle[0]) * turn_about(2, angle[2]);
  }

  [[nodiscard]] glm::dvec3 shift(Part part) const {
    glm::dvec3 out(0.0);
    for (const std::uint32_t c : used_) {
      const program::Channel& channel = program_.channels[c];
      if (channel.frame != frame_of(part) || channel.motion < program::Motion::translate_x) continue;
      const int axis = static_cast<int>(channel.motion) - static_cast<int>(program::Motion::translate_x);
      out[axis] += static_cast<double>(values_[c]) * static_cast<double>(channel.full_scale);
    }
    return out;
  }

  static program::Frame frame_of(Part part) {
    return part == Part::head    ? program::Frame::head
           : part == Part::torso ? program::Frame::torso
                                 : program::Frame::eyes;
  }

  [[nodiscard]] bool shifts(Part part) const {
    return std::any_of(used_.begin(), used_.end(), [&](std::uint32_t c) {
      const program::Channel& channel = program_.channels[c];
      return channel.frame == frame_of(part) && channel.motion >= program::Motion::translate_x;
    });
  }

  std::optional<Failure> add_clip(const program::Clip& clip) {
    const std::string name(program_.string(clip.name));
    for (const Json& animation : json_["animations"])
      if (text_of(member(animation, "name")) == name)
        return Failure{"clip_exists", place_, fmt::format("it has an animation named {} already", name),
                       "give the avatar as it was, or name the clip otherwise"};
    times_.clear();
    const std::vector<std::int64_t> breaks = break_times(program_, clip);
    Json animation{{"name", name}, {"channels", Json::array()}, {"samplers", Json::array()}};
    for (const MeshNode& mesh : meshes_) {
      const std::vector<double> tolerance(mesh.rest.size(), kWeightTolerance);
      const Keys keys = fit_keys(breaks, Interpolation::linear, tolerance, [&](std::int64_t t, std::span<float> out) {
        evaluate(clip, t);
        std::copy(mesh.rest.begin(), mesh.rest.end(), out.begin());
        for (const Target& target : mesh.targets) out[target.index] = weight(target);
      });
      add_channel(animation, mesh.node, "weights", keys, "SCALAR", 1);
    }
    for (const Bone& b : bones_) add_bone(animation, clip, b, breaks);
    if (animation["channels"].empty()) return std::nullopt;  // glTF allows no animation of nothing
    animation["extras"] = {{"start_s", static_cast<double>(clip.start_ns) / 1e9}};
    json_["animations"].push_back(std::move(animation));
    return std::nullopt;
  }

  void add_bone(Json& animation, const program::Clip& clip, const Bone& b, const std::vector<std::int64_t>& breaks) {
    const glm::dquat into_parent = glm::conjugate(b.parent);
    const Keys turns =
        fit_keys(breaks, Interpolation::slerp, kTurnTolerance, [&](std::int64_t t, std::span<float> out) {
          evaluate(clip, t);
          const glm::dquat q = into_parent * turn(b.part) * b.parent * b.rotation;
          out[0] = static_cast<float>(q.x);
          out[1] = static_cast<float>(q.y);
          out[2] = static_cast<float>(q.z);
          out[3] = static_cast<float>(q.w);
        });
    add_channel(animation, b.node, "rotation", turns, "VEC4", 4);
    if (!shifts(b.part) || b.scale == 0.0) return;
    const Keys shifted =
        fit_keys(breaks, Interpolation::linear, kShiftTolerance, [&](std::int64_t t, std::span<float> out) {
          evaluate(clip, t);
          const glm::dvec3 p = b.translation + into_parent * shift(b.part) / b.scale;
          for (int c = 0; c < 3; ++c) out[static_cast<std::size_t>(c)] = static_cast<float>(p[c]);
        });
    add_channel(animation, b.node, "translation", shifted, "VEC3", 3);
  }

  GlbChunks chunks_;
  Json& json_;
  const std::string& place_;
  const program::Program& program_;
  std::span<const program::Clip* const> clips_;
  std::vector<float> values_;
  std::set<std::uint32_t> used_;                              ///< channels that the clips move
  std::map<std::string, Driver> units_;                       ///< the same by AU name
  std::set<std::string> shown_;                               ///< AU names that something in the avatar shows
  std::vector<std::uint32_t> parent_;                         ///< by node
  std::map<std::uint32_t, std::vector<Target>> expressions_;  ///< VRM's, by node
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::string> expression_names_;
  bool known_ = false;  ///< some target has a name of a known set
  std::vector<MeshNode> meshes_;
  std::vector<Bone> bones_;
  std::map<std::vector<float>, std::size_t> times_;  ///< accessors of one clip's times
  AnimatedAvatar out_;
};

}  // namespace

tl::expected<AnimatedAvatar, Failure> animate_avatar(std::span<const std::byte> glb, const std::string& place,
                                                     const program::Program& program,
                                                     std::span<const program::Clip* const> clips) {
  auto chunks = read_glb(glb, place);
  if (!chunks) return tl::unexpected(chunks.error());
  return AvatarWriter(std::move(*chunks), place, program, clips).run();
}

}  // namespace nms::runtime
