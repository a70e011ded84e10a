#include <nms/runtime/rig.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include <nms/runtime/sparse_matrix.h>
#include <nms/runtime/trigonometry.h>

namespace nms::runtime {

using program::Failure;
using program::Motion;
using program::Muscle;
using program::MuscleKind;
using program::Program;
using program::Side;

// Fills the tables, step by step.
struct RigParts {
  const Face& face;
  const Program& program;
  std::map<std::string_view, glm::dvec3, std::less<>> landmarks;
  RigTables rig;

  std::optional<Failure> check_face() const;
  void read_landmarks();
  tl::expected<glm::dvec3, Failure> landmark(const Muscle& muscle, program::StringId name) const;
  tl::expected<const std::vector<float>*, Failure> region(const Muscle& muscle, program::StringId name) const;
  tl::expected<std::vector<float>, Failure> weights(const Muscle& muscle) const;
  std::vector<glm::dvec3> point_normals() const;
  std::optional<Failure> read_muscles();
  std::optional<Failure> read_eyelid(std::uint32_t index, const glm::dvec3& centre, const glm::dvec3& margin);
  std::optional<Failure> read_hinge(std::uint32_t index, const glm::dvec3& axis);
  std::string face_region(const Muscle& muscle) const;
  std::optional<std::uint32_t> part_named(std::string_view name) const;
  void bend_part(std::uint32_t index, std::uint32_t mesh, const glm::dvec3& axis);
  std::optional<Failure> make_lids();
  void make_lips();
  std::optional<Failure> read_axes();
  void make_pivots();
  void make_head_share();
  void mark_actuated();

