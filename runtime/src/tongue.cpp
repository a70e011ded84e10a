// A part that bends along its length: the tongue.
//
// Its spine runs from the rearmost vertex to the foremost, straight ahead but for what it rises and sinks at rest.
// Every muscle adds a turn, which grows from nothing to all of it over the last `reach` of the length, and a shift,
// whose share grows from the root's to the tip's whole. The spine is summed up from its directions, cross-sections
// stand across it, and what is stretched gets thinner, so that the volume stays. Where the tongue passes teeth and lips
// it goes through the middle of what room they leave, and gets as flat as that room asks for.
#include <algorithm>
#include <cmath>
#include <optional>

#include <glm/vec2.hpp>

#include <nms/runtime/trigonometry.h>

#include "rig_parts.h"

namespace nms::runtime {

using program::Muscle;
using program::Side;

namespace {

// Share of a shift that the root takes: it hangs on the floor of the mouth.
constexpr double kRootShift = 0.3;
// The tongue rises over the lower teeth while it is put out by so much.
constexpr double kLiftTo = 0.005;  // [m]
// Along the spine the rise goes from nothing this far behind the teeth's front to all of it, that far.
constexpr double kRiseFrom = 0.030;         // [m]
constexpr double kRiseTo = 0.009;           // [m]
constexpr double kToothThickness = 0.0085;  // [m]
constexpr double kBeforeUpper = 0.002;      // in front of it a row still counts [m]
constexpr double kBeforeLower = 0.004;      // [m]
constexpr double kBetween = 0.0015;         // how near to its front a place counts as between the teeth [m]
constexpr double kTongueRoom = 0.0005;      // to teeth and lips [m]
constexpr double kThinnest = 0.25;          // of its height at rest
constexpr double kOfWidth = 0.7;  // so much of its half width stays within the mouth's corners; its rim is thin
// No place further from the upper teeth's front than this, either way, is between teeth or lips: the jaw may be far
// down.
constexpr double kPassage = 0.05;  // [m]
// In front of the lips the tongue is as thick as ever within this length.
constexpr double kSwell = 0.006;  // [m]
// From this share of the lips' thickness on they let it go.
constexpr double kFreeFrom = 0.6;
// So near to the arch's axis, as a share of the arch's reach, a place counts as further behind.
constexpr double kNearAxis = 0.3;
// What teeth and lips leave open widens by so much of the distance from them.
constexpr double kWidening = 2.0;
// How far the lips' line counts in front of the teeth: to the front of the lips.
constexpr double kLipThickness = 0.016;  // [m]

glm::dvec3 direction(double pitch, double yaw) {
  const double c = cosine(pitch);
  return {sine(yaw) * c, -sine(pitch), cosine(yaw) * c};
}

}  // namespace

void RigParts::bend_part(std::uint32_t index, std::uint32_t mesh) {
  const Muscle& muscle = muscles[index];
  RigTables::PartDrive drive;
  drive.muscle = index;
  drive.mesh = mesh;
  const double angle = static_cast<double>(muscle.angle);
  (muscle.side == Side::none ? drive.pitch : drive.yaw) = muscle.side == Side::right ? -angle : angle;
  drive.slide = sided(muscle.slide, muscle.side);
  drive.reach = static_cast<double>(muscle.insertion_radius);
  const auto find = [&] {
    return std::find_if(rig.spines.begin(), rig.spines.end(),
                        [&](const RigTables::Spine& spine) { return spine.mesh == mesh; });
  };
  if (find() == rig.spines.end() && !make_spine(mesh)) return;
  // A tip that goes sideways bends the spine: the turn whose sum brings it there.
  const RigTables::Spine& spine = *find();
  const double reach = drive.reach > 0.0 ? std::min(drive.reach, spine.length) : spine.length;
  drive.yaw += drive.slide.x / (0.5 * reach);
  drive.slide.x = 0.0;
  rig.part_drives.push_back(drive);
}

bool RigParts::make_spine(std::uint32_t mesh) {
  RigTables::Spine spine;
  spine.mesh = mesh;
  const std::vector<glm::vec3>& rest = face.rigid[mesh].positions;
  if (rest.empty()) return false;
  double front = static_cast<double>(rest[0].z);
  spine.back_z = front;
  for (const glm::vec3& p : rest) {
    spine.back_z = std::min(spine.back_z, static_cast<double>(p.z));
    front = std::max(front, static_cast<double>(p.z));
  }
  spine.length = front - spine.back_z;
  if (spine.length <= 0.0) return false;
  // Halfway between the lowest and the highest vertex near each place.
  for (int k = 0; k <= kSpineSteps; ++k) {
    const double z = spine.back_z + spine.length * k / kSpineSteps;
    const double near = 1.01 * spine.length / kSpineSteps;
    double low = 1e9;
    double high = -1e9;
    const auto i = static_cast<std::size_t>(k);
    for (const glm::vec3& p : rest) {
      if (std::abs(static_cast<double>(p.z) - z) > near) continue;
      spine.wide[i] = std::max(spine.wide[i], std::abs(static_cast<double>(p.x)));
      low = std::min(low, static_cast<double>(p.y));
      high = std::max(high, static_cast<double>(p.y));
    }
    const bool found = low <= high;
    spine.height[i] = found ? 0.5 * (low + high) : k > 0 ? spine.height[i - 1] : static_cast<double>(rest[0].y);
    spine.half[i] = found ? 0.5 * (high - low) : 0.0;
  }
  rig.spines.push_back(spine);
  return true;
}

namespace {

// A place on the bent spine: where it is, which way it runs, how thick what stands across it still is.
struct SpinePlace {
  glm::dvec3 at{0.0};
  double pitch = 0.0;  // + down                    [rad]
  double yaw = 0.0;    // + to the left             [rad]
  double stretch = 1.0;
  double flat = 1.0;  // share of the height
};

using SpinePlaces = std::array<SpinePlace, kSpineSteps + 1>;

// Sum of the muscles' turns and shifts. Returns how far the tip is put out [m]; nothing where no muscle acts.
std::optional<double> bend_spine(const RigTables& t, const RigTables::Spine& spine, const Pose& pose,
                                 SpinePlaces& places) {
  bool bent = false;
  double forward = 0.0;
  glm::dvec3 shift(0.0);
  for (SpinePlace& p : places) p = SpinePlace{};
  for (const RigTables::PartDrive& drive : t.part_drives) {
    const double k = static_cast<double>(pose.contractions[drive.muscle]);
    if (drive.mesh != spine.mesh || k == 0.0) continue;
    bent = true;
    const double reach = drive.reach > 0.0 ? std::min(drive.reach / spine.length, 1.0) : 1.0;
    for (int i = 0; i <= kSpineSteps; ++i) {
      const double s = i / static_cast<double>(kSpineSteps);
      const double share = smooth_rise(1.0 - reach, 1.0, s);
      places[static_cast<std::size_t>(i)].pitch += k * share * drive.pitch;
      places[static_cast<std::size_t>(i)].yaw += k * share * drive.yaw;
    }
    forward += k * drive.slide.z;
    shift += k * glm::dvec3(drive.slide.x, drive.slide.y, 0.0);
  }
  if (!bent) return std::nullopt;
  const double step = spine.length / kSpineSteps;
  places[0].at = {0.0, spine.height[0], spine.back_z + kRootShift * forward};
  for (int i = 1; i <= kSpineSteps; ++i) {
    const auto n = static_cast<std::size_t>(i);
    const double s = (i - 0.5) / kSpineSteps;
    // The slope of the shift's share, which is smooth.
    const double slope = (1.0 - kRootShift) * 6.0 * s * (1.0 - s);
    places[n].stretch = std::max(1.0 + forward / spine.length * slope, 0.2);
    const double pitch = 0.5 * (places[n].pitch + places[n - 1].pitch);
    const double yaw = 0.5 * (places[n].yaw + places[n - 1].yaw);
    places[n].at = places[n - 1].at + step * places[n].stretch * direction(pitch, yaw);
    places[n].at.y += spine.height[n] - spine.height[n - 1];
  }
  places[0].stretch = places[1].stretch;
  for (int i = 0; i <= kSpineSteps; ++i) {
    const double share = smooth_rise(0.0, 1.0, i / static_cast<double>(kSpineSteps));
    places[static_cast<std::size_t>(i)].at += share * shift;
  }
  return forward;
}

// What teeth and lips leave open at a place, in the head.
struct Opening {
  double low = 0.0;   // y [m]
  double high = 0.0;  // y [m]
};

class Gate {
 public:
  Gate(const Rig& rig, const Pose& pose) : t_(rig.tables()), line_(pose.lip_line), jaw_(jaw_in_head(rig, pose)) {
    exists_ = t_.walls[0].exists && t_.walls[1].exists;
    scale_ = t_.scale;
    fill_outwards(line_.low);
    fill_outwards(line_.high);
    const auto corner = [&](const RigTables::LipColumn& column) {
      return 0.5 * (pose.points[column.upper].x + pose.points[column.lower].x);
    };
    if (t_.lip_columns.empty()) return;
    right_corner_ = corner(t_.lip_columns.front());
    left_corner_ = corner(t_.lip_columns.back());
  }

