#include <nms/runtime/gltf_export.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <exception>
#include <map>
#include <optional>
#include <sstream>
#include <string_view>
#include <tuple>
#include <utility>

#include <fmt/format.h>
#include <tiny_gltf.h>

#include <nms/program/enum_names.h>

#include "animation_keys.h"
#include "clip_stage.h"
#include "gltf_buffer.h"
#include "gltf_names.h"
#include "morph_targets.h"
#include "residual_targets.h"
#include "target_errors.h"

namespace nms::runtime {
namespace {

using program::ChannelId;
using program::ChannelKind;
using program::Clip;
using program::Failure;
using program::Program;

// Bounds of what LINEAR keys may miss by.
constexpr double kTurnTolerance = 0.02 * 3.14159265358979 / 180;  // [rad]
constexpr double kShiftTolerance = 1e-5;                          // [m]
// Of parts that bend, where nothing is asked for. A tongue goes out over the teeth, by no straight way, and is small.
constexpr double kPartError_m = 0.0005;
constexpr float kPartTurn = 4.0F;  // of what normals may lack where an error is asked for
// What a quantized target moves a vertex by, it is stored for; a share of the error where one is asked for.
constexpr double kLeastMove_m = 1e-5;
constexpr double kLeastMoveShare = 0.05;

std::vector<double> triple(glm::dvec3 v) { return {v.x, v.y, v.z}; }

std::size_t index_of(Frame frame) { return static_cast<std::size_t>(frame); }

// Parents before children; the order of runtime::Frame.
constexpr std::array<const char*, kFrameCount> kFrameNames{"torso", "head", "jaw", "eye_left", "eye_right"};
constexpr std::array<Frame, kFrameCount> kFrameParents{Frame::torso, Frame::torso, Frame::head, Frame::head,
                                                       Frame::head};

class Export {
 public:
  Export(const Face& face, const Rig& rig, const Program& program, const GltfOptions& options, GltfReport* report)
      : report_(report),
        face_(face),
        rig_(rig),
        program_(program),
        options_(options),
        writer_(model_),
        stage_(face, rig, program),
        clip_names_(clip_names(program)) {}

  tl::expected<std::vector<std::byte>, Failure> run() {
    if (auto failure = choose_clips()) return tl::unexpected(std::move(*failure));
    morphs_.emplace(stage_, clips_, options_.all_targets);
    if (options_.quantize) {
      for (MorphedMesh& m : morphs_->meshes()) {
        m.grid = grid_of(m.linear.positions, m.linear.targets);
        const double least =
            options_.max_error_m > 0.0 ? std::min(kLeastMove_m, kLeastMoveShare * options_.max_error_m) : kLeastMove_m;
        put_on(*m.grid, m.linear, static_cast<float>(least));
      }
      model_.extensionsUsed.emplace_back("KHR_mesh_quantization");
      model_.extensionsRequired = model_.extensionsUsed;
    }
    for (MorphedMesh& m : morphs_->meshes()) m.linear.note_reach();
    for (MorphedMesh& m : morphs_->meshes()) {
      if (options_.max_error_m <= 0.0) m.lack_turn = kPartTurn * kNormalLack;
      if (error_m(m) > 0.0) add_residual_targets(*morphs_, stage_, m, clips_, error_m(m), options_.max_corrections);
    }
    model_.asset.version = "2.0";
    model_.asset.generator = "nmsc";
    add_materials();
    add_nodes();
    add_skin();
    add_rigid_meshes();
    find_moving_frames();
    for (const Clip* clip : clips_) add_animation(*clip);
    if (report_ != nullptr) {
      for (const MorphedMesh& m : morphs_->meshes()) {
        measure_targets(stage_, m, report_->targets);
        for (const TurnCorrection& c : m.corrections) report_->corrections.push_back(c.name);
        report_->corrections.insert(report_->corrections.end(), m.residuals.begin(), m.residuals.end());
      }
    }
    return serialise();
  }

 private:
  std::optional<Failure> choose_clips() {
    if (options_.clips.empty()) {
      for (const Clip& clip : program_.clips) clips_.push_back(&clip);
      return std::nullopt;
    }
    for (const std::string& name : options_.clips) {
      const Clip* clip = program_.find_clip(name);
      if (clip == nullptr) {
        return Failure{"unknown_clip", "export", fmt::format("the program has no clip '{}'", name),
                       "name an expression, timeline, entry or utterance of the program"};
      }
      if (std::find(clips_.begin(), clips_.end(), clip) == clips_.end()) clips_.push_back(clip);
    }
    return std::nullopt;
  }

