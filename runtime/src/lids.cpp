#include <algorithm>
#include <cmath>
#include <string>

#include <fmt/format.h>

#include <nms/runtime/trigonometry.h>

#include "rig_parts.h"

namespace nms::runtime {

using program::Failure;
using program::Motion;
using program::Muscle;
using program::Side;

namespace {

// How far the lids follow the eyeball, as shares of its turn; fitted by eye to the openings measured on the reference
// face: 118 % looking up, 43 % looking down.
constexpr double kUpperLidFollowsDown = 0.85;
constexpr double kUpperLidFollowsUp = 0.36;
constexpr double kLowerLidFollowsDown = 0.30;
constexpr double kLowerLidFollowsUp = 0.15;
// How much of the eyeball's sideways turn the skin of the lids takes along, and how much of that they rise by; the
// reference face's lids move 2.5 mm at 35 degrees, most at the outer corner.
constexpr double kLidsFollowSideways = 0.19;
constexpr double kLidsRiseSideways = 0.10;
constexpr double kInnerCornerFollows = 0.30;
// The upper lid comes to rest this much past the lower lid's edge, so that no light shows between two polylines.
constexpr double kLidContact = 1.02;
// No lid goes further open than this.
constexpr double kLidWidest = -0.8;
// The corners of the eye lie about this far from its centre in x.
constexpr double kCornerDistance = 0.013;  // [m]
// Skin that is held by this share keeps its whole distance from the eyeball's centre.
constexpr double kKeptOff = 0.10;
// How far along the lid a point looks for the widest opening.
constexpr double kCornerReach = 0.00045;  // [m]
// Away from its edge a lid turns as what lies to either side within this share of the distance, on average: a shut lid
// has no step beside the corners of the eye. Nearer than the first of these distances it is its edge's; from the second
// on the share is whole.
constexpr double kSpread = 0.8;
constexpr double kEdge = 0.0015;  // [m]
constexpr double kFold = 0.0050;  // [m]
constexpr int kSpreadSteps = 6;

/// Along the eyeball. [m]
double distance_from(const LidMargin& edge, const glm::dvec3& p, const glm::dvec3& centre) {
  const glm::dvec3 from = p - centre;
  const double radius = std::sqrt(from.y * from.y + from.z * from.z);
  return radius * std::abs(elevation(p, centre) - edge.elevation_at(p.x));
}

template <typename Angle>
double spread(Angle angle, double x, double half) {
  if (half <= 0.0) return angle(x);
  double sum = 0.0;
  double whole = 0.0;
  for (int k = -kSpreadSteps; k <= kSpreadSteps; ++k) {
    const double share = 1.0 - std::abs(k) / (kSpreadSteps + 1.0);
    sum += share * angle(x + half * k / kSpreadSteps);
    whole += share;
  }
  return sum / whole;
}

}  // namespace

std::optional<Failure> RigParts::read_eyelid(std::uint32_t index, const glm::dvec3& centre, const glm::dvec3& margin) {
  const Muscle& muscle = muscles[index];
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

std::optional<Failure> RigParts::make_eye_lids(std::size_t index) {
  const std::vector<glm::dvec3>& points = face.skin.points;
  const double reach = kCornerReach * rig.scale;
  const double corner = kCornerDistance * rig.scale;
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
  // The corner of the eye is both lids'. Of polygons it is one vertex, whose long edges would cut the eyeball if it
  // went all the way.
  const bool spline = face.skin.surface.column.size() > face.skin.surface.rows;
  eye.closing_angle = closing_angle(upper_edge, lower_edge, margin_x[index]);
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    if (upper[i] <= 0.0F && lower[i] <= 0.0F) continue;
    // A spline lags behind its control points where they turn less and less, towards the corners of the eye.
    const double x = points[i].x;
    const auto closing = [&](double at) {
      return std::max({closing_angle(upper_edge, lower_edge, at - reach), closing_angle(upper_edge, lower_edge, at),
                       closing_angle(upper_edge, lower_edge, at + reach)});
    };
    const LidMargin& nearer = upper[i] >= lower[i] ? upper_edge : lower_edge;
    const double from_edge = distance_from(nearer, points[i], eye.centre);
    const double angle =
        spread(closing, x, kSpread * smooth_rise(kEdge * rig.scale, kFold * rig.scale, from_edge) * from_edge);
    // No slope at the lid's outer border, or the skin that is held creases against the skin that is pulled.
    const double most = static_cast<double>(std::max(upper[i], lower[i]));
    const double share = spline ? std::min(1.0, static_cast<double>(upper[i]) + static_cast<double>(lower[i])) : most;
    const double hold = 1.0 - smooth_fall(share);
    const double outwards = std::abs(x) - std::abs(eye.centre.x);
    const double drawn = share * (1.0 - (1.0 - kInnerCornerFollows) * smooth_fall((outwards + corner) / (2 * corner)));
    eye.points.push_back(
        {i, angle * static_cast<double>(upper[i]), -angle * static_cast<double>(lower[i]), hold, drawn});
  }
  return std::nullopt;
}

std::optional<Failure> RigParts::make_lids() {
  for (std::size_t index = 0; index < kEyeCount; ++index) {
    if (!has_eye[index]) continue;
    auto failure = make_eye_lids(index);
    if (!failure) continue;
    for (const auto& [muscle, eye] : eyelids)
      if (eye == index && !may_lack(*failure, {muscle, program::kNone, true, index == 0 ? "lids_L" : "lids_R"}))
        return failure;
  }
  for (const auto& [index, eye] : eyelids) {
    const Muscle& muscle = muscles[index];
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

void turn_lids(const Rig& rig, std::span<const float> values, std::span<const float> contractions,
               std::span<LidState, kEyeCount> out) {
  const RigTables& t = rig.tables();
  for (LidState& lid : out) lid = LidState{};
  for (const RigTables::LidDrive& drive : t.lid_drives) {
    LidState& lid = out[drive.eye];
    (drive.upper ? lid.upper : lid.lower) += drive.fraction * static_cast<double>(contractions[drive.muscle]);
  }
  std::array<double, kEyeCount> shut_by_muscles{};
  for (std::size_t eye = 0; eye < kEyeCount; ++eye)
    shut_by_muscles[eye] = std::clamp(out[eye].upper + out[eye].lower, 0.0, 1.0);
  for (const RigTables::AxisDrive& drive : t.axis_drives) {
    if (drive.frame == program::Frame::eyes && drive.motion == Motion::rotate_y) {
      const double turn = drive.full_scale * static_cast<double>(values[drive.channel]);
      for (LidState& lid : out) lid.sideways += kLidsFollowSideways * turn;
    }
    if (drive.frame != program::Frame::eyes || drive.motion != Motion::rotate_x) continue;
    const double down = drive.full_scale * static_cast<double>(values[drive.channel]);
    for (std::size_t eye = 0; eye < kEyeCount; ++eye) {
      const double shut = t.eyes[eye].closing_angle;
      if (shut <= 0.0) continue;
      const double upper = (down > 0.0 ? kUpperLidFollowsDown : kUpperLidFollowsUp) * down / shut;
      const double lower = (down > 0.0 ? kLowerLidFollowsDown : kLowerLidFollowsUp) * -down / shut;
      // Where the lids meet goes along with the eye, but no gaze opens what muscles hold shut.
      const double opened = std::max(-(upper + lower), 0.0);
      out[eye].upper += upper + shut_by_muscles[eye] * opened;
      out[eye].lower += lower;
    }
  }
  for (const RigTables::HingeDrive& drive : t.hinge_drives) {
    if (drive.frame != Frame::eye_left && drive.frame != Frame::eye_right) continue;
    LidState& lid = out[drive.frame == Frame::eye_left ? 0 : 1];
    lid.sideways += kLidsFollowSideways * drive.yaw * static_cast<double>(contractions[drive.muscle]);
  }
  for (LidState& lid : out) {
    lid.lower = std::clamp(lid.lower, kLidWidest, kLidContact);
    lid.upper = std::clamp(lid.upper, kLidWidest, kLidContact - lid.lower);
  }
}

void move_lids(const Face& face, const Rig& rig, Pose& pose) {
  const RigTables& t = rig.tables();
  const std::vector<glm::dvec3>& rest = face.skin.points;
  // The lid's edge is the lids' alone: other muscles move it as far as it does not belong to the lid, and nothing
  // presses it nearer to the eyeball's centre than it rests.
  for (std::size_t e = 0; e < kEyeCount; ++e) {
    const RigTables::Eye& eye = t.eyes[e];
    const LidState& lid = pose.lids[e];
    for (const RigTables::LidPoint& p : eye.points) {
      const glm::dvec3 at_rest = rest[p.point];
      const glm::dvec3 pull = pose.points[p.point] - at_rest;
      const bool turned = lid.upper != 0.0 || lid.lower != 0.0 || lid.sideways != 0.0;
      if (!turned && pull == glm::dvec3(0.0)) continue;
      glm::dvec3 moved = at_rest + (1.0 - p.hold) * pull;
      const glm::dvec3 v = moved - eye.centre;
      const glm::dvec3 v_rest = at_rest - eye.centre;
      const double squared = dot(v, v);
      const double least = dot(v_rest, v_rest);
      // From the lid's border on little by little, or skin just outside it would part from skin just inside.
      if (squared < least && squared > 0.0) {
        const double kept = smooth_rise(0.0, kKeptOff, p.hold);
        moved = eye.centre + (1.0 + kept * (std::sqrt(least / squared) - 1.0)) * v;
      }
      if (turned) {
        const double side = p.drawn * lid.sideways;
        const double angle = lid.upper * p.upper_angle + lid.lower * p.lower_angle -
                             kLidsRiseSideways * std::abs(side) / kLidsFollowSideways;
        moved = turn_about_x(moved, eye.centre, sine(angle), cosine(angle));
        if (side != 0.0) moved = turn_about_y(moved, eye.centre, sine(side), cosine(side));
      }
      pose.points[p.point] = moved;
    }
  }
}

}  // namespace nms::runtime