  [[nodiscard]] bool exists() const { return exists_; }
  [[nodiscard]] double scale() const { return scale_; }
  [[nodiscard]] glm::dvec3 to_head(glm::dvec3 p) const { return transform(jaw_, p); }
  [[nodiscard]] glm::dvec3 to_jaw(glm::dvec3 p) const { return glm::transpose(jaw_.rotation) * (p - jaw_.translation); }

  /// How far in front of the upper teeth's front, by the arch's own axis. [m]
  [[nodiscard]] double in_front(glm::dvec3 p) const { return in_front(t_.walls[0], p); }

  static double in_front(const TeethWall& wall, glm::dvec3 p) {
    // Near the arch's axis and behind it directions turn fast, and mean little: depth counts there.
    const double behind = std::min(p.z - wall.back_z - kNearAxis * wall.largest, 0.0);
    const double z = std::max(p.z - wall.back_z, 1e-6);
    return behind + std::sqrt(p.x * p.x + z * z) - wall.radius_at(p.x / (std::abs(p.x) + z), wall.edge_at(0.0));
  }

  /// Whether a place so far in front of a row may be between teeth or lips.
  [[nodiscard]] bool passes(double front) const { return front > -kPassage * scale_ && front < kPassage * scale_; }

  /// The lower teeth and lip have gone with the jaw: how far in front of them a place is, the jaw says. [m]
  [[nodiscard]] double in_front_of_lower(glm::dvec3 p) const { return in_front(t_.walls[1], to_jaw(p)); }