  /// What the targets of a mesh may be off by; 0: what they are.                     [m]
  double error_m(const MorphedMesh& m) const {
    return options_.max_error_m > 0.0 || !m.part ? options_.max_error_m : kPartError_m;
  }

  void add_materials() {
    GltfNames names;
    for (const Material& material : face_.materials) {
      tinygltf::Material m;
      m.name = names.unique(material.name);
      const glm::vec4 c = material.base_color;
      m.pbrMetallicRoughness.baseColorFactor = {c.r, c.g, c.b, c.a};
      m.pbrMetallicRoughness.metallicFactor = static_cast<double>(material.metallic);
      m.pbrMetallicRoughness.roughnessFactor = static_cast<double>(material.roughness);
      m.doubleSided = material.double_sided;
      if (c.a < 1.0F) m.alphaMode = "BLEND";
      model_.materials.push_back(std::move(m));
    }
  }

  int add_node(std::string_view name, int parent, glm::dvec3 translation, float scale = 1.0F) {
    tinygltf::Node node;
    node.name = node_names_.unique(name);
    if (translation != glm::dvec3(0.0)) node.translation = triple(translation);
    if (scale != 1.0F) node.scale = triple(glm::dvec3(static_cast<double>(scale)));
    model_.nodes.push_back(std::move(node));
    const int index = static_cast<int>(model_.nodes.size()) - 1;
    if (parent >= 0) model_.nodes[static_cast<std::size_t>(parent)].children.push_back(index);
    return index;
  }

  // Single precision on purpose: what a reader adds up again is then the same sum for every mesh.
  glm::dvec3 pivot(Frame frame) const { return glm::dvec3(glm::vec3(rig_.pivot(frame))); }

  glm::dvec3 rest_translation(Frame frame) const {
    const Frame parent = kFrameParents[index_of(frame)];
    return frame == Frame::torso ? pivot(frame) : pivot(frame) - pivot(parent);
  }

  void add_nodes() {
    const int root = add_node("root", -1, glm::dvec3(0.0));
    for (const Frame frame : {Frame::torso, Frame::head, Frame::jaw, Frame::eye_left, Frame::eye_right}) {
      const int parent = frame == Frame::torso ? root : frame_nodes_[index_of(kFrameParents[index_of(frame)])];
      frame_nodes_[index_of(frame)] = add_node(kFrameNames[index_of(frame)], parent, rest_translation(frame));
    }
    tinygltf::Scene scene;
    scene.name = "face";
    scene.nodes.push_back(root);
    model_.scenes.push_back(std::move(scene));
    model_.defaultScene = 0;
  }

  void add_skin() {
    const std::size_t vertex_count = face_.skin.surface.rows;
    if (vertex_count == 0 || face_.skin.primitives.empty()) return;
    std::fill(stage_.values.begin(), stage_.values.end(), 0.0F);
    stage_.pose_values();
    const std::vector<glm::vec3> positions = stage_.pose.positions;
    const std::vector<glm::vec3> normals = stage_.pose.normals;

    tinygltf::Primitive shared;
    shared.mode = TINYGLTF_MODE_TRIANGLES;
    MorphedMesh* morphed = morphs_->mesh_of(std::nullopt);
    const VertexGrid grid = grid_for(morphed, positions, glm::vec3(0.0F));
    add_vertices(shared, positions, normals, grid);
    add_colors(shared, face_.skin.colors);
    add_joints(shared, grid);

    if (morphed != nullptr) add_targets(shared, *morphed);

    tinygltf::Mesh mesh;
    mesh.name = "skin";
    for (const Primitive& primitive : face_.skin.primitives) {
      if (primitive.triangles.empty()) continue;
      tinygltf::Primitive p = shared;
      p.material = static_cast<int>(primitive.material);
      p.indices = writer_.triangles(primitive.triangles, vertex_count);
      mesh.primitives.push_back(std::move(p));
    }
    if (mesh.primitives.empty()) return;
    if (morphed != nullptr) name_targets(mesh, *morphed);
    model_.meshes.push_back(std::move(mesh));

    // A root of the scene of its own: the transforms above a skinned mesh do not count.
    const int index = add_node("skin", -1, glm::dvec3(0.0));
    tinygltf::Node& node = model_.nodes[static_cast<std::size_t>(index)];
    node.mesh = static_cast<int>(model_.meshes.size()) - 1;
    node.skin = 0;
    model_.scenes[0].nodes.push_back(index);
    if (morphed != nullptr) morphed->node = index;
  }

