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
#include <glm/vec3.hpp>

#include <nms/program/evaluate.h>
#include <nms/runtime/trigonometry.h>

#include "animation_keys.h"
#include "avatar_eyeballs.h"
#include "avatar_nodes.h"
#include "avatar_targets.h"
#include "glb_chunks.h"
#include "json_text.h"

namespace nms::runtime {
namespace {

using program::Failure;

constexpr double kWeightTolerance = 0.002;  // as in gltf_export.h
constexpr std::array<double, 1> kTurnTolerance{0.02 * kRadian};
constexpr std::array<double, 3> kShiftTolerance{1e-5, 1e-5, 1e-5};
// Far above any avatar; they bound our work.
constexpr std::size_t kMaxTargets = 4096;     // of one mesh
constexpr std::size_t kMaxWeights = 1 << 16;  // of all nodes that clips animate

/// One direction of a channel: an AU, or half of an axis.
struct Driver {
  std::uint32_t channel = 0;
  float sign = 1.0F;
  float share = 1.0F;
  float top = 1.0F;  ///< weight at 100 %: VRM's binds may ask for less
};

/// A morph target that some clip moves.
struct Target {
  std::size_t index = 0;  ///< in its mesh
  std::vector<Driver> drivers;
};

/// What would drive a target if no better name for the same unit is about.
struct Candidate {
  std::size_t index = 0;
  NameSet set = NameSet::facs_side;
  std::string name;
  std::vector<std::pair<std::string, Driver>> units;
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

glm::dquat turn_about(int axis, double angle) {
  glm::dquat q(cosine(angle / 2.0), 0.0, 0.0, 0.0);
  (axis == 0 ? q.x : axis == 1 ? q.y : q.z) = sine(angle / 2.0);
  return q;
}

class AvatarWriter {
 public:
  AvatarWriter(GlbFile file, const std::string& place, const program::Program& program,
               std::span<const program::Clip* const> clips)
      : file_(std::move(file)),
        json_(file_.json),
        binary_(file_.chunks.binary),
        place_(place),
        program_(program),
        clips_(clips),
        values_(program.channels.size()) {}

  tl::expected<AnimatedAvatar, Failure> run() {
    name_units();
    if (auto failure = read_parents(member(json_, "nodes"), place_, parent_))
      return tl::unexpected(std::move(*failure));
    find_expressions();
    if (auto failure = find_meshes()) return tl::unexpected(std::move(*failure));
    find_joints();
    find_bones();
    if (!known_ && bones_.empty())
      return fail("no_targets", "nothing in it has a name that we know",
                  "its morph targets need ARKit, VRM 1.0 or FACS names (mesh.extras.targetNames), its bones Head, "
                  "LeftEye, RightEye");
    list_unshown();
    if (auto failure = check_buffer()) return tl::unexpected(std::move(*failure));
    for (const program::Clip* clip : clips_)
      if (auto failure = add_clip(*clip)) return tl::unexpected(std::move(*failure));
    if (binary_.size() > 0x7FFFFFFFU) return fail("too_large", "the file would pass 2 GB", "build fewer clips");
    file_.chunks.text = edited();
    out_.glb = write_glb(file_.chunks);
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
        units_[std::string(program_.string(channel.positive))] = {c, 1.0F};
        units_[std::string(program_.string(channel.negative))] = {c, -1.0F};
      } else {
        units_[std::string(program_.string(channel.name))] = {c, 1.0F};
      }
    }
  }

  /// A target of that name, driven by those of its units that the clips move.
  Candidate candidate(std::size_t index, const std::string& name, float top) const {
    TargetName named = units_of_target(name);
    Candidate c{index, named.set, name, {}};
    for (UnitShare& u : named.units) {
      const auto found = units_.find(u.unit);
      if (found == units_.end()) continue;
      Driver d = found->second;
      d.share = u.share;
      d.top = top;
      c.units.emplace_back(std::move(u.unit), d);
    }
    return c;
  }

  [[nodiscard]] bool knows(const std::string& name) const { return !units_of_target(name).units.empty(); }

  const Json& vrm(const char* part) const { return member(member(member(json_, "extensions"), "VRMC_vrm"), part); }

  /// Whether VRM says that the eyes are turned by their bones ("bone") or by expressions ("expression").
  [[nodiscard]] bool vrm_looks_by(const char* what) const { return text_of(member(vrm("lookAt"), "type")) == what; }