  /// At p in the head, as if it were so far in front. Before and behind teeth and lips the opening widens, and the
  /// lips' line is straight between its columns: what passes is led smoothly.
  [[nodiscard]] Opening at(glm::dvec3 p, double front, double front_low) const {
    const glm::dvec3 q = to_jaw(p);
    Opening open;
    open.high =
        t_.walls[0].edge_at(along(t_.walls[0], p)) + widening(front, -kToothThickness * scale_, kBeforeUpper * scale_);
    open.low = to_head({q.x, t_.walls[1].edge_at(along(t_.walls[1], q)), q.z}).y -
               widening(front_low, -kToothThickness * scale_, kBeforeLower * scale_);
    const double lip_low = between_columns(line_.low, p.x / line_.width);
    if (exists(lip_low)) open.high = std::min(open.high, lip_low + widening(front, 0.0, kLipThickness * scale_));
    const double lip_high = between_columns(line_.high, p.x / line_.width);
    if (exists(lip_high)) open.low = std::max(open.low, lip_high - widening(front_low, 0.0, kLipThickness * scale_));
    return open;
  }

  /// x, held between the corners of the mouth where it is between the lips. [m]
  /// @param half  of what stands there                                       [m]
  [[nodiscard]] double held_between_corners(double x, double half, double front) const {
    const double more = widening(front, 0.0, kLipThickness * scale_) - half;
    return std::clamp(x, std::min(right_corner_ - more, 0.0), std::max(left_corner_ + more, 0.0));
  }

