#include "morph_targets.h"

#include <algorithm>
#include <utility>

#include <nms/runtime/rig.h>

#include "gltf_names.h"
#include "rig_parts.h"

namespace nms::runtime {

using program::ChannelId;
using program::ChannelKind;
using program::Clip;

namespace {

constexpr float kPositionDust = 1e-6F;  // [m]
constexpr float kNormalDust = 1e-3F;    // of a unit normal, 0.06 degrees
// A sum of normals that is shorter than this is made so long again.
constexpr float kShortestNormal = 0.7F;
// A correction that no clip asks more of than this is left out: 0.1 of the largest sagitta is below 0.3 mm.
constexpr double kLeastCorrection = 0.1;
constexpr double kLeastExcess = 0.02;  // of the whole turn
// Between the moments that are looked at, a clip may ask for a little more.
constexpr double kMoreBetween = 1.05;

/// Not of what goes too far, or not far enough.
bool bends(const TurnCorrection& correction) {
  return correction.kind == TurnCorrection::Kind::lid_bend || correction.kind == TurnCorrection::Kind::jaw_bend;
}

glm::vec3 without_dust(glm::vec3 d, float dust) {
  return d.x * d.x + d.y * d.y + d.z * d.z < dust * dust ? glm::vec3(0.0F) : d;
}

}  // namespace

LinearMesh::Target still_target(const MorphedMesh& m) {
  const std::size_t count = m.linear.positions.size();
  return {std::vector<glm::vec3>(count, glm::vec3(0.0F)), std::vector<glm::vec3>(count, glm::vec3(0.0F))};
}

LinearMesh::Target without_dust(LinearMesh::Target target) {
  for (std::size_t v = 0; v < target.moved.size(); ++v) {
    target.moved[v] = without_dust(target.moved[v], kPositionDust);
    target.turned[v] = without_dust(target.turned[v], kNormalDust);
  }
  return target;
}

MorphTargets::MorphTargets(ClipStage& stage, std::span<const Clip* const> clips, bool all)
    : stage_(stage), clips_(clips), all_(all) {
  skin_targets_ = choose_targets([&](ChannelId c) { return stage_.rig.moves_skin(c); });
  choose_corrections();
  make_meshes();
}

MorphedMesh* MorphTargets::mesh_of(std::optional<std::size_t> part) {
  for (MorphedMesh& m : meshes_) {
    if (m.part == part) return &m;
  }
  return nullptr;
}

bool MorphTargets::used(std::uint32_t channel, float sign) const {
  for (const Clip* clip : clips_) {
    for (std::uint32_t c = 0; c < clip->curve_count; ++c) {
      const program::Curve& curve = stage_.program.curves[clip->first_curve + c];
      if (static_cast<std::uint32_t>(curve.channel) != channel) continue;
      for (std::uint32_t k = 0; k < curve.knot_count; ++k) {
        const program::Knot& knot = stage_.program.knots[curve.first_knot + k];
        if (knot.value * sign > 0.0F) return true;
        if (knot.shape < program::kShapeFirstReserved && k + 1 < curve.knot_count) {
          const program::Handles& handles = stage_.program.handles_of(curve, knot);
          if (handles.b1 * sign > 0.0F || handles.b2 * sign > 0.0F) return true;
        }
      }
    }
  }
  return false;
}

template <typename Moves>
std::vector<MorphTarget> MorphTargets::choose_targets(Moves moves) const {
  GltfNames names;
  std::vector<MorphTarget> targets;
  for (std::uint32_t c = 0; c < stage_.program.channels.size(); ++c) {
    const program::Channel& channel = stage_.program.channels[c];
    if (!moves(ChannelId{c})) continue;
    const auto add = [&](float sign, program::StringId name) {
      if (!all_ && !used(c, sign)) return;
      targets.push_back({c, sign, names.unique(stage_.program.string(name))});
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

MorphTargets::Turns MorphTargets::turns_of_values() {
  contractions(stage_.rig, stage_.values, stage_.pose.contractions);
  turn_lids(stage_.rig, stage_.values, stage_.pose.contractions, stage_.pose.lids);
  Turns turns;
  for (std::size_t e = 0; e < kEyeCount; ++e) turns.lid[e] = stage_.pose.lids[e].upper;
  turns.jaw = jaw_turn_ > 0.0 ? jaw_angle() / jaw_turn_ : 0.0;
  return turns;
}

double MorphTargets::jaw_angle() const {
  double angle = 0.0;
  for (const RigTables::HingeDrive& drive : stage_.rig.tables().hinge_drives) {
    if (drive.frame == Frame::jaw) angle += drive.angle * static_cast<double>(stage_.pose.contractions[drive.muscle]);
  }
  return angle;
}

void MorphTargets::choose_corrections() {
  for (const RigTables::HingeDrive& drive : stage_.rig.tables().hinge_drives) {
    if (drive.frame == Frame::jaw) jaw_turn_ = std::max(jaw_turn_, drive.angle);
  }
  target_turns_.clear();
  for (const MorphTarget& target : skin_targets_) {
    stage_.values[target.channel] = target.sign;
    target_turns_.push_back(turns_of_values());
    stage_.values[target.channel] = 0.0F;
  }
  const std::vector<TurnCorrection> all{
      {TurnCorrection::Kind::lid_bend, 0, "fix.lid_upper_L.50"},
      {TurnCorrection::Kind::lid_contact, 0, "fix.lid_upper_L.contact"},
      {TurnCorrection::Kind::lid_shut, 0, "fix.lid_upper_L.shut"},
      {TurnCorrection::Kind::lid_bend, 1, "fix.lid_upper_R.50"},
      {TurnCorrection::Kind::lid_contact, 1, "fix.lid_upper_R.contact"},
      {TurnCorrection::Kind::lid_shut, 1, "fix.lid_upper_R.shut"},
      {TurnCorrection::Kind::jaw_bend, 0, "fix.jaw.50"},
      {TurnCorrection::Kind::jaw_limit, 0, "fix.jaw.limit"},
  };
  std::vector<double> most(all.size(), 0.0);
  for (const Clip* clip : clips_) {
    const std::vector<std::int64_t> breaks = break_times(stage_.program, *clip);
    for (std::size_t i = 0; i < breaks.size(); ++i) {
      const std::int64_t step = i + 1 < breaks.size() ? (breaks[i + 1] - breaks[i]) / 4 : 0;
      for (int k = 0; k < 4; ++k) {
        stage_.evaluate(*clip, breaks[i] + k * step);
        const Turns now = turns_of_values();
        for (std::size_t c = 0; c < all.size(); ++c) most[c] = std::max(most[c], correction_weight(all[c], now));
      }
    }
  }
  std::fill(stage_.values.begin(), stage_.values.end(), 0.0F);
  for (std::size_t c = 0; c < all.size(); ++c) {
    const double least = bends(all[c]) ? kLeastCorrection : kLeastExcess;
    if (most[c] <= least) continue;
    corrections_.push_back(all[c]);
    corrections_.back().whole = std::max(kMoreBetween * most[c], 1.0);
  }
}

float MorphTargets::target_weight(const MorphTarget& target) const {
  return std::max(stage_.values[target.channel] * target.sign, 0.0F);
}

double MorphTargets::correction_weight(const TurnCorrection& correction, const Turns& now) const {
  double sum = 0.0;
  double squares = 0.0;
  const bool jaw =
      correction.kind == TurnCorrection::Kind::jaw_bend || correction.kind == TurnCorrection::Kind::jaw_limit;
  for (std::size_t i = 0; i < skin_targets_.size(); ++i) {
    const double w = static_cast<double>(target_weight(skin_targets_[i]));
    const double u = jaw ? target_turns_[i].jaw : target_turns_[i].lid[correction.eye];
    sum += w * u;
    squares += w * u * u;
  }
  const double turned = jaw ? now.jaw : now.lid[correction.eye];
  const double excess = sum - turned;  // what targets turn too far, or not far enough
  if (!bends(correction)) {
    const bool short_of = correction.kind == TurnCorrection::Kind::lid_shut;
    return std::max(short_of ? -excess : excess, 0.0) / correction.whole;
  }
  return std::max(4.0 * (squares - excess - turned * turned), 0.0) / correction.whole;
}

void MorphTargets::pose_correction(const TurnCorrection& correction, double u) {
  stage_.forget_pose();
  std::fill(stage_.pose.contractions.begin(), stage_.pose.contractions.end(), 0.0F);
  stage_.pose.lids = {};
  stage_.pose.motions = {};
  if (correction.kind == TurnCorrection::Kind::jaw_bend || correction.kind == TurnCorrection::Kind::jaw_limit) {
    for (const RigTables::HingeDrive& drive : stage_.rig.tables().hinge_drives) {
      if (drive.frame != Frame::jaw || drive.angle != jaw_turn_) continue;
      stage_.pose.contractions[drive.muscle] = static_cast<float>(u);
      break;
    }
    move_frames(stage_.rig, stage_.values, stage_.pose.contractions, stage_.pose);
  } else {
    stage_.pose.lids[correction.eye].upper = u;
  }
  move_points(stage_.face, stage_.rig, stage_.pose);
  make_surface(stage_.face, stage_.rig, stage_.pose);
}

void MorphTargets::make_meshes() {
  std::fill(stage_.values.begin(), stage_.values.end(), 0.0F);
  if (!skin_targets_.empty() && stage_.face.skin.surface.rows > 0) {
    MorphedMesh skin;
    skin.name = "skin";
    skin.targets = skin_targets_;
    skin.corrections = corrections_;
    stage_.pose_values();
    skin.linear.positions = stage_.pose.positions;
    skin.linear.normals = stage_.pose.normals;
    meshes_.push_back(std::move(skin));
  }
  for (std::uint32_t index = 0; index < stage_.face.rigid.size(); ++index) {
    const bool bends = !stage_.pose.parts[index].empty();
    const bool rides = rides_by_targets(index);
    if (!bends && !rides) continue;
    MorphedMesh part;
    part.name = stage_.face.rigid[index].name;
    part.part = index;
    part.targets = choose_targets([&](ChannelId c) {
      return (bends && stage_.rig.moves_part(c, index)) || (rides && turns_jaw(static_cast<std::uint32_t>(c)));
    });
    part.linear.positions = stage_.face.rigid[index].positions;
    part.linear.normals = stage_.face.rigid[index].normals;
    if (!part.targets.empty()) meshes_.push_back(std::move(part));
  }
  for (MorphedMesh& m : meshes_) {
    for (const MorphTarget& target : m.targets) {
      stage_.pose_alone(target.channel, target.sign);
      m.linear.targets.push_back(without_dust(straight_target(m)));
    }
    for (const TurnCorrection& correction : m.corrections)
      m.linear.targets.push_back(straight_correction(m, correction));
  }
}

// A file without clips is driven from outside, by its targets alone: what the jaw carries has to come with them.
bool MorphTargets::rides_by_targets(std::uint32_t part) const {
  return all_ && clips_.empty() && stage_.face.rigid[part].frame == Frame::jaw;
}

bool MorphTargets::turns_jaw(std::uint32_t channel) {
  stage_.pose_alone(channel, 1.0F);
  const FrameMotion& jaw = stage_.pose.motions[static_cast<std::size_t>(Frame::jaw)];
  return jaw.rotation != FrameMotion{}.rotation || jaw.translation != FrameMotion{}.translation;
}

LinearMesh::Target MorphTargets::straight_target(const MorphedMesh& m) {
  LinearMesh::Target straight = still_target(m);
  const std::vector<glm::vec3>& rest = m.linear.positions;
  const std::vector<glm::vec3>& normals = m.linear.normals;
  const bool bends = !m.part || !stage_.pose.parts[*m.part].empty();
  const std::vector<glm::vec3>& places = bends ? m.posed(stage_.pose) : rest;
  const std::vector<glm::vec3>& turned = bends ? m.posed_normals(stage_.pose) : normals;
  const bool rides = m.part && rides_by_targets(static_cast<std::uint32_t>(*m.part));
  const Placement jaw = rides ? jaw_in_head(stage_.rig, stage_.pose) : Placement{};
  for (std::size_t v = 0; v < rest.size(); ++v) {
    if (rides) {
      straight.moved[v] = glm::vec3(transform(jaw, glm::dvec3(places[v]))) - rest[v];
      straight.turned[v] = glm::vec3(jaw.rotation * glm::dvec3(turned[v])) - normals[v];
    } else {
      straight.moved[v] = places[v] - rest[v];
      straight.turned[v] = turned[v] - normals[v];
    }
  }
  return straight;
}

LinearMesh::Target MorphTargets::straight_correction(const MorphedMesh& m, const TurnCorrection& correction) {
  LinearMesh::Target straight = still_target(m);
  pose_correction(correction, 1.0);
  const bool bend = bends(correction);
  const float end = bend ? -0.5F : correction.kind == TurnCorrection::Kind::lid_shut ? 1.0F : -1.0F;
  const std::vector<glm::vec3>& positions = m.linear.positions;
  const std::vector<glm::vec3>& normals = m.linear.normals;
  for (std::size_t v = 0; v < positions.size(); ++v) {
    straight.moved[v] = end * (stage_.pose.positions[v] - positions[v]);
    straight.turned[v] = end * (stage_.pose.normals[v] - normals[v]);
  }
  if (bend) {
    pose_correction(correction, 0.5);
    for (std::size_t v = 0; v < positions.size(); ++v) {
      straight.moved[v] += stage_.pose.positions[v] - positions[v];
      straight.turned[v] += stage_.pose.normals[v] - normals[v];
    }
  }
  const auto whole = static_cast<float>(correction.whole);
  for (glm::vec3& d : straight.moved) d *= whole;
  for (glm::vec3& n : straight.turned) n *= whole;
  return without_dust(std::move(straight));
}

void MorphTargets::straight_weights(const MorphedMesh& m, std::span<float> weights) {
  for (std::size_t i = 0; i < m.targets.size(); ++i) weights[i] = target_weight(m.targets[i]);
  if (!m.corrections.empty()) {
    const Turns now = turns_of_values();
    for (std::size_t i = 0; i < m.corrections.size(); ++i) {
      weights[m.targets.size() + i] = static_cast<float>(correction_weight(m.corrections[i], now));
    }
  }
  for (std::size_t i = m.targets.size() + m.corrections.size(); i < weights.size(); ++i) weights[i] = 0.0F;
}

bool MorphTargets::at_rest(const MorphedMesh& m) const {
  return std::all_of(m.targets.begin(), m.targets.end(),
                     [&](const MorphTarget& target) { return target_weight(target) == 0.0F; });
}

void MorphTargets::weights_at(const MorphedMesh& m, const Clip& clip, std::int64_t time_ns, std::span<float> weights) {
  stage_.evaluate(clip, time_ns);
  // A face that holds still needs no second look.
  if (last_.mesh == &m && last_.values == stage_.values && last_.weights.size() == weights.size()) {
    std::copy(last_.weights.begin(), last_.weights.end(), weights.begin());
    return;
  }
  straight_weights(m, weights);
  if (m.basis && !at_rest(m)) {
    find_lacking(m, weights);
    std::vector<double> fitted(m.basis->size());
    m.basis->fit(lacking_, fitted);
    const std::size_t first = m.targets.size() + m.corrections.size();
    for (std::size_t j = 0; j < fitted.size(); ++j) weights[first + j] = static_cast<float>(fitted[j]);
  }
  last_.mesh = &m;
  last_.values = stage_.values;
  last_.weights.assign(weights.begin(), weights.end());
}

void MorphTargets::find_lacking(const MorphedMesh& m, std::span<const float> weights) {
  stage_.pose_values();
  const std::size_t count = m.linear.positions.size();
  lacking_.resize(2 * count);
  const std::span<glm::vec3> places(lacking_.data(), count);
  m.linear.place(weights, places);
  const float per_m = static_cast<float>(1.0 / m.lack_m);
  for (std::size_t v = 0; v < count; ++v) places[v] = per_m * (m.posed(stage_.pose)[v] - places[v]);
  const std::span<glm::vec3> normals(lacking_.data() + count, count);
  m.linear.turn(weights, normals);
  for (std::size_t v = 0; v < count; ++v) {
    const glm::vec3 truth = m.posed_normals(stage_.pose)[v];
    const float along = normals[v].x * truth.x + normals[v].y * truth.y + normals[v].z * truth.z;
    normals[v] = (std::clamp(along, kShortestNormal, 1.0F) * truth - normals[v]) / m.lack_turn;
  }
}

}  // namespace nms::runtime