  /// Where nothing is rounded, the grid that changes nothing.
  /// @param origin  of the vertices that are written, in the coordinates of the morphed mesh
  VertexGrid grid_for(const MorphedMesh* m, std::span<const glm::vec3> positions, glm::vec3 origin) const {
    if (!options_.quantize) return {};
    if (m == nullptr) return grid_of(positions, {});
    return {m->grid->middle - origin, m->grid->scale};
  }

  void add_vertices(tinygltf::Primitive& primitive, std::vector<glm::vec3> positions,
                    const std::vector<glm::vec3>& normals, const VertexGrid& grid) {
    if (options_.quantize) {
      for (glm::vec3& p : positions) p -= grid.middle;
      primitive.attributes["POSITION"] = writer_.steps<std::int16_t>(positions, grid.scale, true);
      primitive.attributes["NORMAL"] = writer_.steps<std::int8_t>(normals, 1.0F, false);
    } else {
      primitive.attributes["POSITION"] = writer_.vectors(positions, true);
      primitive.attributes["NORMAL"] = writer_.vectors(normals, false);
    }
  }

  void add_colors(tinygltf::Primitive& primitive, const std::vector<glm::vec3>& colors) {
    if (!colors.empty())
      primitive.attributes["COLOR_0"] = options_.quantize ? writer_.colors(colors) : writer_.vectors(colors, false);
  }

  void add_targets(tinygltf::Primitive& primitive, const MorphedMesh& m) {
    for (const LinearMesh::Target& target : m.linear.targets) {
      m.grid ? add_target_steps(primitive, target, *m.grid) : add_target(primitive, target.moved, target.turned);
    }
  }

  void add_target_steps(tinygltf::Primitive& primitive, const LinearMesh::Target& target, const VertexGrid& grid) {
    std::map<std::string, int> attributes;
    if (options_.dense) {
      attributes["POSITION"] = writer_.steps<std::int16_t>(target.moved, grid.scale, true);
      attributes["NORMAL"] = writer_.steps<std::int8_t>(target.turned, 1.0F, false);
    } else {
      std::tie(attributes["POSITION"], attributes["NORMAL"]) =
          writer_.sparse_steps(target.moved, grid.scale, target.turned);
    }
    primitive.targets.push_back(std::move(attributes));
  }

  void add_target(tinygltf::Primitive& primitive, const std::vector<glm::vec3>& moved,
                  const std::vector<glm::vec3>& turned) {
    std::map<std::string, int> attributes;
    attributes["POSITION"] = options_.dense ? writer_.vectors(moved, true) : writer_.sparse_vectors(moved, true);
    attributes["NORMAL"] = options_.dense ? writer_.vectors(turned, false) : writer_.sparse_vectors(turned, false);
    primitive.targets.push_back(std::move(attributes));
  }

  static void name_targets(tinygltf::Mesh& mesh, const MorphedMesh& m) {
    mesh.weights.assign(m.count(), 0.0);
    tinygltf::Value::Array names;
    for (const MorphTarget& target : m.targets) names.emplace_back(target.name);
    for (const TurnCorrection& correction : m.corrections) names.emplace_back(correction.name);
    for (const std::string& residual : m.residuals) names.emplace_back(residual);
    mesh.extras = tinygltf::Value(tinygltf::Value::Object{{"targetNames", tinygltf::Value(names)}});
  }

