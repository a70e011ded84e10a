#include "avatar_match.h"

#include <algorithm>
#include <initializer_list>
#include <map>
#include <optional>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "avatar_eyeballs.h"
#include "avatar_nodes.h"
#include "avatar_targets.h"

namespace nms::runtime::avatar {
namespace {

using program::Failure;

// Far above any avatar; they bound our work.
constexpr std::size_t kMaxTargets = 4096;     // of one mesh
constexpr std::size_t kMaxWeights = 1 << 16;  // of all nodes that clips animate

/// What would drive a target if no better name for the same unit is about.
struct Candidate {
  std::size_t index = 0;
  NameSet set = NameSet::facs_side;
  std::string name;
  std::vector<std::pair<std::string, Driver>> units;
};

class Matcher {
 public:
  Matcher(const Json& json, std::span<const std::byte> binary, const std::string& place,
          const program::Program& program, std::span<const program::Clip* const> clips)
      : json_(json), binary_(binary), place_(place), program_(program), clips_(clips) {}

  tl::expected<Match, Failure> run() {
    name_units();
    if (auto failure = read_parents(member(json_, "nodes"), place_, parent_))
      return tl::unexpected(std::move(*failure));
    find_expressions();
    if (auto failure = find_meshes()) return tl::unexpected(std::move(*failure));
    find_joints();
    find_bones();
    if (!known_ && match_.bones.empty())
      return tl::unexpected(
          Failure{"no_targets", place_, "nothing in it has a name that we know",
                  "its morph targets need ARKit, VRM 1.0 or FACS names (mesh.extras.targetNames), its bones Head, "
                  "LeftEye, RightEye"});
    list_unshown();
    return std::move(match_);
  }

 private:
  /// Which directions of which channels the clips move, by the AU's name.
  void name_units() {
    for (const program::Clip* clip : clips_)
      for (std::uint32_t i = 0; i < clip->curve_count; ++i)
        match_.channels.insert(static_cast<std::uint32_t>(program_.curves[clip->first_curve + i].channel));
    for (const std::uint32_t c : match_.channels) {
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
      match_.meshes.push_back(std::move(found));
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
        note(match_.targets, c.name);
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
    return std::any_of(match_.channels.begin(), match_.channels.end(),
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
    if (node == kNoNode || std::any_of(match_.bones.begin(), match_.bones.end(), same)) return;
    match_.bones.push_back(bone(node, part));
    note(match_.bone_names, text_of(member(member(json_, "nodes")[node], "name")));
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
    for (const std::uint32_t c : match_.channels) {
      const program::Channel& channel = program_.channels[c];
      const auto list = [&](program::StringId name, float sign) {
        const std::string unit(program_.string(name));
        if (!shown_.contains(unit) && goes(c, sign)) match_.unshown.push_back(unit);
      };
      if (channel.kind == program::ChannelKind::axis) {
        list(channel.positive, 1.0F);
        list(channel.negative, -1.0F);
      } else {
        list(channel.name, 1.0F);
      }
    }
  }

  const Json& json_;
  std::span<const std::byte> binary_;
  const std::string& place_;
  const program::Program& program_;
  std::span<const program::Clip* const> clips_;
  std::map<std::string, Driver> units_;                          ///< that the clips move, by AU name
  std::set<std::string> shown_;                                  ///< AU names that something in the avatar shows
  std::vector<std::uint32_t> parent_;                            ///< by node
  std::map<std::uint32_t, std::vector<Candidate>> expressions_;  ///< VRM's, by node
  std::set<std::uint32_t> joints_;                               ///< of any skin
  std::vector<NodeTarget> gaze_targets_;
  bool known_ = false;  ///< some target has a name of a known set
  Match match_;
};

}  // namespace

program::Frame frame_of(Part part) {
  return part == Part::head ? program::Frame::head : part == Part::torso ? program::Frame::torso : program::Frame::eyes;
}

tl::expected<Match, Failure> match(const nlohmann::json& json, std::span<const std::byte> binary,
                                   const std::string& place, const program::Program& program,
                                   std::span<const program::Clip* const> clips) {
  return Matcher(json, binary, place, program, clips).run();
}

}  // namespace nms::runtime::avatar