 private:
  static double widening(double x, double from, double to) { return kWidening * std::max({from - x, x - to, 0.0}); }

  static bool exists(double y) { return y > -1.0 && y < 1.0; }

  /// Beyond the corners the lips' edges go on level.
  static void fill_outwards(std::array<double, 2 * LipLine::kSide>& edge) {
    for (std::size_t c = LipLine::kSide; c < edge.size(); ++c) {
      const std::size_t mirror = edge.size() - 1 - c;
      if (!exists(edge[c])) edge[c] = edge[c - 1];
      if (!exists(edge[mirror])) edge[mirror] = edge[mirror + 1];
    }
  }

  /// A lip's edge so many columns from the middle.
  static double between_columns(const std::array<double, 2 * LipLine::kSide>& edge, double widths) {
    const double column = std::clamp(widths + LipLine::kSide - 0.5, 0.0, 2.0 * LipLine::kSide - 1.0);
    const std::size_t c = std::min(static_cast<std::size_t>(column), edge.size() - 2);
    return edge[c] + (column - static_cast<double>(c)) * (edge[c + 1] - edge[c]);
  }

  static double along(const TeethWall& wall, glm::dvec3 p) {
    const double z = std::max(p.z - wall.back_z, 1e-6);
    return p.x / (std::abs(p.x) + z);
  }