  /// VRM 1.0: expressions by name, bound to targets by node and index. What is bound to nothing shows nothing: files
  /// list all presets.
  void find_expressions() {
    for (const char* group : {"preset", "custom"}) {
      const Json& all = member(vrm("expressions"), group);
      if (!all.is_object()) continue;
      const bool preset = std::string_view(group) == "preset";
      for (const auto& [name, expression] : all.items()) {
        if (preset && name.starts_with("look") && vrm_looks_by("bone")) continue;
        for (const Json& bind : member(expression, "morphTargetBinds")) {
          const auto node = index_of(member(bind, "node"));
          const auto index = index_of(member(bind, "index"));
          if (!node || !index || !knows(name)) continue;
          const double weight = std::clamp(number_of(member(bind, "weight"), 1.0), 0.0, 1.0);
          expressions_[*node].push_back(candidate(*index, name, static_cast<float>(weight)));
        }
      }
    }
  }

  std::optional<Failure> find_meshes() {
    const Json& nodes = member(json_, "nodes");
    const Json& meshes = member(json_, "meshes");
    std::size_t weights = 0;
    for (std::uint32_t n = 0; n < nodes.size(); ++n) {
      const auto m = index_of(member(nodes[n], "mesh"));
      if (!m) continue;
      const Json& mesh = element(meshes, *m);
      const Json& targets = member(element(member(mesh, "primitives"), 0), "targets");
      const std::size_t count = targets.is_array() ? std::min(targets.size(), kMaxTargets) : 0;
      MeshNode found{n, {}, targets_of(n, target_names(mesh), count)};
      if (found.targets.empty()) continue;
      weights += count;
      if (weights > kMaxWeights)
        return Failure{"too_large", place_, fmt::format("its nodes have more than {} morph targets", kMaxWeights),
                       "give an avatar"};
      found.rest = rest_weights(nodes[n], mesh, count);
      meshes_.push_back(std::move(found));
    }
    return std::nullopt;
  }

  /// What of a node's mesh the clips move: a unit by targets of one set of names, the one that says it most exactly.
  std::vector<Target> targets_of(std::uint32_t node, const Json& names, std::size_t count) {
    std::vector<Candidate> candidates;
    std::set<std::size_t> named;
    for (std::size_t i = 0; i < count; ++i) {
      const std::string name = text_of(element(names, i));
      if (!knows(name)) continue;
      named.insert(i);
      candidates.push_back(candidate(i, name, 1.0F));
    }
    if (const auto bound = expressions_.find(node); bound != expressions_.end())
      for (const Candidate& c : bound->second)
        if (c.index < count && !named.contains(c.index)) candidates.push_back(c);
    known_ = known_ || !candidates.empty();

    std::map<std::string, NameSet> best;
    for (const Candidate& c : candidates)
      for (const auto& [unit, driver] : c.units) {
        const auto [found, is_new] = best.emplace(unit, c.set);
        if (!is_new) found->second = std::min(found->second, c.set);
      }
    std::map<std::size_t, Target> targets;
    for (const Candidate& c : candidates)
      for (const auto& [unit, driver] : c.units) {
        if (best[unit] != c.set) continue;
        Target& target = targets.emplace(c.index, Target{c.index, {}}).first->second;
        target.drivers.push_back(driver);
        shown_.insert(unit);
        note(out_.targets, c.name);
        if (program_.channels[driver.channel].frame == program::Frame::eyes) gaze_targets_.push_back({node, c.index});
      }
    std::vector<Target> result;
    for (auto& [index, target] : targets) result.push_back(std::move(target));
    return result;
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
    const auto node = index_of(member(member(member(vrm("humanoid"), "humanBones"), name), "node"));
    return node && *node < parent_.size() ? *node : kNoNode;
  }

  void find_joints() {
    for (const Json& skin : member(json_, "skins"))
      for (const Json& joint : member(skin, "joints"))
        if (const auto j = index_of(joint)) joints_.insert(*j);
  }

  /// "mixamorig:Head", "mixamorig7:Head": Mixamo's prefix says nothing.
  static std::string bone_name(const Json& node) {
    std::string name = plain_name(text_of(member(node, "name")));
    if (!name.starts_with("mixamorig")) return name;
    name.erase(0, 9);
    return name.erase(0, std::min(name.find_first_not_of("0123456789"), name.size()));
  }