  // Joint 0 is the head, joint 1 the torso. A joint of no weight has index 0, as the format asks.
  // The transforms above a skinned mesh do not count, so what undoes the grid stands in the inverse bind matrices.
  void add_joints(tinygltf::Primitive& primitive, const VertexGrid& grid) {
    std::vector<std::array<std::uint8_t, 4>> joints;
    std::vector<float> weights;
    std::vector<std::array<std::uint8_t, 4>> steps;
    constexpr std::uint8_t kWhole = 255;
    for (const float share : rig_.head_share()) {
      const bool torso_alone = share <= 0.0F;
      const bool both = share > 0.0F && share < 1.0F;
      joints.push_back({static_cast<std::uint8_t>(torso_alone ? 1 : 0), static_cast<std::uint8_t>(both ? 1 : 0), 0, 0});
      weights.insert(weights.end(), {both ? share : 1.0F, both ? 1.0F - share : 0.0F, 0.0F, 0.0F});
      const auto first = both ? static_cast<std::uint8_t>(share * 255.0F + 0.5F) : kWhole;
      steps.push_back({first, static_cast<std::uint8_t>(kWhole - first), 0, 0});
      // A share that is rounded to nothing names no joint.
      if (options_.quantize && first == kWhole) joints.back()[1] = 0;
    }
    primitive.attributes["JOINTS_0"] = writer_.bytes(joints, TINYGLTF_TYPE_VEC4, false);
    primitive.attributes["WEIGHTS_0"] =
        options_.quantize ? writer_.bytes(steps, TINYGLTF_TYPE_VEC4, true)
                          : writer_.floats(weights, 4, TINYGLTF_TYPE_VEC4, GltfBuffer::Use::vertices, false);

    std::vector<float> inverse_bind;
    for (const Frame frame : {Frame::head, Frame::torso}) {
      const glm::vec3 p = grid.middle - glm::vec3(pivot(frame));
      const float s = grid.scale;
      inverse_bind.insert(inverse_bind.end(), {s, 0, 0, 0, 0, s, 0, 0, 0, 0, s, 0, p.x, p.y, p.z, 1});
    }
    tinygltf::Skin skin;
    skin.name = "neck";
    skin.joints = {frame_nodes_[index_of(Frame::head)], frame_nodes_[index_of(Frame::torso)]};
    skin.skeleton = frame_nodes_[index_of(Frame::torso)];
    skin.inverseBindMatrices = writer_.floats(inverse_bind, 16, TINYGLTF_TYPE_MAT4, GltfBuffer::Use::matrices, false);
    model_.skins.push_back(std::move(skin));
  }

  void add_rigid_meshes() {
    GltfNames mesh_names;
    mesh_names.unique("skin");
    for (std::uint32_t index = 0; index < face_.rigid.size(); ++index) {
      const RigidMesh& rigid = face_.rigid[index];
      MorphedMesh* morphed = morphs_->mesh_of(index);
      tinygltf::Mesh mesh;
      std::vector<glm::vec3> positions(rigid.positions.size());
      const glm::dvec3 origin = pivot(rigid.frame);
      for (std::size_t v = 0; v < positions.size(); ++v)
        positions[v] = glm::vec3(glm::dvec3(rigid.positions[v]) - origin);
      const VertexGrid grid = grid_for(morphed, positions, glm::vec3(origin));
      tinygltf::Primitive shared;
      shared.mode = TINYGLTF_MODE_TRIANGLES;
      bool written = false;
      for (const Primitive& primitive : rigid.primitives) {
        if (primitive.triangles.empty()) continue;
        if (!written) {
          add_vertices(shared, positions, rigid.normals, grid);
          add_colors(shared, rigid.colors);
          if (morphed != nullptr) add_targets(shared, *morphed);
          written = true;
        }
        tinygltf::Primitive p = shared;
        p.material = static_cast<int>(primitive.material);
        p.indices = writer_.triangles(primitive.triangles, positions.size());
        mesh.primitives.push_back(std::move(p));
      }
      if (mesh.primitives.empty()) continue;
      mesh.name = mesh_names.unique(rigid.name);
      if (morphed != nullptr) name_targets(mesh, *morphed);
      model_.meshes.push_back(std::move(mesh));
      const int node = add_node(rigid.name, frame_nodes_[index_of(rigid.frame)], glm::dvec3(grid.middle), grid.scale);
      model_.nodes[static_cast<std::size_t>(node)].mesh = static_cast<int>(model_.meshes.size()) - 1;
      if (morphed != nullptr) morphed->node = node;
    }
  }

