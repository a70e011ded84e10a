#include <nms/runtime/gltf_export.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <exception>
#include <map>
#include <optional>
#include <sstream>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <tiny_gltf.h>

#include <nms/program/enum_names.h>
#include <nms/program/evaluate.h>
#include <nms/runtime/trigonometry.h>

#include "animation_keys.h"
#include "gltf_buffer.h"
#include "linear_mesh.h"

namespace nms::runtime {
namespace {

using program::ChannelId;
using program::ChannelKind;
using program::Clip;
using program::Failure;
using program::Program;

// A morph delta shorter than this is rounding, and is written as none: it decides how many vertices a target stores.
constexpr float kPositionDust = 1e-6F;  // [m]
constexpr float kNormalDust = 1e-3F;    // of a unit normal, 0.06 degrees
// Bounds of what LINEAR keys may miss by.
constexpr double kWeightTolerance = 0.002;                        // of an AU
constexpr double kExactWeightTolerance = 0.0005;                  // where an error is asked for
constexpr double kKeyShare = 0.05;                                // of that error, for one correction's weight
constexpr double kTurnTolerance = 0.02 * 3.14159265358979 / 180;  // [rad]
constexpr double kShiftTolerance = 1e-5;                          // [m]
constexpr double kCorrectionTolerance = 0.02;                     // of a correction, itself below 3 mm
// A correction that no clip asks more of than this is left out: 0.1 of the largest sagitta is below 0.3 mm.
constexpr double kLeastCorrection = 0.1;

// One morph target: a channel at +1, or at -1 for the second AU of an axis.
struct Target {
  std::uint32_t channel = 0;
  float sign = 1.0F;
  std::string name;
};

// Targets move points along chords, but lids and jaw turn. With a and b the first and second derivative (halved) of a
// vertex by the share U of the whole turn, a target of share u moves it by u a + u^2 b. The turn U = sum w u wants
// U a + U^2 b. What lacks is (U^2 - sum w u^2) b; and the surface half-way less half of the surface at the end is -b/4.
// So a target with that shape and the weight 4 (sum w u^2 - U^2) mends it to second order, whatever AUs are mixed.
// Where the runtime stops the lid at contact, targets go on; a second one takes the excess back.
struct Correction {
  enum class Kind : std::uint8_t { lid_bend, lid_contact, jaw_bend };
  Kind kind = Kind::lid_bend;
  std::size_t eye = 0;
  std::string name;
};

// A node whose mesh has targets.
struct Morphed {
  std::string name;
  int node = -1;
  std::optional<std::size_t> part;  // index into Face::rigid; none: the skin
  std::vector<Target> targets;
  std::vector<Correction> corrections;  // after the targets
  std::vector<std::string> residuals;   // after the corrections
  LinearMesh linear;                    // all of them
  std::optional<ResidualBasis> basis;

  [[nodiscard]] std::size_t count() const { return targets.size() + corrections.size() + residuals.size(); }
};

// Of what the error allowed, targets may use so much; the rest is for keys.
constexpr double kResidualShare = 0.75;
constexpr std::size_t kMostResiduals = 96;  // of one mesh; a primitive holds 256 targets
constexpr std::size_t kWorkingFields = 128;
constexpr std::size_t kFieldsAtATime = 12;
constexpr std::int64_t kErrorStep_ns = 16'666'667;

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
        pose_(make_pose(face, rig)),
        values_(rig.channel_count(), 0.0F) {}