  /// The first node of the first name that there is; joints of a skin before others, since meshes are called Head too.
  std::uint32_t bone_named(std::initializer_list<std::string_view> names) const {
    const Json& nodes = member(json_, "nodes");
    for (const std::string_view wanted : names) {
      std::uint32_t found = kNoNode;
      for (std::uint32_t n = 0; n < nodes.size(); ++n) {
        if (member(nodes[n], "skin").is_number() || bone_name(nodes[n]) != wanted) continue;
        if (joints_.contains(n)) return n;
        if (found == kNoNode) found = n;
      }
      if (found != kNoNode) return found;
    }
    return kNoNode;
  }

  /// The first joint whose name ends so, in any rig's way: "CC_Base_Head", "Bip001 Head", "J_Adj_L_FaceEye".
  std::uint32_t joint_ending(std::string_view last, std::string_view side = "") const {
    for (const std::uint32_t n : joints_) {
      std::vector<std::string> words = words_of(text_of(member(element(member(json_, "nodes"), n), "name")));
      const auto tells = [&](const std::string& word) { return word == side || word == side.substr(0, 1); };
      const bool on_side = side.empty() || std::any_of(words.begin(), words.end(), tells);
      if (!words.empty() && !side.empty() && tells(words.back())) words.pop_back();
      if (on_side && !words.empty() && words.back() == last) return n;
    }
    return kNoNode;
  }

  bool moves(program::Frame frame) const {
    return std::any_of(used_.begin(), used_.end(),
                       [&](std::uint32_t c) { return program_.channels[c].frame == frame; });
  }

  static std::uint32_t either(std::uint32_t a, std::uint32_t b) { return a != kNoNode ? a : b; }

  std::uint32_t head() const {
    return either(either(humanoid_bone("head"), bone_named({"head"})), joint_ending("head"));
  }

  std::uint32_t eye(const char* humanoid, std::initializer_list<std::string_view> names, std::string_view side) const {
    return either(either(humanoid_bone(humanoid), bone_named(names)), joint_ending("eye", side));
  }

  void find_bones() {
    if (moves(program::Frame::torso)) {
      std::uint32_t chest = kNoNode;
      for (const char* name : {"upperChest", "chest", "spine"}) chest = either(chest, humanoid_bone(name));
      add_bone_node(either(chest, bone_named({"upperchest", "spine2", "chest", "spine1", "spine"})), Part::torso);
    }
    if (moves(program::Frame::head)) add_bone_node(head(), Part::head);
    if (!moves(program::Frame::eyes)) return;
    std::vector<std::uint32_t> eyes{eye("leftEye", {"lefteye", "eyeleft", "eyel"}, "left"),
                                    eye("rightEye", {"righteye", "eyeright", "eyer"}, "right")};
    eyes.erase(std::remove(eyes.begin(), eyes.end(), kNoNode), eyes.end());
    if (targets_turn_eyes(eyes)) return;
    for (const std::uint32_t eye : eyes) add_bone_node(eye, Part::eye);
  }

  /// Whether the gaze is shown by targets alone: who turned the bones too would look twice as far.
  [[nodiscard]] bool targets_turn_eyes(std::span<const std::uint32_t> eyes) const {
    if (gaze_targets_.empty() || vrm_looks_by("bone")) return false;
    if (vrm_looks_by("expression")) return true;
    return eyeballs_move(json_, binary_, parent_, eyes, gaze_targets_) != EyeballsMove::no;
  }

  void add_bone_node(std::uint32_t node, Part part) {
    const auto same = [&](const Bone& b) { return b.node == node; };
    if (node == kNoNode || std::any_of(bones_.begin(), bones_.end(), same)) return;
    bones_.push_back(bone(node, part));
    note(out_.bones, text_of(member(member(json_, "nodes")[node], "name")));
    mark_shown(frame_of(part));
  }

  void mark_shown(program::Frame frame) {
    for (const auto& [name, driver] : units_)
      if (program_.channels[driver.channel].frame == frame) shown_.insert(name);
  }