  // A frame that moves in one clip is set in all, or the next clip would begin where this one ended.
  void find_moving_frames() {
    for (const Clip* clip : clips_) {
      for (const std::int64_t t : break_times(program_, *clip)) {
        // A little after the knot too: a curve may leave rest and come back between two knots.
        for (const std::int64_t later : {t, t + (clip->end_ns - t) / 97}) {
          stage_.evaluate_motions(*clip, later);
          for (std::size_t f = 0; f < kFrameCount; ++f) {
            turns_[f] = turns_[f] || stage_.pose.motions[f].rotation != glm::dquat(1.0, 0.0, 0.0, 0.0);
            shifts_[f] = shifts_[f] || stage_.pose.motions[f].translation != glm::dvec3(0.0);
          }
        }
      }
    }
    // An animation needs at least one channel.
    if (morphs_->meshes().empty() && std::none_of(turns_.begin(), turns_.end(), [](bool b) { return b; }) &&
        std::none_of(shifts_.begin(), shifts_.end(), [](bool b) { return b; })) {
      turns_[index_of(Frame::head)] = true;
    }
  }

  void add_animation(const Clip& clip) {
    tinygltf::Animation animation;
    animation.name = clip_names_[static_cast<std::size_t>(&clip - program_.clips.data())];
    const std::vector<std::int64_t> breaks = break_times(program_, clip);
    // Where lips and tongue touch, what is lacking may jump between two knots: every moment that targets were found for
    // is looked at.
    std::vector<std::int64_t> moments;
    visit_moments(program_, clip, [&](std::int64_t t) { moments.push_back(t); });
    if (moments.empty() || moments.back() != breaks.back()) moments.push_back(breaks.back());
    static constexpr std::array<double, 1> kTurnTolerances{kTurnTolerance};
    static constexpr std::array<double, 3> kShiftTolerances{kShiftTolerance, kShiftTolerance, kShiftTolerance};

    GltfClipError error;
    error.clip = animation.name;
    for (const MorphedMesh& morphed : morphs_->meshes()) {
      if (morphed.node < 0) continue;
      Keys keys = fit_keys(
          morphed.basis ? moments : breaks, Interpolation::linear, key_tolerances(morphed, error_m(morphed)),
          [&](std::int64_t t, std::span<float> out) { morphs_->weights_at(morphed, clip, t, out); },
          morphed.basis ? 3 : 5);
      if (in_steps(keys)) {
        for (float& w : keys.values) w = static_cast<float>(GltfBuffer::share_step(w)) / 65535.0F;
      }
      add_channel(animation, morphed.node, "weights", keys, 1, TINYGLTF_TYPE_SCALAR);
      if (report_ != nullptr) measure_clip(stage_, clip, morphed, keys, error);
    }
    if (report_ != nullptr) report_->clips.push_back(std::move(error));
    for (std::size_t f = 0; f < kFrameCount; ++f) {
      if (turns_[f]) {
        const Keys keys =
            fit_keys(breaks, Interpolation::slerp, kTurnTolerances, [&](std::int64_t t, std::span<float> out) {
              stage_.evaluate_motions(clip, t);
              const glm::dquat q = stage_.pose.motions[f].rotation;
              out[0] = static_cast<float>(q.x);
              out[1] = static_cast<float>(q.y);
              out[2] = static_cast<float>(q.z);
              out[3] = static_cast<float>(q.w);
            });
        add_channel(animation, frame_nodes_[f], "rotation", keys, 4, TINYGLTF_TYPE_VEC4);
      }
      if (shifts_[f]) {
        const glm::dvec3 rest = rest_translation(static_cast<Frame>(f));
        const Keys keys =
            fit_keys(breaks, Interpolation::linear, kShiftTolerances, [&](std::int64_t t, std::span<float> out) {
              stage_.evaluate_motions(clip, t);
              const glm::vec3 p(rest + stage_.pose.motions[f].translation);
              out[0] = p.x;
              out[1] = p.y;
              out[2] = p.z;
            });
        add_channel(animation, frame_nodes_[f], "translation", keys, 3, TINYGLTF_TYPE_VEC3);
      }
    }
    if (animation.channels.empty()) return;
    animation.extras = tinygltf::Value(tinygltf::Value::Object{
        {"clip", tinygltf::Value(std::string(program_.string(clip.name)))},
        {"kind", tinygltf::Value(std::string(program::enum_name(clip.kind)))},
        {"start_s", tinygltf::Value(static_cast<double>(clip.start_ns) / 1e9)},
    });
    model_.animations.push_back(std::move(animation));
  }

  /// Weights that are shares of 1 take two bytes where numbers may be whole ones.
  bool in_steps(const Keys& keys) const {
    return options_.quantize &&
           std::all_of(keys.values.begin(), keys.values.end(), [](float w) { return w >= 0.0F && w <= 1.0F; });
  }

