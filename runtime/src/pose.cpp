#include <algorithm>
#include <cassert>
#include <cmath>

#include <nms/runtime/trigonometry.h>

#include "rig_parts.h"

namespace nms::runtime {

using program::Motion;

namespace {

glm::dquat half_turn(glm::dvec3 axis, double angle) {
  const double s = sine(0.5 * angle);
  return {cosine(0.5 * angle), s * axis.x, s * axis.y, s * axis.z};
}

Placement about(glm::dvec3 pivot, const FrameMotion& motion) {
  Placement placement;
  placement.rotation = glm::mat3_cast(motion.rotation);
  placement.translation = pivot + motion.translation - placement.rotation * pivot;
  return placement;
}

// What a frame's drives add up to.
struct Turn {
  glm::dvec3 angles{0.0};  // about x, y, z [rad]
  glm::dvec3 shift{0.0};   // [m]
};

void add_motion(Motion motion, double amount, Turn& turn) {
  switch (motion) {
    case Motion::rotate_x:
      turn.angles.x += amount;
      break;
    case Motion::rotate_y:
      turn.angles.y += amount;
      break;
    case Motion::rotate_z:
      turn.angles.z += amount;
      break;
    case Motion::translate_x:
      turn.shift.x += amount;
      break;
    case Motion::translate_y:
      turn.shift.y += amount;
      break;
    case Motion::translate_z:
      turn.shift.z += amount;
      break;
    case Motion::none:
      break;
  }
}

Placement after(const Placement& parent, const Placement& child) {
  return {parent.rotation * child.rotation, parent.rotation * child.translation + parent.translation};
}

}  // namespace

glm::dvec3 transform(const Placement& placement, glm::dvec3 p) {
  return placement.rotation * p + placement.translation;
}

Placement jaw_in_head(const Rig& rig, const Pose& pose) {
  return about(rig.tables().pivots[index_of(Frame::jaw)], pose.motions[index_of(Frame::jaw)]);
}

Pose make_pose(const Face& face, const Rig& rig) {
  Pose pose;
  pose.contractions.assign(rig.muscle_count(), 0.0F);
  pose.points = face.skin.points;
  pose.x.resize(face.skin.points.size());
  pose.positions.resize(face.skin.surface.rows);
  pose.normals.resize(face.skin.surface.rows);
  pose.lip_overlaps.resize(rig.tables().lip_columns.size());
  pose.lip_line.width = rig.tables().lip_column;
  pose.parts.resize(face.rigid.size());
  pose.part_normals.resize(face.rigid.size());
  for (const RigTables::PartDrive& drive : rig.tables().part_drives) {
    pose.parts[drive.mesh] = face.rigid[drive.mesh].positions;
    pose.part_normals[drive.mesh] = face.rigid[drive.mesh].normals;
  }
  pose.scratch = make_normal_scratch(rig.tables().moving_normals, pose.positions.size());
  make_whole_surface(face, rig, pose);
  return pose;
}

void contractions(const Rig& rig, std::span<const float> values, std::span<float> out) {
  assert(values.size() == rig.channel_count() && out.size() == rig.muscle_count());
  const RigTables& t = rig.tables();
  for (float& c : out) c = 0.0F;
  for (const program::Actuation& a : t.actuations) {
    out[static_cast<std::size_t>(a.muscle)] += a.share * values[static_cast<std::size_t>(a.channel)];
  }
  for (std::size_t m = 0; m < out.size(); ++m) out[m] = std::clamp(out[m], 0.0F, t.top[m]);
}

void move_frames(const Rig& rig, std::span<const float> values, std::span<const float> contractions, Pose& pose) {
  const RigTables& t = rig.tables();
  std::array<Turn, kFrameCount> turns{};
  for (const RigTables::HingeDrive& drive : t.hinge_drives) {
    const double k = static_cast<double>(contractions[drive.muscle]);
    turns[index_of(drive.frame)].angles.x += k * drive.angle;
    turns[index_of(drive.frame)].angles.y += k * drive.yaw;
    turns[index_of(drive.frame)].shift += k * drive.slide;
  }
  for (const RigTables::AxisDrive& drive : t.axis_drives) {
    const double amount = drive.full_scale * static_cast<double>(values[drive.channel]);
    add_motion(drive.motion, amount, turns[index_of(*moved_frame(drive.frame))]);
    // An axis turns both eyes alike.
    if (drive.frame == program::Frame::eyes) add_motion(drive.motion, amount, turns[index_of(Frame::eye_right)]);
  }
  for (std::size_t i = 0; i < kFrameCount; ++i) {
    const Turn& turn = turns[i];
    FrameMotion& motion = pose.motions[i];
    motion.rotation = half_turn({0.0, 1.0, 0.0}, turn.angles.y) * half_turn({1.0, 0.0, 0.0}, turn.angles.x) *
                      half_turn({0.0, 0.0, 1.0}, turn.angles.z);
    motion.translation = turn.shift;
    pose.placements[i] = about(t.pivots[i], motion);
  }
  Placement& head = pose.placements[index_of(Frame::head)];
  head = after(pose.placements[index_of(Frame::torso)], head);
  for (const Frame child : {Frame::jaw, Frame::eye_left, Frame::eye_right}) {
    pose.placements[index_of(child)] = after(head, pose.placements[index_of(child)]);
  }
}

void move_points(const Face& face, const Rig& rig, Pose& pose) {
  const RigTables& t = rig.tables();
  const std::vector<glm::dvec3>& rest = face.skin.points;
  std::copy(rest.begin(), rest.end(), pose.points.begin());
  for (std::size_t m = 0; m < t.top.size(); ++m) {
    const double k = static_cast<double>(pose.contractions[m]);
    if (k == 0.0) continue;
    for (std::uint32_t i = t.pull_begin[m]; i < t.pull_begin[m + 1]; ++i) {
      pose.points[t.pulls[i].point] += k * t.pulls[i].displacement;
    }
  }

  move_lids(face, rig, pose);

  const FrameMotion& jaw = pose.motions[index_of(Frame::jaw)];
  if (jaw.rotation != glm::dquat(1.0, 0.0, 0.0, 0.0) || jaw.translation != glm::dvec3(0.0)) {
    const Placement placement = jaw_in_head(rig, pose);
    for (const RigTables::JawPoint& p : t.jaw_points) {
      glm::dvec3& point = pose.points[p.point];
      point += p.weight * (transform(placement, point) - point);
    }
  }
  hold_points_off_teeth(rig, pose);
  part_lips(rig, pose);
}

void pose_face(const Face& face, const Rig& rig, std::span<const float> values, Pose& pose) {
  contractions(rig, values, pose.contractions);
  turn_lids(rig, values, pose.contractions, pose.lids);
  move_frames(rig, values, pose.contractions, pose);
  move_points(face, rig, pose);
  make_surface(face, rig, pose);
  bend_parts(face, rig, pose);
}

void place_skin(const Rig& rig, const Pose& pose, std::span<glm::vec3> positions, std::span<glm::vec3> normals) {
  const Placement& head = pose.placements[index_of(Frame::head)];
  const Placement& torso = pose.placements[index_of(Frame::torso)];
  const std::span<const float> share = rig.head_share();
  for (std::size_t v = 0; v < positions.size(); ++v) {
    const double w = static_cast<double>(share[v]);
    const glm::dvec3 p(pose.positions[v]);
    const glm::dvec3 n(pose.normals[v]);
    positions[v] = glm::vec3(w * transform(head, p) + (1.0 - w) * transform(torso, p));
    const glm::dvec3 turned = w * (head.rotation * n) + (1.0 - w) * (torso.rotation * n);
    const double length = std::sqrt(dot(turned, turned));
    normals[v] = length > 0.0 ? glm::vec3(turned / length) : pose.normals[v];
  }
}

}  // namespace nms::runtime