  tl::expected<std::vector<std::byte>, Failure> run() {
    if (auto failure = choose_clips()) return tl::unexpected(std::move(*failure));
    skin_targets_ = choose_targets([&](ChannelId c) { return rig_.moves_skin(c); });
    choose_corrections();
    make_morphed();
    if (options_.max_error_m > 0.0) {
      for (Morphed& m : morphed_) add_residuals(m);
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
      for (const Morphed& m : morphed_) {
        for (const Correction& c : m.corrections) report_->corrections.push_back(c.name);
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

  // Whether any chosen clip takes the channel to the given side of 0.
  bool used(std::uint32_t channel, float sign) const {
    for (const Clip* clip : clips_) {
      for (std::uint32_t c = 0; c < clip->curve_count; ++c) {
        const program::Curve& curve = program_.curves[clip->first_curve + c];
        if (static_cast<std::uint32_t>(curve.channel) != channel) continue;
        for (std::uint32_t k = 0; k < curve.knot_count; ++k) {
          const program::Knot& knot = program_.knots[curve.first_knot + k];
          if (knot.value * sign > 0.0F) return true;
          if (knot.shape < program::kShapeFirstReserved && k + 1 < curve.knot_count) {
            const program::Handles& handles = program_.handles_of(curve, knot);
            if (handles.b1 * sign > 0.0F || handles.b2 * sign > 0.0F) return true;
          }
        }
      }
    }
    return false;
  }

  // Targets of the channels that `moves` says move a mesh, in the order of the channels.
  template <typename Moves>
  std::vector<Target> choose_targets(Moves moves) const {
    GltfNames names;
    std::vector<Target> targets;
    for (std::uint32_t c = 0; c < program_.channels.size(); ++c) {
      const program::Channel& channel = program_.channels[c];
      if (!moves(ChannelId{c})) continue;
      const auto add = [&](float sign, program::StringId name) {
        if (!options_.all_targets && !used(c, sign)) return;
        targets.push_back({c, sign, names.unique(program_.string(name))});
      };
      if (channel.kind == ChannelKind::action_unit) {
        add(1.0F, channel.name);
      } else {
        add(1.0F, channel.positive);
        add(-1.0F, channel.negative);
      }
    }
    return targets;
  }

  // Where the pose's lids and jaw stand, as shares of their whole turn.
  struct Turns {
    std::array<double, kEyeCount> lid{};
    double jaw = 0.0;
  };

  Turns turns_of_values() {
    contractions(rig_, values_, pose_.contractions);
    turn_lids(rig_, values_, pose_.contractions, pose_.lids);
    Turns turns;
    for (std::size_t e = 0; e < kEyeCount; ++e) turns.lid[e] = pose_.lids[e].upper;
    turns.jaw = jaw_turn_ > 0.0 ? jaw_angle() / jaw_turn_ : 0.0;
    return turns;
  }

  double jaw_angle() const {
    double angle = 0.0;
    for (const RigTables::HingeDrive& drive : rig_.tables().hinge_drives) {
      if (drive.frame == Frame::jaw) angle += drive.angle * static_cast<double>(pose_.contractions[drive.muscle]);
    }
    return angle;
  }

  void choose_corrections() {
    for (const RigTables::HingeDrive& drive : rig_.tables().hinge_drives) {
      if (drive.frame == Frame::jaw) jaw_turn_ = std::max(jaw_turn_, drive.angle);
    }
    target_turns_.clear();
    for (const Target& target : skin_targets_) {
      values_[target.channel] = target.sign;
      target_turns_.push_back(turns_of_values());
      values_[target.channel] = 0.0F;
    }
    const std::vector<Correction> all{
        {Correction::Kind::lid_bend, 0, "fix.lid_upper_L.50"},
        {Correction::Kind::lid_contact, 0, "fix.lid_upper_L.contact"},
        {Correction::Kind::lid_bend, 1, "fix.lid_upper_R.50"},
        {Correction::Kind::lid_contact, 1, "fix.lid_upper_R.contact"},
        {Correction::Kind::jaw_bend, 0, "fix.jaw.50"},
    };
    std::vector<double> most(all.size(), 0.0);
    for (const Clip* clip : clips_) {
      const std::vector<std::int64_t> breaks = break_times(program_, *clip);
      for (std::size_t i = 0; i < breaks.size(); ++i) {
        const std::int64_t step = i + 1 < breaks.size() ? (breaks[i + 1] - breaks[i]) / 4 : 0;
        for (int k = 0; k < 4; ++k) {
          evaluate_clip(*clip, breaks[i] + k * step);
          const Turns now = turns_of_values();
          for (std::size_t c = 0; c < all.size(); ++c) most[c] = std::max(most[c], correction_weight(all[c], now));
        }
      }
    }
    std::fill(values_.begin(), values_.end(), 0.0F);
    for (std::size_t c = 0; c < all.size(); ++c) {
      const double least = all[c].kind == Correction::Kind::lid_contact ? 0.02 : kLeastCorrection;
      if (most[c] > least) corrections_.push_back(all[c]);
    }
  }

  float target_weight(const Target& target) const { return std::max(values_[target.channel] * target.sign, 0.0F); }

  // For the values last evaluated, whose turns are `now`.
  double correction_weight(const Correction& correction, const Turns& now) const {
    double sum = 0.0;
    double squares = 0.0;
    for (std::size_t i = 0; i < skin_targets_.size(); ++i) {
      const double w = static_cast<double>(target_weight(skin_targets_[i]));
      const double u =
          correction.kind == Correction::Kind::jaw_bend ? target_turns_[i].jaw : target_turns_[i].lid[correction.eye];
      sum += w * u;
      squares += w * u * u;
    }
    if (correction.kind == Correction::Kind::jaw_bend) return std::max(4.0 * (squares - now.jaw * now.jaw), 0.0);
    const double turned = now.lid[correction.eye];
    const double excess = std::max(sum - turned, 0.0);
    if (correction.kind == Correction::Kind::lid_contact) return excess;
    return std::max(4.0 * (squares - excess - turned * turned), 0.0);
  }

  // The surface with this part alone turned by the share u.
  void pose_correction(const Correction& correction, double u) {
    std::fill(pose_.contractions.begin(), pose_.contractions.end(), 0.0F);
    pose_.lids = {};
    pose_.motions = {};
    if (correction.kind == Correction::Kind::jaw_bend) {
      for (const RigTables::HingeDrive& drive : rig_.tables().hinge_drives) {
        if (drive.frame != Frame::jaw || drive.angle != jaw_turn_) continue;
        pose_.contractions[drive.muscle] = static_cast<float>(u);
        break;
      }
      move_frames(rig_, values_, pose_.contractions, pose_);
    } else {
      pose_.lids[correction.eye].upper = u;
    }
    move_points(face_, rig_, pose_);
    make_surface(face_, rig_, pose_);
  }

  // Where the pose keeps a mesh.
  [[nodiscard]] const std::vector<glm::vec3>& posed(const Morphed& m) const {
    return m.part ? pose_.parts[*m.part] : pose_.positions;
  }
  [[nodiscard]] const std::vector<glm::vec3>& posed_normals(const Morphed& m) const {
    return m.part ? pose_.part_normals[*m.part] : pose_.normals;
  }

  void make_morphed() {
    std::fill(values_.begin(), values_.end(), 0.0F);
    if (!skin_targets_.empty() && face_.skin.surface.rows > 0) {
      Morphed skin;
      skin.name = "skin";
      skin.targets = skin_targets_;
      skin.corrections = corrections_;
      pose_face(face_, rig_, values_, pose_);
      skin.linear.positions = pose_.positions;
      skin.linear.normals = pose_.normals;
      morphed_.push_back(std::move(skin));
    }
    for (std::uint32_t index = 0; index < face_.rigid.size(); ++index) {
      if (pose_.parts[index].empty()) continue;
      Morphed part;
      part.name = face_.rigid[index].name;
      part.part = index;
      part.targets = choose_targets([&](ChannelId c) { return rig_.moves_part(c, index); });
      part.linear.positions = face_.rigid[index].positions;
      part.linear.normals = face_.rigid[index].normals;
      if (!part.targets.empty()) morphed_.push_back(std::move(part));
    }
    for (Morphed& m : morphed_) {
      for (const Target& target : m.targets) {
        values_[target.channel] = target.sign;
        pose_face(face_, rig_, values_, pose_);
        values_[target.channel] = 0.0F;
        LinearMesh::Target straight = straight_target(m);
        for (std::size_t v = 0; v < straight.moved.size(); ++v) {
          straight.moved[v] = posed(m)[v] - m.linear.positions[v];
          straight.turned[v] = posed_normals(m)[v] - m.linear.normals[v];
        }
        m.linear.targets.push_back(without_dust(std::move(straight)));
      }
      for (const Correction& correction : m.corrections) m.linear.targets.push_back(straight_correction(m, correction));
    }
  }

  static LinearMesh::Target straight_target(const Morphed& m) {
    const std::size_t count = m.linear.positions.size();
    return {std::vector<glm::vec3>(count, glm::vec3(0.0F)), std::vector<glm::vec3>(count, glm::vec3(0.0F))};
  }

  LinearMesh::Target straight_correction(const Morphed& m, const Correction& correction) {
    LinearMesh::Target straight = straight_target(m);
    pose_correction(correction, 1.0);
    const bool bend = correction.kind != Correction::Kind::lid_contact;
    const float end = bend ? -0.5F : -1.0F;
    const std::vector<glm::vec3>& positions = m.linear.positions;
    const std::vector<glm::vec3>& normals = m.linear.normals;
    for (std::size_t v = 0; v < positions.size(); ++v) {
      straight.moved[v] = end * (pose_.positions[v] - positions[v]);
      straight.turned[v] = end * (pose_.normals[v] - normals[v]);
    }
    if (bend) {
      pose_correction(correction, 0.5);
      for (std::size_t v = 0; v < positions.size(); ++v) {
        straight.moved[v] += pose_.positions[v] - positions[v];
        straight.turned[v] += pose_.normals[v] - normals[v];
      }
    }
    return without_dust(std::move(straight));
  }

  static LinearMesh::Target without_dust(LinearMesh::Target target) {
    for (std::size_t v = 0; v < target.moved.size(); ++v) {
      target.moved[v] = without_dust(target.moved[v], kPositionDust);
      target.turned[v] = without_dust(target.turned[v], kNormalDust);
    }
    return target;
  }

  // ---- what straight targets lack

  struct Moment {
    const Clip* clip = nullptr;
    std::int64_t time_ns = 0;
    double error_m = 0.0;
  };

  // A frame of every clip at least every 60th of a second.
  template <typename Visit>
  void visit_moments(const Clip& clip, Visit visit) const {
    const std::vector<std::int64_t> breaks = break_times(program_, clip);
    for (std::size_t i = 0; i < breaks.size(); ++i) {
      const std::int64_t end = i + 1 < breaks.size() ? breaks[i + 1] : breaks[i] + 1;
      const std::int64_t steps = std::max<std::int64_t>(1, (end - breaks[i] + kErrorStep_ns - 1) / kErrorStep_ns);
      for (std::int64_t k = 0; k < steps; ++k) visit(breaks[i] + (end - breaks[i]) * k / steps);
    }
  }

  // Weights of targets and corrections for the values last evaluated; residuals 0.
  void straight_weights(const Morphed& m, std::span<float> weights) {
    for (std::size_t i = 0; i < m.targets.size(); ++i) weights[i] = target_weight(m.targets[i]);
    if (!m.corrections.empty()) {
      const Turns now = turns_of_values();
      for (std::size_t i = 0; i < m.corrections.size(); ++i) {
        weights[m.targets.size() + i] = static_cast<float>(correction_weight(m.corrections[i], now));
      }
    }
    for (std::size_t i = m.targets.size() + m.corrections.size(); i < weights.size(); ++i) weights[i] = 0.0F;
  }

  // Weights of everything. Leaves what targets and corrections lack in `field_`.
  void weights_at(const Morphed& m, const Clip& clip, std::int64_t time_ns, std::span<float> weights) {
    evaluate_clip(clip, time_ns);
    straight_weights(m, weights);
    if (!m.basis) return;
    find_residual(m, weights);
    std::vector<double> fitted(m.basis->size());
    m.basis->fit(field_, fitted);
    const std::size_t first = m.targets.size() + m.corrections.size();
    for (std::size_t j = 0; j < fitted.size(); ++j) weights[first + j] = static_cast<float>(fitted[j]);
  }

  void find_residual(const Morphed& m, std::span<const float> weights) {
    pose_face(face_, rig_, values_, pose_);
    field_.resize(m.linear.positions.size());
    m.linear.place(weights, field_);
    for (std::size_t v = 0; v < field_.size(); ++v) field_[v] = posed(m)[v] - field_[v];
  }

  void add_residuals(Morphed& m) {
    const double bound = kResidualShare * options_.max_error_m;
    m.basis.emplace(m.linear.positions.size());
    struct Field {
      Moment moment;
      std::vector<glm::vec3> lacking;
    };
    std::vector<Field> working;
    std::vector<double> fitted;
    const auto remaining = [&](std::vector<glm::vec3> field) {
      fitted.resize(m.basis->size());
      m.basis->fit(field, fitted);
      m.basis->subtract(fitted, field);
      return field;
    };
    while (true) {
      // Fit what is known, worst first.
      while (m.basis->size() < kMostResiduals) {
        std::size_t worst = 0;
        Largest most;
        for (std::size_t f = 0; f < working.size(); ++f) {
          const Largest l = largest(remaining(working[f].lacking));
          if (l.length > most.length) {
            most = l;
            worst = f;
          }
        }
        if (most.length <= bound) break;
        append_residual(m, working[worst].moment, remaining(working[worst].lacking), most.index);
      }
      if (m.basis->size() >= kMostResiduals || working.size() >= kWorkingFields) return;
      // Look for moments that still lack something.
      std::vector<Moment> moments;
      for (const Clip* clip : clips_) {
        visit_moments(*clip, [&](std::int64_t t) {
          std::vector<float> weights(m.count());
          evaluate_clip(*clip, t);
          straight_weights(m, weights);
          find_residual(m, weights);
          const double error = largest(remaining(field_)).length;
          if (error > bound) moments.push_back({clip, t, error});
        });
      }
      if (moments.empty()) return;
      std::stable_sort(moments.begin(), moments.end(),
                       [](const Moment& a, const Moment& b) { return a.error_m > b.error_m; });
      if (moments.size() > kFieldsAtATime) moments.resize(kFieldsAtATime);
      for (const Moment& moment : moments) {
        std::vector<float> weights(m.count());
        evaluate_clip(*moment.clip, moment.time_ns);
        straight_weights(m, weights);
        find_residual(m, weights);
        working.push_back({moment, field_});
      }
    }
  }

  void append_residual(Morphed& m, const Moment& moment, std::vector<glm::vec3> lacking, std::size_t at) {
    LinearMesh::Target straight = straight_target(m);
    straight.moved = std::move(lacking);
    // The normals of that moment, less what the others give.
    std::vector<float> weights(m.count());
    weights_at(m, *moment.clip, moment.time_ns, weights);
    m.linear.turn(weights, straight.turned);
    for (std::size_t v = 0; v < straight.turned.size(); ++v) {
      const bool still = straight.moved[v] == glm::vec3(0.0F);
      straight.turned[v] = still ? glm::vec3(0.0F) : posed_normals(m)[v] - straight.turned[v];
    }
    straight = without_dust(std::move(straight));
    m.residuals.push_back(fmt::format("fix.{}.{}", nearest_landmark(m.linear.positions[at]), m.residuals.size() + 1));
    m.basis->add(straight.moved);
    m.linear.targets.push_back(std::move(straight));
  }

  [[nodiscard]] std::string nearest_landmark(const glm::vec3& p) const {
    std::string name = "face";
    float least = 1e9F;
    for (const program::Landmark& mark : program_.landmarks) {
      const glm::vec3 d = p - glm::vec3(mark.position[0], mark.position[1], mark.position[2]);
      const float squared = d.x * d.x + d.y * d.y + d.z * d.z;
      if (squared >= least) continue;
      least = squared;
      name = program_.string(mark.name);
    }
    return name;
  }

  // The file's keys against the runtime, at every moment and half-way between keys.
  void measure(const Clip& clip, const Morphed& m, const Keys& keys, GltfClipError& error) {
    const std::size_t count = m.count();
    std::vector<float> weights(count);
    std::vector<glm::vec3> normals(m.linear.normals.size());
    std::size_t key = 0;
    const auto look = [&](std::int64_t t) {
      const float at = static_cast<float>(static_cast<double>(t - clip.start_ns) / 1e9);
      if (at < keys.times.front()) key = 0;
      while (key + 1 < keys.times.size() && keys.times[key + 1] <= at) ++key;
      const std::size_t next = std::min(key + 1, keys.times.size() - 1);
      const float span = keys.times[next] - keys.times[key];
      const float u = span > 0.0F ? std::clamp((at - keys.times[key]) / span, 0.0F, 1.0F) : 0.0F;
      for (std::size_t i = 0; i < count; ++i) {
        const float a = keys.values[key * count + i];
        weights[i] = a + u * (keys.values[next * count + i] - a);
      }
      evaluate_clip(clip, t);
      find_residual(m, weights);
      const Largest most = largest(field_);
      ++error.samples;
      m.linear.turn(weights, normals);
      for (std::size_t v = 0; v < normals.size(); ++v) {
        const glm::vec3 n = normals[v];
        const double length = std::sqrt(static_cast<double>(n.x * n.x + n.y * n.y + n.z * n.z));
        const glm::vec3 o = posed_normals(m)[v];
        const double c = length > 0.0 ? static_cast<double>(n.x * o.x + n.y * o.y + n.z * o.z) / length : 1.0;
        error.normal_rad = std::max(error.normal_rad, arc_cosine(std::min(c, 1.0)));
      }
      if (most.length <= error.largest_m) return;
      error.largest_m = most.length;
      error.time_s = static_cast<double>(at);
      error.mesh = m.name;
      error.place = nearest_landmark(m.linear.positions[most.index]);
    };
    visit_moments(clip, look);
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

  int add_node(std::string_view name, int parent, glm::dvec3 translation) {
    tinygltf::Node node;
    node.name = node_names_.unique(name);
    if (translation != glm::dvec3(0.0)) node.translation = triple(translation);
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
    pose_face(face_, rig_, values_, pose_);
    const std::vector<glm::vec3> positions = pose_.positions;
    const std::vector<glm::vec3> normals = pose_.normals;

    tinygltf::Primitive shared;
    shared.mode = TINYGLTF_MODE_TRIANGLES;
    shared.attributes["POSITION"] = writer_.vectors(positions, true);
    shared.attributes["NORMAL"] = writer_.vectors(normals, false);
    if (!face_.skin.colors.empty()) shared.attributes["COLOR_0"] = writer_.vectors(face_.skin.colors, false);
    add_joints(shared);

    Morphed* morphed = morphed_of(std::nullopt);
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

  Morphed* morphed_of(std::optional<std::size_t> part) {
    for (Morphed& m : morphed_) {
      if (m.part == part) return &m;
    }
    return nullptr;
  }

  void add_targets(tinygltf::Primitive& primitive, const Morphed& m) {
    for (const LinearMesh::Target& target : m.linear.targets) add_target(primitive, target.moved, target.turned);
  }

  void add_target(tinygltf::Primitive& primitive, const std::vector<glm::vec3>& moved,
                  const std::vector<glm::vec3>& turned) {
    std::map<std::string, int> attributes;
    attributes["POSITION"] = options_.dense ? writer_.vectors(moved, true) : writer_.sparse_vectors(moved, true);
    attributes["NORMAL"] = options_.dense ? writer_.vectors(turned, false) : writer_.sparse_vectors(turned, false);
    primitive.targets.push_back(std::move(attributes));
  }

  static void name_targets(tinygltf::Mesh& mesh, const Morphed& m) {
    mesh.weights.assign(m.count(), 0.0);
    tinygltf::Value::Array names;
    for (const Target& target : m.targets) names.emplace_back(target.name);
    for (const Correction& correction : m.corrections) names.emplace_back(correction.name);
    for (const std::string& residual : m.residuals) names.emplace_back(residual);
    mesh.extras = tinygltf::Value(tinygltf::Value::Object{{"targetNames", tinygltf::Value(names)}});
  }

  static glm::vec3 without_dust(glm::vec3 d, float dust) {
    return d.x * d.x + d.y * d.y + d.z * d.z < dust * dust ? glm::vec3(0.0F) : d;
  }

  // Joint 0 is the head, joint 1 the torso. A joint of no weight has index 0, as the format asks.
  void add_joints(tinygltf::Primitive& primitive) {
    std::vector<std::array<std::uint8_t, 4>> joints;
    std::vector<float> weights;
    for (const float share : rig_.head_share()) {
      const bool torso_alone = share <= 0.0F;
      const bool both = share > 0.0F && share < 1.0F;
      joints.push_back({static_cast<std::uint8_t>(torso_alone ? 1 : 0), static_cast<std::uint8_t>(both ? 1 : 0), 0, 0});
      weights.insert(weights.end(), {both ? share : 1.0F, both ? 1.0F - share : 0.0F, 0.0F, 0.0F});
    }
    primitive.attributes["JOINTS_0"] = writer_.joints(joints);
    primitive.attributes["WEIGHTS_0"] =
        writer_.floats(weights, 4, TINYGLTF_TYPE_VEC4, TINYGLTF_TARGET_ARRAY_BUFFER, false);

    std::vector<float> inverse_bind;
    for (const Frame frame : {Frame::head, Frame::torso}) {
      const glm::vec3 p(-pivot(frame));
      inverse_bind.insert(inverse_bind.end(), {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, p.x, p.y, p.z, 1});
    }
    tinygltf::Skin skin;
    skin.name = "neck";
    skin.joints = {frame_nodes_[index_of(Frame::head)], frame_nodes_[index_of(Frame::torso)]};
    skin.skeleton = frame_nodes_[index_of(Frame::torso)];
    skin.inverseBindMatrices = writer_.floats(inverse_bind, 16, TINYGLTF_TYPE_MAT4, 0, false);
    model_.skins.push_back(std::move(skin));
  }

  void add_rigid_meshes() {
    GltfNames mesh_names;
    mesh_names.unique("skin");
    std::fill(values_.begin(), values_.end(), 0.0F);
    for (std::uint32_t index = 0; index < face_.rigid.size(); ++index) {
      const RigidMesh& rigid = face_.rigid[index];
      Morphed* morphed = morphed_of(index);
      tinygltf::Mesh mesh;
      std::vector<glm::vec3> positions(rigid.positions.size());
      const glm::dvec3 origin = pivot(rigid.frame);
      for (std::size_t v = 0; v < positions.size(); ++v)
        positions[v] = glm::vec3(glm::dvec3(rigid.positions[v]) - origin);
      tinygltf::Primitive shared;
      shared.mode = TINYGLTF_MODE_TRIANGLES;
      bool written = false;
      for (const Primitive& primitive : rigid.primitives) {
        if (primitive.triangles.empty()) continue;
        if (!written) {
          shared.attributes["POSITION"] = writer_.vectors(positions, true);
          shared.attributes["NORMAL"] = writer_.vectors(rigid.normals, false);
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
      const int node = add_node(rigid.name, frame_nodes_[index_of(rigid.frame)], glm::dvec3(0.0));
      model_.nodes[static_cast<std::size_t>(node)].mesh = static_cast<int>(model_.meshes.size()) - 1;
      if (morphed != nullptr) morphed->node = node;
    }
  }

  // Values of every channel; what the clip does not touch is at rest.
  void evaluate_clip(const Clip& clip, std::int64_t time_ns) {
    std::fill(values_.begin(), values_.end(), 0.0F);
    program::evaluate(program_, clip, time_ns, values_);
  }

  void evaluate_motions(const Clip& clip, std::int64_t time_ns) {
    evaluate_clip(clip, time_ns);
    contractions(rig_, values_, pose_.contractions);
    move_frames(rig_, values_, pose_.contractions, pose_);
  }

  // A frame that moves in one clip is set in all, or the next clip would begin where this one ended.
  void find_moving_frames() {
    for (const Clip* clip : clips_) {
      for (const std::int64_t t : break_times(program_, *clip)) {
        // A little after the knot too: a curve may leave rest and come back between two knots.
        for (const std::int64_t later : {t, t + (clip->end_ns - t) / 97}) {
          evaluate_motions(*clip, later);
          for (std::size_t f = 0; f < kFrameCount; ++f) {
            turns_[f] = turns_[f] || pose_.motions[f].rotation != glm::dquat(1.0, 0.0, 0.0, 0.0);
            shifts_[f] = shifts_[f] || pose_.motions[f].translation != glm::dvec3(0.0);
          }
        }
      }
    }
    // An animation needs at least one channel.
    if (morphed_.empty() && std::none_of(turns_.begin(), turns_.end(), [](bool b) { return b; }) &&
        std::none_of(shifts_.begin(), shifts_.end(), [](bool b) { return b; })) {
      turns_[index_of(Frame::head)] = true;
    }
  }

  void add_animation(const Clip& clip) {
    tinygltf::Animation animation;
    animation.name = clip_names_.unique(program_.string(clip.name));
    const std::vector<std::int64_t> breaks = break_times(program_, clip);
    static constexpr std::array<double, 1> kTurnTolerances{kTurnTolerance};
    static constexpr std::array<double, 3> kShiftTolerances{kShiftTolerance, kShiftTolerance, kShiftTolerance};

    GltfClipError error;
    error.clip = animation.name;
    for (const Morphed& morphed : morphed_) {
      if (morphed.node < 0) continue;
      const bool exact = options_.max_error_m > 0.0;
      std::vector<double> tolerance(morphed.targets.size(), exact ? kExactWeightTolerance : kWeightTolerance);
      tolerance.resize(tolerance.size() + morphed.corrections.size(),
                       exact ? kExactWeightTolerance : kCorrectionTolerance);
      for (std::size_t j = 0; j < morphed.residuals.size(); ++j) {
        const double reach = largest(morphed.basis->field(j)).length;
        tolerance.push_back(reach > 0.0 ? kKeyShare * options_.max_error_m / reach : 1.0);
      }
      const Keys keys = fit_keys(breaks, Interpolation::linear, tolerance,
                                 [&](std::int64_t t, std::span<float> out) { weights_at(morphed, clip, t, out); });
      add_channel(animation, morphed.node, "weights", keys, 1, TINYGLTF_TYPE_SCALAR);
      if (report_ != nullptr) measure(clip, morphed, keys, error);
    }
    if (report_ != nullptr) report_->clips.push_back(std::move(error));
    for (std::size_t f = 0; f < kFrameCount; ++f) {
      if (turns_[f]) {
        const Keys keys =
            fit_keys(breaks, Interpolation::slerp, kTurnTolerances, [&](std::int64_t t, std::span<float> out) {
              evaluate_motions(clip, t);
              const glm::dquat q = pose_.motions[f].rotation;
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
              evaluate_motions(clip, t);
              const glm::vec3 p(rest + pose_.motions[f].translation);
              out[0] = p.x;
              out[1] = p.y;
              out[2] = p.z;
            });
        add_channel(animation, frame_nodes_[f], "translation", keys, 3, TINYGLTF_TYPE_VEC3);
      }
    }
    if (animation.channels.empty()) return;
    animation.extras = tinygltf::Value(tinygltf::Value::Object{
        {"kind", tinygltf::Value(std::string(program::enum_name(clip.kind)))},
        {"start_s", tinygltf::Value(static_cast<double>(clip.start_ns) / 1e9)},
    });
    model_.animations.push_back(std::move(animation));
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
      sampler.input = writer_.floats(keys.times, 1, TINYGLTF_TYPE_SCALAR, 0, true);
      times_.emplace(keys.times, sampler.input);
    }
    sampler.output = writer_.floats(keys.values, width, type, 0, false);
    tinygltf::AnimationChannel channel;
    channel.sampler = static_cast<int>(animation.samplers.size());
    channel.target_node = node;
    channel.target_path = path;
    animation.samplers.push_back(std::move(sampler));
    animation.channels.push_back(std::move(channel));
  }

  tl::expected<std::vector<std::byte>, Failure> serialise() {
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
  Pose pose_;
  std::vector<float> values_;  // one for each channel
  std::vector<const Clip*> clips_;
  std::vector<Target> skin_targets_;
  std::vector<Turns> target_turns_;  // one for each skin target, at full weight
  std::vector<Correction> corrections_;
  double jaw_turn_ = 0.0;  // the widest hinge of the jaw [rad]
  std::vector<Morphed> morphed_;
  std::vector<glm::vec3> field_;  // what targets lack, of the mesh last looked at
  GltfNames node_names_;
  GltfNames clip_names_;
  std::array<int, kFrameCount> frame_nodes_{};
  std::array<bool, kFrameCount> turns_{};
  std::array<bool, kFrameCount> shifts_{};
  std::map<std::vector<float>, int> times_;  // input accessors already written
};

}  // namespace

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