  std::string name_of(const Muscle& muscle) const { return fmt::format("muscle {}", program.string(muscle.name)); }
  bool lower_lid(const Muscle& muscle) const {
    return program.string(muscle.region).find("lower") != std::string_view::npos;
  }
  std::array<bool, kEyeCount> has_eye{};
  std::array<double, kEyeCount> margin_x{};
  std::vector<std::pair<std::uint32_t, std::size_t>> eyelids;  // muscle, eye
};

namespace {

// How far the lids follow the eyeball, as shares of its turn; fitted by eye to the openings measured on the reference
// face: 118 % looking up, 43 % looking down.
constexpr double kUpperLidFollowsDown = 0.85;
constexpr double kUpperLidFollowsUp = 0.45;
constexpr double kLowerLidFollowsDown = 0.30;
constexpr double kLowerLidFollowsUp = 0.15;
// The upper lid comes to rest this much past the lower lid's edge, so that no light shows between two polylines.
constexpr double kLidContact = 1.02;
// No lid goes further open than this.
constexpr double kLidWidest = -0.8;
// How far along the lid a point looks for the widest opening.
constexpr double kCornerReach = 0.0006;  // [m]
// A point whose share of a lid is at least this belongs to the lid's edge.
constexpr float kMarginShare = 0.99F;

// Lips: columns along the mouth, how close upper and lower lip may come, how deep into the lip an overlap is spread,
// and how far apart in depth they may be and still touch (a jaw thrust forward passes in front).
constexpr int kLipColumns = 24;
constexpr double kLipGap = 0.0002;   // [m]
constexpr double kLipDepth = 0.010;  // [m]
constexpr double kLipTouch = 0.006;  // [m]

constexpr const char* kJawRegion = "jaw";
constexpr const char* kNeckRegion = "neck";

double dot(glm::dvec3 a, glm::dvec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

std::size_t index_of(Frame frame) { return static_cast<std::size_t>(frame); }

// x away from the midline on the muscle's side
glm::dvec3 sided(const float (&offset)[3], Side side) {
  const double sign = side == Side::right ? -1.0 : 1.0;
  return {sign * static_cast<double>(offset[0]), offset[1], offset[2]};
}

const char* landmark_suffix(Side side) { return side == Side::left ? "_L" : side == Side::right ? "_R" : ""; }
const char* region_suffix(Side side) { return side == Side::left ? "_left" : side == Side::right ? "_right" : ""; }

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

glm::dquat half_turn(glm::dvec3 axis, double angle) {
  const double s = sine(0.5 * angle);
  return {cosine(0.5 * angle), s * axis.x, s * axis.y, s * axis.z};
}

glm::dvec3 transform(const Placement& placement, glm::dvec3 p) {
  return placement.rotation * p + placement.translation;
}

Placement about(glm::dvec3 pivot, const FrameMotion& motion) {
  Placement placement;
  placement.rotation = glm::mat3_cast(motion.rotation);
  placement.translation = pivot + motion.translation - placement.rotation * pivot;
  return placement;
}

Placement after(const Placement& parent, const Placement& child) {
  return {parent.rotation * child.rotation, parent.rotation * child.translation + parent.translation};
}

}  // namespace

// ------------------------------------------------------------------------------------------------ binding

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

void RigParts::read_landmarks() {
  for (const program::Landmark& mark : program.landmarks) {
    landmarks[program.string(mark.name)] = {mark.position[0], mark.position[1], mark.position[2]};
  }
}

tl::expected<glm::dvec3, Failure> RigParts::landmark(const Muscle& muscle, program::StringId id) const {
  const std::string name(program.string(id));
  for (const std::string& candidate : {name + landmark_suffix(muscle.side), name, name + "_L"}) {
    // A muscle of no side may name a sided place (the corner of the mouth): it means its distance from the middle.
    if (const auto it = landmarks.find(candidate); it != landmarks.end()) return it->second;
  }
  return tl::unexpected(Failure{"missing_landmark", name_of(muscle), fmt::format("the face has no landmark '{}'", name),
                                fmt::format("add `landmark {}` to the face, or place the muscle elsewhere", name)});
}

tl::expected<const std::vector<float>*, Failure> RigParts::region(const Muscle& muscle, program::StringId id) const {
  const std::string name(program.string(id));
  for (const std::string& candidate : {name + region_suffix(muscle.side), name}) {
    if (const auto it = face.regions.find(candidate); it != face.regions.end()) return &it->second;
  }
  std::string known;
  for (const auto& [other, values] : face.regions) known += (known.empty() ? "" : ", ") + other;
  return tl::unexpected(Failure{"missing_region", name_of(muscle), fmt::format("the face has no region '{}'", name),
                                fmt::format("its regions are: {}", known.empty() ? "none" : known)});
}

// The region's weight times what the exception leaves; empty where the muscle has neither.
tl::expected<std::vector<float>, Failure> RigParts::weights(const Muscle& muscle) const {
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
  rig.pull_begin.push_back(0);
  for (std::uint32_t index = 0; index < program.muscles.size(); ++index) {
    const Muscle& muscle = program.muscles[index];
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
        if (auto failure = read_eyelid(index, places.attachment, places.insertion)) return failure;
        break;
      case MuscleKind::hinge:
        if (auto failure = read_hinge(index, places.attachment)) return failure;
        break;
      case MuscleKind::linear:
      case MuscleKind::sheet:
      case MuscleKind::sphincter:
      case MuscleKind::bulge: {
        const auto share = weights(muscle);
        if (!share) return share.error();
        const std::vector<Pull> set = activation_set(muscle, places, face.skin.points, normals, *share);
        rig.pulls.insert(rig.pulls.end(), set.begin(), set.end());
        break;
      }
    }
    rig.pull_begin.push_back(static_cast<std::uint32_t>(rig.pulls.size()));
  }
  return std::nullopt;
}

std::optional<Failure> RigParts::read_eyelid(std::uint32_t index, const glm::dvec3& centre, const glm::dvec3& margin) {
  const Muscle& muscle = program.muscles[index];
  if (muscle.region == program::StringId{}) {
    return Failure{"missing_region", name_of(muscle), "an eyelid muscle has no region",
                   "say which lid it turns: `region lid_upper` or `region lid_lower`"};
  }
  if (const auto found = region(muscle, muscle.region); !found) return found.error();
  for (std::size_t eye = 0; eye < kEyeCount; ++eye) {
    const Side side = eye == 0 ? Side::left : Side::right;
    if (muscle.side != Side::none && muscle.side != side) continue;
    // A muscle of no side turns both eyes' lids; its places are the left eye's.
    const double mirror = muscle.side == Side::none && eye == 1 ? -1.0 : 1.0;
    if (!has_eye[eye]) {
      rig.eyes[eye].centre = {mirror * centre.x, centre.y, centre.z};
      margin_x[eye] = mirror * margin.x;
      has_eye[eye] = true;
    }
    eyelids.emplace_back(index, eye);
  }
  return std::nullopt;
}

std::optional<Failure> RigParts::read_hinge(std::uint32_t index, const glm::dvec3& axis) {
  const Muscle& muscle = program.muscles[index];
  const auto frame = moved_frame(muscle.frame);
  if (!frame) {
    return Failure{"missing_frame", name_of(muscle), "a hinge has no frame", "say which it moves: `frame jaw`"};
  }
  if (const auto mesh = part_named(program.string(muscle.region));
      mesh && !face.regions.contains(face_region(muscle))) {
    bend_part(index, *mesh, {0.0, axis.y, axis.z});
    return std::nullopt;
  }
  // Frames lie in the midline but for the eyes, so a hinge's axis does too.
  rig.hinge_drives.push_back({index, *frame, static_cast<double>(muscle.angle), sided(muscle.slide, muscle.side)});
  rig.pivots[index_of(*frame)] = {0.0, axis.y, axis.z};
  if (*frame != Frame::jaw || muscle.region == program::StringId{}) return std::nullopt;
  const auto share = weights(muscle);
  if (!share) return share.error();
  if (rig.jaw_points.empty()) {
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

// From the rearmost vertex, which stays, to the foremost, which goes all the way.
void RigParts::bend_part(std::uint32_t index, std::uint32_t mesh, const glm::dvec3& axis) {
  const Muscle& muscle = program.muscles[index];
  const std::vector<glm::vec3>& rest = face.rigid[mesh].positions;
  RigTables::PartDrive drive{index, mesh, std::vector<glm::vec3>(rest.size(), glm::vec3(0.0F))};
  double back = 0.0;
  double front = 0.0;
  for (std::size_t v = 0; v < rest.size(); ++v) {
    const double z = static_cast<double>(rest[v].z);
    back = v == 0 ? z : std::min(back, z);
    front = v == 0 ? z : std::max(front, z);
  }
  if (front <= back) return;
  const double angle = static_cast<double>(muscle.angle);
  const glm::dvec3 slide = sided(muscle.slide, muscle.side);
  for (std::size_t v = 0; v < rest.size(); ++v) {
    const glm::dvec3 p(rest[v]);
    const double weight = 1.0 - smooth_fall((p.z - back) / (front - back));
    drive.displacements[v] = glm::vec3(weight * (turn_about_x(p, axis, sine(angle), cosine(angle)) - p + slide));
  }
  rig.part_drives.push_back(std::move(drive));
}

std::optional<Failure> RigParts::make_lids() {
  const std::vector<glm::dvec3>& points = face.skin.points;
  for (std::size_t index = 0; index < kEyeCount; ++index) {
    if (!has_eye[index]) continue;
    RigTables::Eye& eye = rig.eyes[index];
    const char* suffix = index == 0 ? "_left" : "_right";
    const auto upper_region = face.regions.find(std::string("lid_upper") + suffix);
    const auto lower_region = face.regions.find(std::string("lid_lower") + suffix);
    if (upper_region == face.regions.end() || lower_region == face.regions.end()) {
      return Failure{"missing_region", "eyelids", fmt::format("the face lacks lid_upper{0} or lid_lower{0}", suffix),
                     "both lids are needed, to know where one meets the other"};
    }
    const std::vector<float>& upper = upper_region->second;
    const std::vector<float>& lower = lower_region->second;
    // The edges are those of the surface: control points stand off it where it bends.
    const auto edge = [&](const std::vector<float>& region) {
      std::vector<glm::dvec3> chosen;
      for (std::uint32_t row = 0; row < face.skin.surface.rows; ++row) {
        float share = 0.0F;
        glm::dvec3 position(0.0);
        for (std::uint32_t k = face.skin.surface.row_begin[row]; k < face.skin.surface.row_begin[row + 1]; ++k) {
          const std::uint32_t point = face.skin.surface.column[k];
          share += face.skin.surface.value[k] * region[point];
          position += static_cast<double>(face.skin.surface.value[k]) * points[point];
        }
        if (share >= kMarginShare) chosen.push_back(position);
      }
      return chosen;
    };
    const LidMargin upper_edge(LidMargin::Lid::upper, edge(upper), eye.centre);
    const LidMargin lower_edge(LidMargin::Lid::lower, edge(lower), eye.centre);
    eye.closing_angle = closing_angle(upper_edge, lower_edge, margin_x[index]);
    for (std::uint32_t i = 0; i < points.size(); ++i) {
      if (upper[i] <= 0.0F && lower[i] <= 0.0F) continue;
      // A spline lags behind its control points where they turn less and less, towards the corners of the eye.
      const double x = points[i].x;
      const double angle =
          std::max({closing_angle(upper_edge, lower_edge, x - kCornerReach), closing_angle(upper_edge, lower_edge, x),
                    closing_angle(upper_edge, lower_edge, x + kCornerReach)});
      // No slope at the lid's outer border, or the skin that is held creases against the skin that is pulled.
      const double hold = 1.0 - smooth_fall(static_cast<double>(std::max(upper[i], lower[i])));
      eye.points.push_back({i, angle * static_cast<double>(upper[i]), -angle * static_cast<double>(lower[i]), hold});
    }
  }
  for (const auto& [index, eye] : eyelids) {
    const Muscle& muscle = program.muscles[index];
    const bool is_upper = !lower_lid(muscle);
    const double shut = rig.eyes[eye].closing_angle;
    double fraction = static_cast<double>(muscle.closes);
    if (fraction == 0.0 && shut > 0.0) {
      fraction = (is_upper ? 1.0 : -1.0) * static_cast<double>(muscle.angle) / shut;
    }
    rig.lid_drives.push_back({index, static_cast<std::uint8_t>(eye), is_upper, fraction});
  }
  return std::nullopt;
}

// Faces without lips are left alone.
void RigParts::make_lips() {
  const auto upper_region = face.regions.find("lip_upper");
  const auto lower_region = face.regions.find("lip_lower");
  if (upper_region == face.regions.end() || lower_region == face.regions.end()) return;
  const std::vector<glm::dvec3>& points = face.skin.points;
  const std::vector<float>& upper = upper_region->second;
  const std::vector<float>& lower = lower_region->second;

  double widest = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (upper[i] >= kMarginShare || lower[i] >= kMarginShare) widest = std::max(widest, std::abs(points[i].x));
  }
  if (widest <= 0.0) return;
  constexpr std::uint32_t kNoPoint = 0xFFFFFFFFU;
  std::array<std::uint32_t, kLipColumns> lowest{};
  std::array<std::uint32_t, kLipColumns> highest{};
  lowest.fill(kNoPoint);
  highest.fill(kNoPoint);
  const double width = 2.0 * widest / kLipColumns;
  const auto offer = [&](std::uint32_t i, int column) {
    std::uint32_t& low = lowest[static_cast<std::size_t>(column)];
    std::uint32_t& high = highest[static_cast<std::size_t>(column)];
    if (upper[i] >= kMarginShare && (low == kNoPoint || points[i].y < points[low].y)) low = i;
    if (lower[i] >= kMarginShare && (high == kNoPoint || points[i].y > points[high].y)) high = i;
  };
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const double x = points[i].x;
    // By |x|, so that columns mirror; a point of the midline stands in the innermost column of both sides.
    const int step = std::min(static_cast<int>(std::abs(x) / width), kLipColumns / 2 - 1);
    if (x >= 0.0) offer(i, kLipColumns / 2 + step);
    if (x <= 0.0) offer(i, kLipColumns / 2 - 1 - step);
  }
  for (std::size_t c = 0; c < kLipColumns; ++c) {
    if (lowest[c] == kNoPoint || highest[c] == kNoPoint) continue;
    const glm::dvec3 u = points[lowest[c]];
    const glm::dvec3 l = points[highest[c]];
    rig.lip_columns.push_back({0.5 * (u.x + l.x), lowest[c], highest[c], std::min(u.y - l.y, kLipGap)});
  }
  if (rig.lip_columns.size() < 2) {
    rig.lip_columns.clear();
    return;
  }
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const bool is_upper = upper[i] >= lower[i];
    const double weight = static_cast<double>(std::max(upper[i], lower[i]) - std::min(upper[i], lower[i]));
    const double x = points[i].x;
    if (weight <= 0.0 || x < rig.lip_columns.front().x || x > rig.lip_columns.back().x) continue;
    std::uint32_t c = 0;
    while (c + 2 < rig.lip_columns.size() && rig.lip_columns[c + 1].x <= x) ++c;
    const RigTables::LipColumn& a = rig.lip_columns[c];
    const RigTables::LipColumn& b = rig.lip_columns[c + 1];
    const double along = b.x > a.x ? (x - a.x) / (b.x - a.x) : 0.0;
    const double ya = points[is_upper ? a.upper : a.lower].y;
    const double yb = points[is_upper ? b.upper : b.lower].y;
    const double deep = std::abs(points[i].y - (ya + along * (yb - ya)));
    const double share = weight * smooth_fall(deep / kLipDepth);
    if (share > 0.0) rig.lip_points.push_back({i, c, along, is_upper ? share : -share});
  }
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
    if (failure) return failure;
    rig.axis_drives.push_back({index, channel.motion, channel.frame, static_cast<double>(channel.full_scale)});
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
  const SparseMatrix& t = face.skin.surface;
  rig.head_share.assign(t.rows, 1.0F);
  const auto it = face.regions.find(kNeckRegion);
  if (it == face.regions.end()) return;
  for (std::uint32_t row = 0; row < t.rows; ++row) {
    float sum = 0.0F;
    for (std::uint32_t k = t.row_begin[row]; k < t.row_begin[row + 1]; ++k) sum += t.value[k] * it->second[t.column[k]];
    rig.head_share[row] = std::clamp(sum, 0.0F, 1.0F);
  }
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
    if (drive.angle == 0.0 && drive.slide == glm::dvec3(0.0)) continue;
    moves[drive.muscle] = true;
    if (drive.frame == Frame::jaw && !rig.jaw_points.empty()) moves_skin[drive.muscle] = true;
  }
  for (const RigTables::PartDrive& drive : rig.part_drives) moves[drive.muscle] = true;
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
    if (drive.frame == program::Frame::eyes && drive.motion == Motion::rotate_x && lids) rig.skin[drive.channel] = true;
  }
}