  void add_channel(tinygltf::Animation& animation, int node, const char* path, const Keys& keys, std::size_t width,
                   int type) {
    tinygltf::AnimationSampler sampler;
    sampler.interpolation = "LINEAR";
    // Tracks of one clip often share their moments.
    const auto known = times_.find(keys.times);
    if (known != times_.end()) {
      sampler.input = known->second;
    } else {
      sampler.input = writer_.floats(keys.times, 1, TINYGLTF_TYPE_SCALAR, GltfBuffer::Use::keys, true);
      times_.emplace(keys.times, sampler.input);
    }
    const bool shares = std::string_view(path) == "weights" && in_steps(keys);
    sampler.output =
        shares ? writer_.shares(keys.values) : writer_.floats(keys.values, width, type, GltfBuffer::Use::keys, false);
    tinygltf::AnimationChannel channel;
    channel.sampler = static_cast<int>(animation.samplers.size());
    channel.target_node = node;
    channel.target_path = path;
    animation.samplers.push_back(std::move(sampler));
    animation.channels.push_back(std::move(channel));
  }

  tl::expected<std::vector<std::byte>, Failure> serialise() {
    writer_.finish();
    // The container counts in 32 bits; the JSON needs room too.
    if (model_.buffers[0].data.size() > 0xF0000000U) {
      return tl::unexpected(Failure{"too_large", "export", "the file would be larger than 4 GB", "export fewer clips"});
    }
    if (model_.buffers[0].data.empty()) {
      return tl::unexpected(Failure{"empty_face", "export", "the face has no triangles", "give the face a surface"});
    }
    std::ostringstream stream;
    tinygltf::TinyGLTF gltf;
    const bool written = gltf.WriteGltfSceneToStream(&model_, stream, false, true);
    const std::string text = stream.str();
    if (!written || !stream.good() || !whole(text)) {
      return tl::unexpected(
          Failure{"gltf_writer", "export", "the glTF writer gave an incomplete file", "report this defect"});
    }
    std::vector<std::byte> bytes(text.size());
    std::memcpy(bytes.data(), text.data(), text.size());
    return bytes;
  }

  // The container's header and chunk lengths agree with what is there (glTF 2.0, 4.4).
  bool whole(const std::string& text) const {
    const auto word = [&](std::size_t at) {
      std::uint32_t value = 0;
      for (std::size_t i = 0; i < 4; ++i) {
        value |= static_cast<std::uint32_t>(static_cast<unsigned char>(text[at + i])) << (8 * i);
      }
      return value;
    };
    if (text.size() < 28 || text.compare(0, 4, "glTF") != 0 || word(4) != 2 || word(8) != text.size()) return false;
    const std::size_t json = word(12);
    if (word(16) != 0x4E4F534AU || json % 4 != 0 || 20 + json + 8 > text.size()) return false;
    const std::size_t bin = word(20 + json);
    if (word(24 + json) != 0x004E4942U || 28 + json + bin != text.size()) return false;
    const std::size_t data = model_.buffers[0].data.size();
    return bin >= data && bin - data < 4;
  }

  GltfReport* report_;
  const Face& face_;
  const Rig& rig_;
  const Program& program_;
  const GltfOptions& options_;
  tinygltf::Model model_;
  GltfBuffer writer_;
  ClipStage stage_;
  std::optional<MorphTargets> morphs_;
  std::vector<const Clip*> clips_;
  GltfNames node_names_;
  std::vector<std::string> clip_names_;
  std::array<int, kFrameCount> frame_nodes_{};
  std::array<bool, kFrameCount> turns_{};
  std::array<bool, kFrameCount> shifts_{};
  std::map<std::vector<float>, int> times_;  // input accessors already written
};

}  // namespace

double error_excess(const GltfClipError& e, double max_error_m) {
  return std::max(e.largest_m / max_error_m, e.normal_rad / kAskew_rad);
}

tl::expected<std::vector<std::byte>, Failure> export_glb(const Face& face, const Rig& rig, const Program& program,
                                                         const GltfOptions& options, GltfReport* report) {
  // The library may throw (a name that is not UTF-8); no exception leaves this room.
  try {
    return Export(face, rig, program, options, report).run();
  } catch (const std::exception& e) {
    return tl::unexpected(Failure{"gltf_writer", "export", e.what(), "report this defect"});
  }
}

}  // namespace nms::runtime