  Bone bone(std::uint32_t node, Part part) const {
    const Json& nodes = member(json_, "nodes");
    const NodeRest own = rest_of(nodes[node]);
    Bone b{node, part, {1.0, 0.0, 0.0, 0.0}, own.rotation, own.translation, 1.0};
    for (std::uint32_t at = parent_[node]; at != kNoNode; at = parent_[at]) {
      const NodeRest rest = rest_of(nodes[at]);
      b.parent = rest.rotation * b.parent;
      b.scale *= rest.scale.y;
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

  std::optional<Failure> check_buffer() const {
    const char* const remedy = "check it with the glTF validator";
    for (const char* array : {"buffers", "bufferViews", "accessors", "animations"})
      if (json_.contains(array) && !member(json_, array).is_array())
        return Failure{"bad_avatar", place_, fmt::format("its {} are no list", array), remedy};
    const Json& buffers = member(json_, "buffers");
    if (buffers.empty()) return std::nullopt;
    if (!buffers[0].is_object() || buffers[0].contains("uri"))
      return Failure{"bad_avatar", place_, "its first buffer lies outside the file", "embed it: make one .glb of it"};
    const auto length = index_of(member(buffers[0], "byteLength"));
    if (length && *length > binary_.size())
      return Failure{"bad_avatar", place_, "its buffer is longer than what the file holds",
                     "get the file anew: it is cut"};
    return std::nullopt;
  }

  /// The file's text with what the clips add. Nothing else of it changes by a byte.
  [[nodiscard]] std::string edited() const {
    JsonEdit edit(file_.chunks.text);
    const std::string_view text = edit.text();
    std::vector<std::string> lacking;  // members that the document did not have
    const auto add = [&](const char* name, const std::vector<std::string>& elements) {
      if (elements.empty()) return;
      const TextSpan array = json_member(text, edit.root(), name);
      if (!array.empty()) return edit.append(array, elements);
      lacking.push_back(fmt::format("\"{}\":[{}]", name, fmt::join(elements, ",")));
    };
    const TextSpan buffers = json_member(text, edit.root(), "buffers");
    const std::string length = fmt::format("\"byteLength\":{}", binary_.size());
    if (buffers.empty() || json_elements(text, buffers).empty()) {
      add("buffers", {"{" + length + "}"});
    } else {
      const TextSpan buffer = json_elements(text, buffers).front();
      const TextSpan old = json_member(text, buffer, "byteLength");
      old.empty() ? edit.append(buffer, {length}) : edit.replace(old, fmt::format("{}", binary_.size()));
    }
    add("bufferViews", views_);
    add("accessors", accessors_);
    add("animations", animations_);
    unfold_matrices(edit);
    edit.append(edit.root(), lacking);
    return edit.done();
  }

  /// glTF 2.0, 3.6.2: an animated node must not have a matrix.
  void unfold_matrices(JsonEdit& edit) const {
    const std::string_view text = edit.text();
    const std::vector<TextSpan> nodes = json_elements(text, json_member(text, edit.root(), "nodes"));
    for (const Bone& b : bones_) {
      const Json& node = member(json_, "nodes")[b.node];
      if (!node.contains("matrix")) continue;
      const NodeRest rest = rest_of(node);
      const glm::dquat& q = rest.rotation;
      const Json pose{{"translation", {rest.translation.x, rest.translation.y, rest.translation.z}},
                      {"rotation", {q.x, q.y, q.z, q.w}},
                      {"scale", {rest.scale.x, rest.scale.y, rest.scale.z}}};
      std::string fresh;
      for (const char* name : {"translation", "rotation", "scale"}) {
        const TextSpan old = json_member(text, nodes[b.node], name);  // beside a matrix it is an error, which ends here
        if (!old.empty()) edit.replace(old, pose[name].dump());
        if (old.empty()) fresh += fmt::format("{}\"{}\":{}", fresh.empty() ? "" : ",", name, pose[name].dump());
      }
      for (const JsonMember& m : json_members(text, nodes[b.node]))
        if (m.value.begin == json_member(text, nodes[b.node], "matrix").begin) edit.replace(m.whole(), fresh);
    }
  }

  /// The index of a new accessor; of one with the same numbers, if there is one.
  std::size_t accessor(const std::vector<float>& data, const char* type, std::size_t width, bool times) {
    const auto [found, is_new] = written_.emplace(std::pair(std::string(type) + (times ? "t" : ""), data), 0);
    if (!is_new) return found->second;
    binary_.resize((binary_.size() + 3) / 4 * 4);
    const std::size_t begin = binary_.size();
    const std::size_t size = data.size() * sizeof(float);
    const auto* bytes = reinterpret_cast<const std::byte*>(data.data());
    binary_.insert(binary_.end(), bytes, bytes + size);
    const std::size_t view = member(json_, "bufferViews").size() + views_.size();
    views_.push_back(fmt::format(R"({{"buffer":0,"byteOffset":{},"byteLength":{}}})", begin, size));
    std::string a = fmt::format(R"({{"bufferView":{},"componentType":5126,"count":{},"type":"{}")", view,
                                data.size() / width, type);
    if (times) a += fmt::format(R"(,"min":[{}],"max":[{}])", Json(data.front()).dump(), Json(data.back()).dump());
    accessors_.push_back(a + "}");
    return found->second = member(json_, "accessors").size() + accessors_.size() - 1;
  }

  void add_channel(nlohmann::ordered_json& animation, std::uint32_t node, const char* path, const Keys& keys,
                   const char* type, std::size_t width) {
    const std::size_t times = accessor(keys.times, "SCALAR", 1, true);
    const std::size_t values = accessor(keys.values, type, width, false);
    animation["channels"].push_back(
        {{"sampler", animation["samplers"].size()}, {"target", {{"node", node}, {"path", path}}}});
    animation["samplers"].push_back({{"input", times}, {"interpolation", "LINEAR"}, {"output", values}});
  }

  void evaluate(const program::Clip& clip, std::int64_t t) {
    std::fill(values_.begin(), values_.end(), 0.0F);
    program::evaluate(program_, clip, t, values_);
  }

  [[nodiscard]] float weight(const Target& target) const {
    float strongest = 0.0F;
    for (const Driver& d : target.drivers)
      strongest = std::max(strongest, std::min(values_[d.channel] * d.sign * d.share, 1.0F) * d.top);
    return strongest;
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
    for (const Json& animation : member(json_, "animations"))
      if (text_of(member(animation, "name")) == name)
        return Failure{"clip_exists", place_, fmt::format("it has an animation named {} already", name),
                       "give the avatar as it was, or name the clip otherwise"};
    const std::vector<std::int64_t> breaks = break_times(program_, clip);
    using Ordered = nlohmann::ordered_json;
    Ordered animation{{"name", name}, {"channels", Ordered::array()}, {"samplers", Ordered::array()}};
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
    animations_.push_back(animation.dump());
    return std::nullopt;
  }

  void add_bone(nlohmann::ordered_json& animation, const program::Clip& clip, const Bone& b,
                const std::vector<std::int64_t>& breaks) {
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
    if (!shifts(b.part) || !std::isfinite(b.scale) || std::fabs(b.scale) < 1e-9) return;
    const Keys shifted =
        fit_keys(breaks, Interpolation::linear, kShiftTolerance, [&](std::int64_t t, std::span<float> out) {
          evaluate(clip, t);
          const glm::dvec3 p = b.translation + into_parent * shift(b.part) / b.scale;
          for (int c = 0; c < 3; ++c) out[static_cast<std::size_t>(c)] = static_cast<float>(p[c]);
        });
    add_channel(animation, b.node, "translation", shifted, "VEC3", 3);
  }

  GlbFile file_;
  const Json& json_;
  std::vector<std::byte>& binary_;
  const std::string& place_;
  const program::Program& program_;
  std::span<const program::Clip* const> clips_;
  std::vector<float> values_;
  std::set<std::uint32_t> used_;                                 ///< channels that the clips move
  std::map<std::string, Driver> units_;                          ///< the same by AU name
  std::set<std::string> shown_;                                  ///< AU names that something in the avatar shows
  std::vector<std::uint32_t> parent_;                            ///< by node
  std::map<std::uint32_t, std::vector<Candidate>> expressions_;  ///< VRM's, by node
  std::set<std::uint32_t> joints_;                               ///< of any skin
  std::vector<NodeTarget> gaze_targets_;
  bool known_ = false;  ///< some target has a name of a known set
  std::vector<MeshNode> meshes_;
  std::vector<Bone> bones_;
  // What the file gets, as JSON.
  std::vector<std::string> views_;
  std::vector<std::string> accessors_;
  std::vector<std::string> animations_;
  std::map<std::pair<std::string, std::vector<float>>, std::size_t> written_;  ///< accessors by type and numbers
  AnimatedAvatar out_;
};

}  // namespace

tl::expected<AnimatedAvatar, Failure> animate_avatar(std::span<const std::byte> glb, const std::string& place,
                                                     const program::Program& program,
                                                     std::span<const program::Clip* const> clips) {
  auto file = read_glb(glb, place);
  if (!file) return tl::unexpected(file.error());
  return AvatarWriter(std::move(*file), place, program, clips).run();
}

}  // namespace nms::runtime
