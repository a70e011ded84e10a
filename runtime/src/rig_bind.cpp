#include <algorithm>
#include <cassert>
#include <cmath>

#include <fmt/format.h>

#include <nms/runtime/landmark_set.h>
#include <nms/runtime/mesh_normals.h>
#include <nms/runtime/region_shares.h>
#include <nms/runtime/sparse_matrix.h>
#include <nms/runtime/trigonometry.h>

#include "rig_parts.h"

namespace nms::runtime {

using program::Failure;
using program::Motion;
using program::Muscle;
using program::MuscleKind;
using program::Program;
using program::Side;

namespace {

constexpr const char* kJawRegion = "jaw";
constexpr const char* kNeckRegion = "neck";

const char* landmark_suffix(Side side) { return side == Side::left ? "_L" : side == Side::right ? "_R" : ""; }

/// The one to give: of the known set's places those of the midline have one name for muscles of either side, and the
/// others one for each side, of which the left one tells a muscle of no side its distance from the middle.
std::string landmark_to_give(const std::string& name, Side side) {
  for (const LandmarkInfo& known : landmark_set()) {
    if (known.name != name) continue;
    return known.sided ? name + landmark_suffix(side == Side::none ? Side::left : side) : name;
  }
  return name + landmark_suffix(side);
}
const char* region_suffix(Side side) { return side == Side::left ? "_left" : side == Side::right ? "_right" : ""; }

}  // namespace

std::optional<Frame> moved_frame(program::Frame frame) {
  switch (frame) {
    case program::Frame::torso:
      return Frame::torso;
    case program::Frame::head:
      return Frame::head;
    case program::Frame::jaw:
      return Frame::jaw;
    case program::Frame::eyes:
      return Frame::eye_left;
    case program::Frame::none:
      break;
  }
  return std::nullopt;
}

std::optional<Failure> RigParts::check_face() const {
  const Skin& skin = face.skin;
  const auto bad = [](std::string cause) {
    return Failure{"bad_face", "face", std::move(cause), "write the face again from its surfaces"};
  };
  if (skin.surface.columns != skin.points.size()) {
    return bad(
        fmt::format("the surface matrix has {} columns for {} points", skin.surface.columns, skin.points.size()));
  }
  const std::size_t vertices = skin.surface.rows;
  if (skin.surface.row_begin.size() != vertices + 1) return bad("the surface matrix lacks rows");
  if (skin.offsets.size() != vertices) {
    return bad(fmt::format("{} offsets for {} vertices", skin.offsets.size(), vertices));
  }
  if (!skin.colors.empty() && skin.colors.size() != vertices) {
    return bad(fmt::format("{} colours for {} vertices", skin.colors.size(), vertices));
  }
  const auto check_primitives = [&](const std::vector<Primitive>& primitives, std::size_t count) {
    for (const Primitive& primitive : primitives) {
      if (primitive.material >= face.materials.size() || primitive.triangles.size() % 3 != 0) return false;
      for (const std::uint32_t v : primitive.triangles) {
        if (v >= count) return false;
      }
    }
    return true;
  };
  if (!check_primitives(skin.primitives, vertices)) return bad("a triangle or material index is out of range");
  for (const RigidMesh& mesh : face.rigid) {
    if (mesh.normals.size() != mesh.positions.size() || !check_primitives(mesh.primitives, mesh.positions.size())) {
      return bad(fmt::format("mesh '{}' has an index out of range or lacks normals", mesh.name));
    }
  }
  for (const auto& [name, values] : face.regions) {
    if (values.size() != skin.points.size()) {
      return bad(fmt::format("region '{}' has {} weights for {} points", name, values.size(), skin.points.size()));
    }
  }
  return std::nullopt;
}

// The runtime's tables hold what lies about the midline: x = 0, and heights of less than a metre.
std::optional<Failure> RigParts::check_place() const {
  constexpr double kFurthest = 0.6;  // [m], times the face's scale
  const auto left = landmarks.find("eye_centre_L");
  const auto right = landmarks.find("eye_centre_R");
  if (left == landmarks.end() || right == landmarks.end()) return std::nullopt;
  const glm::dvec3 middle = 0.5 * (left->second + right->second);
  const double off = 0.2 * std::abs(left->second.x - right->second.x);
  if (std::abs(middle.x) <= off && std::abs(middle.y) <= kFurthest * scale.length &&
      std::abs(middle.z) <= kFurthest * scale.length && left->second.x > right->second.x)
    return std::nullopt;
  if (left->second.x <= right->second.x) {
    return Failure{"bad_face", "face", "its left eye is not to the left of its right one, which is +x",
                   "the left is the subject's own; see that `up` and `forward` fit the file"};
  }
  return Failure{"bad_face", "face",
                 fmt::format("the middle between its eyes is at ({:.0f}mm, {:.0f}mm, {:.0f}mm)", middle.x * 1e3,
                             middle.y * 1e3, middle.z * 1e3),
                 "move the file's head to its origin, midline at x = 0: `origin (0mm, 1650mm, 20mm)`"};
}

void RigParts::scale_muscles() {
  rig.scale = scale.length;
  muscles.assign(program.muscles.begin(), program.muscles.end());
  const bool same = scale.length == 1.0 && scale.axes == glm::dvec3(1.0);
  if (same) return;
  const auto by_axes = [&](float(&v)[3]) {
    for (int k = 0; k < 3; ++k) v[k] = static_cast<float>(static_cast<double>(v[k]) * scale.axes[k]);
  };
  const auto by_length = [&](float& v) { v = static_cast<float>(static_cast<double>(v) * scale.length); };
  for (Muscle& m : muscles) {
    by_axes(m.attachment_offset);
    by_axes(m.insertion_offset);
    by_axes(m.slide);
    for (float* v : {&m.insertion_radius, &m.dissipation_radius, &m.perpendicular_radius, &m.major_radius,
                     &m.minor_radius, &m.amount})
      by_length(*v);
  }
}

bool RigParts::may_lack(const Failure& failure, RigGap gap) {
  if (gaps == nullptr || (failure.kind != "missing_landmark" && failure.kind != "missing_region")) return false;
  gap.is_region = failure.kind == "missing_region";
  if (std::none_of(gaps->begin(), gaps->end(), [&](const RigGap& g) {
        return g.muscle == gap.muscle && g.channel == gap.channel && g.name == gap.name;
      }))
    gaps->push_back(std::move(gap));
  return true;
}

tl::expected<glm::dvec3, Failure> RigParts::landmark(const Muscle& muscle, program::StringId id) {
  const std::string name(program.string(id));
  for (const std::string& candidate : {name + landmark_suffix(muscle.side), name, name + "_L"}) {
    // A muscle of no side may name a sided place (the corner of the mouth): it means its distance from the middle.
    if (const auto it = landmarks.find(candidate); it != landmarks.end()) return it->second;
  }
  missing = landmark_to_give(name, muscle.side);
  return tl::unexpected(Failure{"missing_landmark", name_of(muscle), fmt::format("the face has no landmark '{}'", name),
                                fmt::format("add `landmark {}` to the face, or place the muscle elsewhere", name)});
}

tl::expected<const std::vector<float>*, Failure> RigParts::region(const Muscle& muscle, program::StringId id) {
  const std::string name(program.string(id));
  for (const std::string& candidate : {name + region_suffix(muscle.side), name}) {
    if (const auto it = face.regions.find(candidate); it != face.regions.end()) return &it->second;
  }
  missing = name + region_suffix(muscle.side);
  std::string known;
  for (const auto& [other, values] : face.regions) known += (known.empty() ? "" : ", ") + other;
  return tl::unexpected(Failure{"missing_region", name_of(muscle), fmt::format("the face has no region '{}'", name),
                                fmt::format("its regions are: {}", known.empty() ? "none" : known)});
}

// The region's weight times what the exception leaves; empty where the muscle has neither.
tl::expected<std::vector<float>, Failure> RigParts::weights(const Muscle& muscle) {
  std::vector<float> result;
  if (muscle.region != program::StringId{}) {
    const auto found = region(muscle, muscle.region);
    if (!found) return tl::unexpected(found.error());
    result = **found;
  }
  if (muscle.except != program::StringId{}) {
    const auto found = region(muscle, muscle.except);
    if (!found) return tl::unexpected(found.error());
    if (result.empty()) result.assign(face.skin.points.size(), 1.0F);
    for (std::size_t i = 0; i < result.size(); ++i) result[i] *= 1.0F - (**found)[i];
  }
  return result;
}

// Which way the surface faces about an independent point: the normals of the vertices it moves, by their shares.
std::vector<glm::dvec3> RigParts::point_normals() const {
  const Skin& skin = face.skin;
  std::vector<glm::vec3> x(skin.points.size());
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = glm::vec3(skin.points[i]);
  std::vector<glm::vec3> positions(skin.surface.rows);
  std::vector<glm::vec3> normals(skin.surface.rows);
  multiply(skin.surface, x, positions);
  area_weighted_normals(skin.primitives, positions, normals);
  std::vector<glm::dvec3> result(skin.points.size(), glm::dvec3(0.0));
  for (std::uint32_t row = 0; row < skin.surface.rows; ++row) {
    for (std::uint32_t k = skin.surface.row_begin[row]; k < skin.surface.row_begin[row + 1]; ++k) {
      result[skin.surface.column[k]] += static_cast<double>(skin.surface.value[k]) * glm::dvec3(normals[row]);
    }
  }
  for (glm::dvec3& n : result) {
    const double length = std::sqrt(dot(n, n));
    n = length > 1e-12 ? n / length : glm::dvec3(0.0, 0.0, 1.0);
  }
  return result;
}

std::optional<Failure> RigParts::read_muscles() {
  const std::vector<glm::dvec3> normals = point_normals();
  const std::vector<SkinNormal> skin = outer_skin();
  rig.pull_begin.push_back(0);
  for (std::uint32_t index = 0; index < muscles.size(); ++index) {
    if (auto failure = read_muscle(index, normals, skin)) {
      if (!may_lack(*failure, {index, program::kNone, false, missing})) return failure;
    }
    rig.pull_begin.push_back(static_cast<std::uint32_t>(rig.pulls.size()));
  }
  return std::nullopt;
}

std::optional<Failure> RigParts::read_muscle(std::uint32_t index, std::span<const glm::dvec3> normals,
                                             std::span<const SkinNormal> skin) {
  const Muscle& muscle = muscles[index];
  MusclePlaces places;
  const auto attachment = landmark(muscle, muscle.attachment);
  if (!attachment) return attachment.error();
  places.attachment = *attachment + sided(muscle.attachment_offset, muscle.side);
  places.insertion = places.attachment;
  if (muscle.insertion != program::StringId{}) {
    const auto insertion = landmark(muscle, muscle.insertion);
    if (!insertion) return insertion.error();
    places.insertion = *insertion + sided(muscle.insertion_offset, muscle.side);
  }
  switch (muscle.kind) {
    case MuscleKind::eyelid:
      return read_eyelid(index, places.attachment, places.insertion);
    case MuscleKind::hinge:
      return read_hinge(index, places.attachment);
    case MuscleKind::linear:
    case MuscleKind::sheet:
    case MuscleKind::sphincter:
    case MuscleKind::bulge:
    case MuscleKind::roll: {
      const auto share = weights(muscle);
      if (!share) return share.error();
      const std::vector<glm::dvec3> directions = muscle.kind == MuscleKind::bulge
                                                     ? bulge_directions(muscle, places, normals, skin)
                                                     : std::vector<glm::dvec3>();
      const std::vector<Pull> set =
          activation_set(muscle, places, face.skin.points, directions.empty() ? normals : directions, *share);
      rig.pulls.insert(rig.pulls.end(), set.begin(), set.end());
      break;
    }
  }
  return std::nullopt;
}

std::optional<Failure> RigParts::read_hinge(std::uint32_t index, const glm::dvec3& axis) {
  const Muscle& muscle = muscles[index];
  const auto frame = moved_frame(muscle.frame);
  if (!frame) {
    return Failure{"missing_frame", name_of(muscle), "a hinge has no frame", "say which it moves: `frame jaw`"};
  }
  if (const auto mesh = part_named(program.string(muscle.region));
      mesh && !face.regions.contains(face_region(muscle))) {
    bend_part(index, *mesh);
    return std::nullopt;
  }
  RigTables::HingeDrive drive{index, *frame, 0.0, 0.0, sided(muscle.slide, muscle.side)};
  // A hinge of one side turns to that side.
  const double angle = static_cast<double>(muscle.angle);
  (muscle.side == Side::none ? drive.angle : drive.yaw) = muscle.side == Side::right ? -angle : angle;
  if (muscle.frame == program::Frame::eyes) {
    if (muscle.side == Side::right) drive.frame = Frame::eye_right;
    rig.hinge_drives.push_back(drive);
    if (muscle.side != Side::none) return std::nullopt;
    drive.frame = Frame::eye_right;
    rig.hinge_drives.push_back(drive);
    return std::nullopt;
  }
  const bool moves_skin = *frame == Frame::jaw && muscle.region != program::StringId{};
  const auto share = moves_skin ? weights(muscle) : tl::expected<std::vector<float>, Failure>();
  if (!share) return share.error();
  rig.hinge_drives.push_back(drive);
  // Frames lie in the midline but for the eyes, so a hinge's axis does too.
  rig.pivots[index_of(*frame)] = {0.0, axis.y, axis.z};
  if (moves_skin && rig.jaw_points.empty()) {
    for (std::uint32_t i = 0; i < share->size(); ++i) {
      if ((*share)[i] > 0.0F) rig.jaw_points.push_back({i, static_cast<double>((*share)[i])});
    }
  }
  return std::nullopt;
}

std::string RigParts::face_region(const Muscle& muscle) const { return std::string(program.string(muscle.region)); }

std::optional<std::uint32_t> RigParts::part_named(std::string_view name) const {
  for (std::uint32_t i = 0; i < face.rigid.size(); ++i) {
    if (face.rigid[i].name == name) return i;
  }
  return std::nullopt;
}

std::optional<Failure> RigParts::read_axes() {
  for (std::uint32_t index = 0; index < program.channels.size(); ++index) {
    const program::Channel& channel = program.channels[index];
    if (channel.kind != program::ChannelKind::axis || channel.motion == Motion::none) continue;
    const auto frame = moved_frame(channel.frame);
    if (!frame) continue;
    const auto need = [&](const char* name) -> std::optional<Failure> {
      if (landmarks.contains(std::string_view(name))) return std::nullopt;
      return Failure{"missing_landmark", fmt::format("axis {}", program.string(channel.name)),
                     fmt::format("the face has no landmark '{}' to turn about", name),
                     fmt::format("add `landmark {}` to the face", name)};
    };
    std::optional<Failure> failure;
    switch (*frame) {
      case Frame::torso:
        failure = need("torso_pivot");
        break;
      case Frame::head:
        failure = need("head_pivot");
        break;
      case Frame::jaw:
        if (rig.hinge_drives.empty() && !landmarks.contains(std::string_view("jaw_hinge")))
          failure = need("jaw_hinge_L");
        break;
      case Frame::eye_left:
      case Frame::eye_right:
        failure = need("eye_centre_L");
        if (!failure) failure = need("eye_centre_R");
        break;
    }
    if (failure) {
      const char* pivot = *frame == Frame::torso  ? "torso_pivot"
                          : *frame == Frame::head ? "head_pivot"
                          : *frame == Frame::jaw  ? "jaw_hinge_L"
                                                  : "eye_centre_L";
      if (may_lack(*failure, {program::kNone, index, false, pivot})) continue;
      return failure;
    }
    const int shift = static_cast<int>(channel.motion) - static_cast<int>(Motion::translate_x);
    const double by = shift >= 0 ? scale.axes[shift] : 1.0;
    rig.axis_drives.push_back({index, channel.motion, channel.frame, by * static_cast<double>(channel.full_scale)});
  }
  return std::nullopt;
}

void RigParts::make_pivots() {
  const auto from = [&](const char* name) -> std::optional<glm::dvec3> {
    const auto it = landmarks.find(std::string_view(name));
    return it == landmarks.end() ? std::nullopt : std::optional(it->second);
  };
  if (const auto p = from("torso_pivot")) rig.pivots[index_of(Frame::torso)] = *p;
  if (const auto p = from("head_pivot")) rig.pivots[index_of(Frame::head)] = *p;
  if (rig.pivots[index_of(Frame::jaw)] == glm::dvec3(0.0)) {
    for (const char* name : {"jaw_hinge", "jaw_hinge_L"}) {
      if (const auto p = from(name)) {
        rig.pivots[index_of(Frame::jaw)] = {0.0, p->y, p->z};
        break;
      }
    }
  }
  for (std::size_t eye = 0; eye < kEyeCount; ++eye) {
    const Frame frame = eye == 0 ? Frame::eye_left : Frame::eye_right;
    if (const auto p = from(eye == 0 ? "eye_centre_L" : "eye_centre_R")) {
      rig.pivots[index_of(frame)] = *p;
    } else if (has_eye[eye]) {
      rig.pivots[index_of(frame)] = rig.eyes[eye].centre;
    }
  }
  // An axis may move the jaw where no hinge says which skin follows.
  if (rig.jaw_points.empty()) {
    if (const auto it = face.regions.find(kJawRegion); it != face.regions.end()) {
      for (std::uint32_t i = 0; i < it->second.size(); ++i) {
        if (it->second[i] > 0.0F) rig.jaw_points.push_back({i, static_cast<double>(it->second[i])});
      }
    }
  }
}

void RigParts::make_head_share() {
  if (!face.regions.contains(kNeckRegion)) {
    rig.head_share.assign(face.skin.surface.rows, 1.0F);
    return;
  }
  rig.head_share = region_shares(face, kNeckRegion);
  for (float& share : rig.head_share) share = std::clamp(share, 0.0F, 1.0F);
}

void RigParts::mark_actuated() {
  rig.actuated.assign(program.channels.size(), false);
  rig.skin.assign(program.channels.size(), false);
  rig.actuations.assign(program.actuations.begin(), program.actuations.end());
  rig.top.assign(program.muscles.size(), 1.0F);

  std::vector<bool> moves(program.muscles.size(), false);  // anything
  std::vector<bool> moves_skin(program.muscles.size(), false);
  for (std::size_t m = 0; m < program.muscles.size(); ++m) {
    moves[m] = moves_skin[m] = rig.pull_begin[m + 1] > rig.pull_begin[m];
  }
  for (const RigTables::LidDrive& drive : rig.lid_drives) {
    if (drive.fraction != 0.0 && !rig.eyes[drive.eye].points.empty())
      moves[drive.muscle] = moves_skin[drive.muscle] = true;
  }
  for (const RigTables::HingeDrive& drive : rig.hinge_drives) {
    if (drive.angle == 0.0 && drive.yaw == 0.0 && drive.slide == glm::dvec3(0.0)) continue;
    moves[drive.muscle] = true;
    if (drive.frame == Frame::jaw && !rig.jaw_points.empty()) moves_skin[drive.muscle] = true;
    const std::size_t eye = drive.frame == Frame::eye_right ? 1 : 0;
    const bool turns_eye = drive.frame == Frame::eye_left || drive.frame == Frame::eye_right;
    if (turns_eye && !rig.eyes[eye].points.empty()) moves_skin[drive.muscle] = true;
  }
  for (const RigTables::PartDrive& drive : rig.part_drives) {
    if (drive.pitch != 0.0 || drive.yaw != 0.0 || drive.slide != glm::dvec3(0.0)) moves[drive.muscle] = true;
  }
  for (const program::Actuation& actuation : program.actuations) {
    const auto muscle = static_cast<std::size_t>(actuation.muscle);
    const auto channel = static_cast<std::size_t>(actuation.channel);
    rig.top[muscle] = std::max(rig.top[muscle], actuation.share);
    if (actuation.share == 0.0F) continue;
    if (moves[muscle]) rig.actuated[channel] = true;
    if (moves_skin[muscle]) rig.skin[channel] = true;
  }
  const bool lids = !rig.eyes[0].points.empty() || !rig.eyes[1].points.empty();
  for (const RigTables::AxisDrive& drive : rig.axis_drives) {
    if (drive.full_scale == 0.0) continue;
    rig.actuated[drive.channel] = true;
    if (drive.frame == program::Frame::jaw && !rig.jaw_points.empty()) rig.skin[drive.channel] = true;
    if (drive.frame == program::Frame::eyes && drive.motion != Motion::none && lids) rig.skin[drive.channel] = true;
  }
}

tl::expected<Rig, Failure> bind(const Face& face, const Program& program, std::vector<RigGap>* gaps) {
  RigParts parts(face, program, gaps);
  if (auto failure = parts.check_face()) return tl::unexpected(std::move(*failure));
  if (auto failure = parts.check_place()) return tl::unexpected(std::move(*failure));
  parts.scale_muscles();
  if (auto failure = parts.read_muscles()) return tl::unexpected(std::move(*failure));
  if (auto failure = parts.make_lids()) return tl::unexpected(std::move(*failure));
  parts.make_lips();
  parts.make_contacts();
  if (auto failure = parts.read_axes()) return tl::unexpected(std::move(*failure));
  parts.make_pivots();
  parts.make_head_share();
  parts.mark_actuated();
  parts.make_moving_surface();
  return Rig(std::move(parts.rig));
}

std::span<const Pull> Rig::activation(program::MuscleId muscle) const {
  const auto m = static_cast<std::size_t>(muscle);
  return std::span(tables_.pulls).subspan(tables_.pull_begin[m], tables_.pull_begin[m + 1] - tables_.pull_begin[m]);
}

bool Rig::moves_part(program::ChannelId channel, std::uint32_t mesh) const {
  for (const program::Actuation& actuation : tables_.actuations) {
    if (actuation.channel != channel || actuation.share == 0.0F) continue;
    for (const RigTables::PartDrive& drive : tables_.part_drives) {
      if (drive.mesh == mesh && drive.muscle == static_cast<std::uint32_t>(actuation.muscle)) return true;
    }
  }
  return false;
}

}  // namespace nms::runtime
