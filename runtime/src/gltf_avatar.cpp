#include <nms/runtime/gltf_avatar.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <glm/gtc/quaternion.hpp>
#include <glm/vec3.hpp>

#include <nms/program/evaluate.h>
#include <nms/runtime/trigonometry.h>

#include "animation_keys.h"
#include "avatar_match.h"
#include "avatar_nodes.h"
#include "glb_chunks.h"
#include "json_text.h"

namespace nms::runtime {
namespace {

using program::Failure;

constexpr double kWeightTolerance = 0.002;  // as in gltf_export.h
constexpr std::array<double, 1> kTurnTolerance{0.02 * kRadian};
constexpr std::array<double, 3> kShiftTolerance{1e-5, 1e-5, 1e-5};

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
    auto found = avatar::match(json_, binary_, place_, program_, clips_);
    if (!found) return tl::unexpected(found.error());
    match_ = std::move(*found);
    if (auto failure = check_buffer()) return tl::unexpected(std::move(*failure));
    for (const program::Clip* clip : clips_)
      if (auto failure = add_clip(*clip)) return tl::unexpected(std::move(*failure));
    if (binary_.size() > 0x7FFFFFFFU) return fail("too_large", "the file would pass 2 GB", "build fewer clips");
    file_.chunks.text = edited();
    return AnimatedAvatar{write_glb(file_.chunks), std::move(match_.targets), std::move(match_.bone_names),
                          std::move(match_.unshown)};
  }

 private:
  tl::unexpected<Failure> fail(std::string kind, std::string cause, std::string remedy) const {
    return tl::unexpected(Failure{std::move(kind), place_, std::move(cause), std::move(remedy)});
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
    for (const avatar::Bone& b : match_.bones) {
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

  [[nodiscard]] float weight(const avatar::Target& target) const {
    float strongest = 0.0F;
    for (const avatar::Driver& d : target.drivers)
      strongest = std::max(strongest, std::min(values_[d.channel] * d.sign * d.share, 1.0F) * d.top);
    return strongest;
  }

  /// Turn of a frame in the world: yaw, pitch, roll as in Rig; gaze turns both eyes alike.
  [[nodiscard]] glm::dquat turn(avatar::Part part) const {
    const program::Frame frame = avatar::frame_of(part);
    std::array<double, 3> angle{};
    for (const std::uint32_t c : match_.channels) {
      const program::Channel& channel = program_.channels[c];
      if (channel.frame != frame || channel.motion < program::Motion::rotate_x ||
          channel.motion > program::Motion::rotate_z)
        continue;
      const auto axis = static_cast<std::size_t>(channel.motion) - static_cast<std::size_t>(program::Motion::rotate_x);
      angle[axis] += static_cast<double>(values_[c]) * static_cast<double>(channel.full_scale);
    }
    return turn_about(1, angle[1]) * turn_about(0, angle[0]) * turn_about(2, angle[2]);
  }

  [[nodiscard]] glm::dvec3 shift(avatar::Part part) const {
    glm::dvec3 out(0.0);
    for (const std::uint32_t c : match_.channels) {
      const program::Channel& channel = program_.channels[c];
      if (channel.frame != avatar::frame_of(part) || channel.motion < program::Motion::translate_x) continue;
      const int axis = static_cast<int>(channel.motion) - static_cast<int>(program::Motion::translate_x);
      out[axis] += static_cast<double>(values_[c]) * static_cast<double>(channel.full_scale);
    }
    return out;
  }

  [[nodiscard]] bool shifts(avatar::Part part) const {
    return std::any_of(match_.channels.begin(), match_.channels.end(), [&](std::uint32_t c) {
      const program::Channel& channel = program_.channels[c];
      return channel.frame == avatar::frame_of(part) && channel.motion >= program::Motion::translate_x;
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
    for (const avatar::MeshNode& mesh : match_.meshes) {
      const std::vector<double> tolerance(mesh.rest.size(), kWeightTolerance);
      const Keys keys = fit_keys(breaks, Interpolation::linear, tolerance, [&](std::int64_t t, std::span<float> out) {
        evaluate(clip, t);
        std::copy(mesh.rest.begin(), mesh.rest.end(), out.begin());
        for (const avatar::Target& target : mesh.targets) out[target.index] = weight(target);
      });
      add_channel(animation, mesh.node, "weights", keys, "SCALAR", 1);
    }
    for (const avatar::Bone& b : match_.bones) add_bone(animation, clip, b, breaks);
    if (animation["channels"].empty()) return std::nullopt;  // glTF allows no animation of nothing
    animation["extras"] = {{"start_s", static_cast<double>(clip.start_ns) / 1e9}};
    animations_.push_back(animation.dump());
    return std::nullopt;
  }

  void add_bone(nlohmann::ordered_json& animation, const program::Clip& clip, const avatar::Bone& b,
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
  avatar::Match match_;
  // What the file gets, as JSON.
  std::vector<std::string> views_;
  std::vector<std::string> accessors_;
  std::vector<std::string> animations_;
  std::map<std::pair<std::string, std::vector<float>>, std::size_t> written_;  ///< accessors by type and numbers
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