  const RigTables& t_;
  LipLine line_;
  double right_corner_ = -1.0;  // x [m]
  double left_corner_ = 1.0;    // x [m]
  Placement jaw_;
  bool exists_ = false;
  double scale_ = 1.0;
};

// Leads the spine through the opening between teeth and lips, flattened to fit.
void lead_through(const RigTables::Spine& spine, const Gate& gate, double out, SpinePlaces& places) {
  const double scale = gate.scale();
  glm::dvec2 shift(0.0);
  for (int i = 0; i <= kSpineSteps; ++i) {
    SpinePlace& place = places[static_cast<std::size_t>(i)];
    const glm::dvec3 at = gate.to_head(place.at);
    const double front = gate.in_front(at);
    const double share = out * smooth_rise(-kRiseFrom * scale, -kRiseTo * scale, front);
    if (share == 0.0) continue;
    // The narrowest of the way: between the teeth, and where it is now.
    const double between = kBetween * scale;
    const double front_low = gate.in_front_of_lower(at);
    Opening open = gate.at(at, std::clamp(front, -between, between), std::clamp(front_low, -between, between));
    const Opening here = gate.at(at, front, front_low);
    open.low = std::max(open.low, here.low);
    open.high = std::min(open.high, here.high);
    const double room = 0.5 * (open.high - open.low) - kTongueRoom * scale;
    const double half = spine.half[static_cast<std::size_t>(i)];
    const double thin = half > 0.0 ? std::clamp(room / half, kThinnest, 1.0) : 1.0;
    const double taken = half * thin;
    const double middle = 0.5 * (open.low + open.high);
    const double lowest = open.low + kTongueRoom * scale + taken;
    const double highest = open.high - kTongueRoom * scale - taken;
    // It lies on the lower teeth and lip.
    const double y = lowest < highest ? lowest : middle;
    const double wide = kOfWidth * spine.wide[static_cast<std::size_t>(i)];
    const double x = gate.held_between_corners(at.x, wide + kTongueRoom * scale, front);
    const double beyond = smooth_rise(kFreeFrom * kLipThickness * scale, (kLipThickness + kSwell) * scale, front);
    // In front of the lips it goes on from where they let it out.
    const double still = smooth_rise(kFreeFrom * kLipThickness * scale, kLipThickness * scale, front);
    shift = (1.0 - still) * share * glm::dvec2(x - at.x, y - at.y) + still * shift;
    place.at = gate.to_jaw({at.x + shift.x, at.y + shift.y, at.z});
    place.flat = 1.0 + share * (1.0 - beyond) * (thin - 1.0);
  }
}

SpinePlace between(const SpinePlaces& places, double s) {
  const double step = std::clamp(s, 0.0, 1.0) * kSpineSteps;
  const int i = std::min(static_cast<int>(step), kSpineSteps - 1);
  const double u = step - i;
  const SpinePlace& a = places[static_cast<std::size_t>(i)];
  const SpinePlace& b = places[static_cast<std::size_t>(i + 1)];
  return {a.at + u * (b.at - a.at), a.pitch + u * (b.pitch - a.pitch), a.yaw + u * (b.yaw - a.yaw),
          a.stretch + u * (b.stretch - a.stretch), a.flat + u * (b.flat - a.flat)};
}

// What stands across the spine where a vertex is at rest.
struct CrossSection {
  double z = 0.0;       // at rest                    [m]
  double height = 0.0;  // y of its middle at rest    [m]
  glm::dvec3 at{0.0};
  glm::dvec3 across{0.0};
  glm::dvec3 up{0.0};
};

CrossSection cross_section(const RigTables::Spine& spine, const SpinePlaces& places, double z) {
  const double s = (z - spine.back_z) / spine.length;
  const SpinePlace place = between(places, s);
  const double step = std::clamp(s, 0.0, 1.0) * kSpineSteps;
  const int i = std::min(static_cast<int>(step), kSpineSteps - 1);
  const double a = spine.height[static_cast<std::size_t>(i)];
  const double height = a + (step - i) * (spine.height[static_cast<std::size_t>(i + 1)] - a);
  const double thin = 1.0 / std::sqrt(std::max(place.stretch, 0.25));
  const double sp = sine(place.pitch), cp = cosine(place.pitch);
  const double sy = sine(place.yaw), cy = cosine(place.yaw);
  return {z, height, place.at, thin * glm::dvec3(cy, 0.0, -sy), thin * place.flat * glm::dvec3(sy * sp, cp, cy * sp)};
}

}  // namespace

void bend_parts(const Face& face, const Rig& rig, Pose& pose) {
  const RigTables& t = rig.tables();
  for (const RigTables::Spine& spine : t.spines) {
    std::vector<glm::vec3>& positions = pose.parts[spine.mesh];
    const RigidMesh& rest = face.rigid[spine.mesh];
    SpinePlaces places;
    const std::optional<double> forward = bend_spine(t, spine, pose, places);
    if (!forward) {
      std::copy(rest.positions.begin(), rest.positions.end(), positions.begin());
      std::copy(rest.normals.begin(), rest.normals.end(), pose.part_normals[spine.mesh].begin());
      continue;
    }
    const Gate gate(rig, pose);
    const double out = gate.exists() ? smooth_rise(0.0, kLiftTo * t.scale, *forward) : 0.0;
    if (out > 0.0) lead_through(spine, gate, out, places);
    CrossSection section;
    for (std::size_t v = 0; v < positions.size(); ++v) {
      const glm::dvec3 p(rest.positions[v]);
      // Vertices come ring by ring.
      if (v == 0 || p.z != section.z) section = cross_section(spine, places, p.z);
      glm::dvec3 q = section.at + p.x * section.across + (p.y - section.height) * section.up;
      // A cross-section is wider than its spine: off the middle there may be less room.
      if (out > 0.0) {
        glm::dvec3 in_head = gate.to_head(q);
        const double front = gate.in_front(in_head);
        const double front_low = gate.in_front_of_lower(in_head);
        if (gate.passes(front) || gate.passes(front_low)) {
          const double x = gate.held_between_corners(in_head.x, 0.5 * kTongueRoom * t.scale, front);
          in_head.x += out * (x - in_head.x);
          const Opening open = gate.at(in_head, front, front_low);
          const double low = open.low + 0.5 * kTongueRoom * t.scale;
          const double high = open.high - 0.5 * kTongueRoom * t.scale;
          const double y = low < high ? std::clamp(in_head.y, low, high) : 0.5 * (low + high);
          in_head.y += out * (y - in_head.y);
          q = gate.to_jaw(in_head);
        }
      }
      positions[v] = glm::vec3(q);
    }
    area_weighted_normals(rest.primitives, positions, pose.part_normals[spine.mesh]);
  }
}

}  // namespace nms::runtime