tl::expected<Rig, Failure> bind(const Face& face, const Program& program) {
  RigParts parts{face, program, {}, {}, {}, {}, {}};
  if (auto failure = parts.check_face()) return tl::unexpected(std::move(*failure));
  parts.read_landmarks();
  if (auto failure = parts.read_muscles()) return tl::unexpected(std::move(*failure));
  if (auto failure = parts.make_lids()) return tl::unexpected(std::move(*failure));
  parts.make_lips();
  if (auto failure = parts.read_axes()) return tl::unexpected(std::move(*failure));
  parts.make_pivots();
  parts.make_head_share();
  parts.mark_actuated();
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

// ------------------------------------------------------------------------------------------------ posing

Pose make_pose(const Face& face, const Rig& rig) {
  Pose pose;
  pose.contractions.assign(rig.muscle_count(), 0.0F);
  pose.points = face.skin.points;
  pose.x.resize(face.skin.points.size());
  pose.positions.resize(face.skin.surface.rows);
  pose.normals.resize(face.skin.surface.rows);
  pose.lip_overlaps.resize(rig.tables().lip_columns.size());
  pose.parts.resize(face.rigid.size());
  pose.part_normals.resize(face.rigid.size());
  for (const RigTables::PartDrive& drive : rig.tables().part_drives) {
    pose.parts[drive.mesh] = face.rigid[drive.mesh].positions;
    pose.part_normals[drive.mesh] = face.rigid[drive.mesh].normals;
  }
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

void turn_lids(const Rig& rig, std::span<const float> values, std::span<const float> contractions,
               std::span<LidState, kEyeCount> out) {
  const RigTables& t = rig.tables();
  for (LidState& lid : out) lid = LidState{};
  for (const RigTables::LidDrive& drive : t.lid_drives) {
    LidState& lid = out[drive.eye];
    (drive.upper ? lid.upper : lid.lower) += drive.fraction * static_cast<double>(contractions[drive.muscle]);
  }
  for (const RigTables::AxisDrive& drive : t.axis_drives) {
    if (drive.frame != program::Frame::eyes || drive.motion != Motion::rotate_x) continue;
    const double down = drive.full_scale * static_cast<double>(values[drive.channel]);
    for (std::size_t eye = 0; eye < kEyeCount; ++eye) {
      const double shut = t.eyes[eye].closing_angle;
      if (shut <= 0.0) continue;
      out[eye].upper += (down > 0.0 ? kUpperLidFollowsDown : kUpperLidFollowsUp) * down / shut;
      out[eye].lower -= (down > 0.0 ? kLowerLidFollowsDown : kLowerLidFollowsUp) * down / shut;
    }
  }
  for (LidState& lid : out) {
    lid.lower = std::clamp(lid.lower, kLidWidest, kLidContact);
    lid.upper = std::clamp(lid.upper, kLidWidest, kLidContact - lid.lower);
  }
}

void move_frames(const Rig& rig, std::span<const float> values, std::span<const float> contractions, Pose& pose) {
  const RigTables& t = rig.tables();
  struct Turn {
    glm::dvec3 angles{0.0};
    glm::dvec3 shift{0.0};
  };
  std::array<Turn, kFrameCount> turns{};
  for (const RigTables::HingeDrive& drive : t.hinge_drives) {
    const double k = static_cast<double>(contractions[drive.muscle]);
    turns[index_of(drive.frame)].angles.x += k * drive.angle;
    turns[index_of(drive.frame)].shift += k * drive.slide;
  }
  for (const RigTables::AxisDrive& drive : t.axis_drives) {
    const double amount = drive.full_scale * static_cast<double>(values[drive.channel]);
    Turn& turn = turns[index_of(*moved_frame(drive.frame))];
    switch (drive.motion) {
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
  turns[index_of(Frame::eye_right)] = turns[index_of(Frame::eye_left)];  // the eyes turn together
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

// Where the lower lip stands above the upper one, each gives way by half.
static void part_lips(const Rig& rig, Pose& pose) {
  const RigTables& t = rig.tables();
  bool touch = false;
  for (std::size_t c = 0; c < t.lip_columns.size(); ++c) {
    const RigTables::LipColumn& column = t.lip_columns[c];
    const glm::dvec3 u = pose.points[column.upper];
    const glm::dvec3 l = pose.points[column.lower];
    const double overlap = column.gap - (u.y - l.y);
    pose.lip_overlaps[c] = overlap > 0.0 ? overlap * smooth_fall(std::abs(u.z - l.z) / kLipTouch) : 0.0;
    // Rounding is no overlap: rest must stay rest.
    if (pose.lip_overlaps[c] < 1e-9) pose.lip_overlaps[c] = 0.0;
    touch = touch || pose.lip_overlaps[c] > 0.0;
  }
  if (!touch) return;
  for (const RigTables::LipPoint& p : t.lip_points) {
    const double a = pose.lip_overlaps[p.column];
    const double b = pose.lip_overlaps[p.column + 1];
    pose.points[p.point].y += 0.5 * p.share * (a + p.along * (b - a));
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

  // The lid's edge is the lids' alone: other muscles move it as far as it does not belong to the lid, and nothing
  // presses it nearer to the eyeball's centre than it rests.
  for (std::size_t e = 0; e < kEyeCount; ++e) {
    const RigTables::Eye& eye = t.eyes[e];
    const LidState& lid = pose.lids[e];
    for (const RigTables::LidPoint& p : eye.points) {
      const glm::dvec3 at_rest = rest[p.point];
      const glm::dvec3 pull = pose.points[p.point] - at_rest;
      const bool turned = lid.upper != 0.0 || lid.lower != 0.0;
      if (!turned && pull == glm::dvec3(0.0)) continue;
      glm::dvec3 moved = at_rest + (1.0 - p.hold) * pull;
      const glm::dvec3 v = moved - eye.centre;
      const glm::dvec3 v_rest = at_rest - eye.centre;
      const double squared = dot(v, v);
      const double least = dot(v_rest, v_rest);
      if (squared < least && squared > 0.0) moved = eye.centre + std::sqrt(least / squared) * v;
      if (turned) {
        const double angle = lid.upper * p.upper_angle + lid.lower * p.lower_angle;
        moved = turn_about_x(moved, eye.centre, sine(angle), cosine(angle));
      }
      pose.points[p.point] = moved;
    }
  }

  const FrameMotion& jaw = pose.motions[index_of(Frame::jaw)];
  if (jaw.rotation != glm::dquat(1.0, 0.0, 0.0, 0.0) || jaw.translation != glm::dvec3(0.0)) {
    const Placement placement = about(t.pivots[index_of(Frame::jaw)], jaw);
    for (const RigTables::JawPoint& p : t.jaw_points) {
      glm::dvec3& point = pose.points[p.point];
      point += p.weight * (transform(placement, point) - point);
    }
  }
  part_lips(rig, pose);
}

void area_weighted_normals(std::span<const Primitive> primitives, std::span<const glm::vec3> positions,
                           std::span<glm::vec3> normals) {
  for (glm::vec3& n : normals) n = glm::vec3(0.0F);
  for (const Primitive& primitive : primitives) {
    for (std::size_t i = 0; i + 2 < primitive.triangles.size(); i += 3) {
      const std::uint32_t a = primitive.triangles[i];
      const std::uint32_t b = primitive.triangles[i + 1];
      const std::uint32_t c = primitive.triangles[i + 2];
      // Twice the triangle's area along its normal.
      const glm::vec3 n = glm::cross(positions[b] - positions[a], positions[c] - positions[a]);
      normals[a] += n;
      normals[b] += n;
      normals[c] += n;
    }
  }
  for (glm::vec3& n : normals) {
    const float squared = n.x * n.x + n.y * n.y + n.z * n.z;
    if (squared > 1e-30F) {
      const float length = std::sqrt(squared);
      n = glm::vec3(n.x / length, n.y / length, n.z / length);
    } else {
      n = glm::vec3(0.0F, 0.0F, 1.0F);  // no triangle here, or one without area
    }
  }
}

void bend_parts(const Face& face, const Rig& rig, Pose& pose) {
  const RigTables& t = rig.tables();
  for (std::size_t mesh = 0; mesh < pose.parts.size(); ++mesh) {
    std::vector<glm::vec3>& positions = pose.parts[mesh];
    if (positions.empty()) continue;
    const RigidMesh& rest = face.rigid[mesh];
    std::copy(rest.positions.begin(), rest.positions.end(), positions.begin());
    std::copy(rest.normals.begin(), rest.normals.end(), pose.part_normals[mesh].begin());
    bool bent = false;
    for (const RigTables::PartDrive& drive : t.part_drives) {
      const float k = pose.contractions[drive.muscle];
      if (drive.mesh != mesh || k == 0.0F) continue;
      for (std::size_t v = 0; v < positions.size(); ++v) positions[v] += k * drive.displacements[v];
      bent = true;
    }
    if (bent) area_weighted_normals(rest.primitives, positions, pose.part_normals[mesh]);
  }
}

void make_surface(const Face& face, Pose& pose) {
  for (std::size_t i = 0; i < pose.points.size(); ++i) pose.x[i] = glm::vec3(pose.points[i]);
  multiply(face.skin.surface, pose.x, pose.positions);
  for (std::size_t v = 0; v < pose.positions.size(); ++v) pose.positions[v] += face.skin.offsets[v];
  area_weighted_normals(face.skin.primitives, pose.positions, pose.normals);
}

void pose_face(const Face& face, const Rig& rig, std::span<const float> values, Pose& pose) {
  contractions(rig, values, pose.contractions);
  turn_lids(rig, values, pose.contractions, pose.lids);
  move_frames(rig, values, pose.contractions, pose);
  move_points(face, rig, pose);
  bend_parts(face, rig, pose);
  make_surface(face, pose);
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
