#include "face_regions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>

#include <nms/runtime/muscle.h>

#include "surface_graph.h"

namespace nms::runtime {

namespace {

// All lengths are the reference face's, and scale with a face.

// Upper turns to lower lip or lid over this distance to either side of the corner.
constexpr double kLipCorner = 0.0035;  // [m]
constexpr double kLidCorner = 0.0009;  // [m]
// The same away from the corner, as a share of the distance: beyond the eye skin is hardly either's.
constexpr double kLidCornerWidens = 0.35;
// Beyond the border of the lips' red, skin follows less and less to nothing; as the jaw opens, below the lower lip as
// far as the chin's boss, or the lip would roll over it.
constexpr double kPerioral = 0.010;       // [m]
constexpr double kPerioralOfJaw = 0.020;  // [m]
// Inside it all follows as far as the lips are thick, then less and less.
constexpr double kLipInside = 0.016;   // [m]
constexpr double kLipDeepest = 0.032;  // [m]
// Where the lips' red ends and the lining begins.
constexpr double kLiningFrom = 0.010;  // [m]
constexpr double kLiningAll = 0.016;   // [m]
// The jaw's share of the upper lip's, of the lower lip's middle.
constexpr double kJawOfUpperLip = 0.03;
constexpr double kJawOfLowerLip = 0.85;
// Skin slides over the chin: it takes so much of the bone's turn.
constexpr double kJawOfSkin = 0.90;
// Deeper than the lips, the mouth's floor goes with the lower teeth and its roof with the upper ones; between them, in
// the cheeks, one turns to the other within so much to either side of where the teeth meet.
constexpr double kBetweenRows = 0.012;  // [m]
// A lid goes whole as far as the first of these shares of the way to brow or cheek, and not at all from the second.
constexpr double kLidWhole = 0.16;
constexpr double kLidLeast = 0.75;
// Of a lid's skin, its edge aside: below what counts as edge (rig_parts.h).
constexpr double kLidSkin = 0.985;
// On the bridge of the nose lids end: they have nothing at the first of these distances from the midline.
constexpr double kBridgeLeast = 0.002;  // [m]
constexpr double kBridgeAll = 0.012;    // [m]
// Behind the lids.
constexpr double kLidBackWhole = 0.004;  // [m]
constexpr double kLidBackLeast = 0.014;  // [m]
// How far lids' and lips' borders may be from their landmarks; paths and distances are not looked for beyond.
constexpr double kMouthReach = 0.090;  // [m]
constexpr double kEyeReach = 0.060;    // [m]

using Weights = std::vector<double>;

class RegionMaker {
 public:
  RegionMaker(Face& face, const Landmarks& landmarks)
      : face_(face),
        landmarks_(landmarks),
        scale_(face_scale(landmarks)),
        places_(places(face)),
        triangles_(triangles(face)),
        graph_(places_, triangles_) {}

  void run() {
    jaw_ = jaw_shares();
    mouth();
    eye("L", "_left");
    eye("R", "_right");
    if (jaw_) put("jaw", *jaw_);
    neck();
  }

 private:
  static std::vector<glm::dvec3> places(const Face& face) {
    const SparseMatrix& t = face.skin.surface;
    std::vector<glm::dvec3> result(t.rows);
    for (std::uint32_t v = 0; v < t.rows; ++v) {
      glm::dvec3 p(face.skin.offsets[v]);
      for (std::uint32_t k = t.row_begin[v]; k < t.row_begin[v + 1]; ++k)
        p += static_cast<double>(t.value[k]) * face.skin.points[t.column[k]];
      result[v] = p;
    }
    return result;
  }

  static std::vector<std::array<std::uint32_t, 3>> triangles(const Face& face) {
    std::vector<std::array<std::uint32_t, 3>> result;
    for (const Primitive& primitive : face.skin.primitives)
      for (std::size_t i = 0; i + 2 < primitive.triangles.size(); i += 3)
        result.push_back({primitive.triangles[i], primitive.triangles[i + 1], primitive.triangles[i + 2]});
    return result;
  }

  const glm::dvec3* place(std::string_view name) const {
    const auto at = landmarks_.find(name);
    return at == landmarks_.end() ? nullptr : &at->second;
  }

  double length(double reference) const { return reference * scale_.length; }

  std::optional<std::uint32_t> vertex(const std::string& name) const {
    const glm::dvec3* p = place(name);
    if (p == nullptr) return std::nullopt;
    const std::uint32_t v = graph_.nearest(*p);
    return v < graph_.size() ? std::optional(v) : std::nullopt;
  }

  /// A line of vertices along the skin over these landmarks; those in the middle may be missing. Empty: the first or
  /// last is, or no way leads there.
  std::vector<std::uint32_t> line(const std::vector<std::string>& names, double reach) const {
    std::vector<std::uint32_t> result;
    const auto first = vertex(names.front());
    if (!first || !vertex(names.back())) return {};
    result.push_back(*first);
    for (std::size_t i = 1; i < names.size(); ++i) {
      const auto next = vertex(names[i]);
      if (!next || *next == result.back()) continue;
      const auto way = graph_.path(result.back(), *next, length(reach));
      if (way.empty()) return {};
      result.insert(result.end(), way.begin() + 1, way.end());
    }
    return result;
  }

  /// By vertex: whether the line between lips or lids keeps it from the rest of the face.
  std::vector<bool> inside(const std::vector<std::uint32_t>& upper, const std::vector<std::uint32_t>& lower) const {
    std::vector<std::uint32_t> wall = upper;
    wall.insert(wall.end(), lower.begin(), lower.end());
    std::vector<bool> result(graph_.size(), false);
    auto start = vertex("nose_tip");
    if (!start) start = vertex("glabella");
    if (!start) return result;
    const std::vector<bool> outside = graph_.reached(*start, wall);
    for (std::size_t v = 0; v < result.size(); ++v) result[v] = !outside[v];
    for (const std::uint32_t w : wall) result[w] = false;
    return result;
  }

  /// Vertices' weights to the points that make them.
  void put(const std::string& name, const Weights& weights) {
    if (face_.regions.contains(name)) return;
    const SparseMatrix& t = face_.skin.surface;
    Weights sum(face_.skin.points.size(), 0.0);
    Weights share(face_.skin.points.size(), 0.0);
    for (std::uint32_t v = 0; v < t.rows; ++v) {
      for (std::uint32_t k = t.row_begin[v]; k < t.row_begin[v + 1]; ++k) {
        const double a = std::abs(static_cast<double>(t.value[k]));
        sum[t.column[k]] += a * weights[v];
        share[t.column[k]] += a;
      }
    }
    std::vector<float>& region = face_.regions[name];
    region.resize(sum.size());
    for (std::size_t i = 0; i < sum.size(); ++i)
      region[i] = share[i] > 0.0 ? static_cast<float>(std::clamp(sum[i] / share[i], 0.0, 1.0)) : 0.0F;
  }

  // Skin goes with the jaw below the line from its hinge to the mouth's opening, the more the further below, and the
  // less the nearer to the hinge; the neck stays.
  std::optional<Weights> jaw_shares() {
    const glm::dvec3* hinge = place("jaw_hinge_L");
    const glm::dvec3* stomion = place("stomion");
    const glm::dvec3* menton = place("menton");
    if (hinge == nullptr || stomion == nullptr || menton == nullptr) return std::nullopt;
    const double mouth_y = stomion->y - hinge->y;
    const double mouth_z = stomion->z - hinge->z;
    const double reach = std::sqrt(mouth_y * mouth_y + mouth_z * mouth_z);
    if (!(reach > 0.0)) return std::nullopt;
    Weights result(places_.size());
    along_jaw_.resize(places_.size());
    below_bite_.resize(places_.size());
    for (std::size_t v = 0; v < places_.size(); ++v) {
      const glm::dvec3& p = places_[v];
      const double y = p.y - hinge->y;
      const double z = p.z - hinge->z;
      const double below = -(y * mouth_z - z * mouth_y) / reach;
      const double along = (y * mouth_y + z * mouth_z) / reach;
      along_jaw_[v] = smooth_rise(length(0.002), length(0.042), along);
      below_bite_[v] = smooth_rise(-length(kBetweenRows), length(kBetweenRows), below);
      result[v] = smooth_rise(length(-0.006), length(0.034) + 0.1 * std::abs(p.x), below) * along_jaw_[v] *
                  smooth_rise(menton->y - length(0.057), menton->y - length(0.010), p.y) * kJawOfSkin;
    }
    return result;
  }

  void mouth() {
    const auto upper =
        line({"mouth_corner_L", "lip_upper_lateral_L", "lip_upper_mid", "lip_upper_lateral_R", "mouth_corner_R"},
             kMouthReach);
    const auto lower =
        line({"mouth_corner_L", "lip_lower_lateral_L", "lip_lower_mid", "lip_lower_lateral_R", "mouth_corner_R"},
             kMouthReach);
    if (upper.size() < 3 || lower.size() < 3 || !vertex("lip_upper_mid") || !vertex("lip_lower_mid")) return;
    const std::vector<double> to_upper = graph_.distances(upper, length(kMouthReach));
    const std::vector<double> to_lower = graph_.distances(lower, length(kMouthReach));
    const std::vector<bool> within = inside(upper, lower);
    const double corner = std::max(std::abs(place("mouth_corner_L")->x), std::abs(place("mouth_corner_R")->x));
    if (!(corner > 0.0)) return;
    const glm::dvec3* middle = place("stomion");
    const double middle_y =
        middle != nullptr ? middle->y : 0.5 * (place("lip_upper_mid")->y + place("lip_lower_mid")->y);
    const double corner_y = 0.5 * (place("mouth_corner_L")->y + place("mouth_corner_R")->y);

    Weights lip_upper(places_.size(), 0.0), lip_lower(places_.size(), 0.0), lining(places_.size(), 0.0),
        red(places_.size(), 0.0);
    for (std::size_t v = 0; v < places_.size(); ++v) {
      const double near = std::min(to_upper[v], to_lower[v]);
      if (within[v] || near == 0.0) red[v] = 1.0;
      if (near == SurfaceGraph::kFar) {
        if (within[v]) lining[v] = 1.0;
        if (within[v] && jaw_) (*jaw_)[v] = jaw_of_inside(v);
        continue;
      }
      double towards_lower =
          to_upper[v] == to_lower[v] ? 0.0 : std::clamp(to_upper[v] - to_lower[v], -length(1.0), length(1.0));
      // Behind the lips both are reached over the corner, and the ways there say little: the height does.
      if (within[v]) {
        const double s = std::min(std::abs(places_[v].x) / corner, 1.0);
        towards_lower += middle_y + s * s * (corner_y - middle_y) - places_[v].y;
      }
      const double lower_share = smooth_rise(-length(kLipCorner), length(kLipCorner), towards_lower);
      const double keep = within[v] ? smooth_fall((near - length(kLipInside)) / length(kLipDeepest - kLipInside))
                                    : smooth_fall(near / length(kPerioral));
      lip_upper[v] = (1.0 - lower_share) * keep;
      lip_lower[v] = lower_share * keep;
      if (within[v]) lining[v] = smooth_rise(length(kLiningFrom), length(kLiningAll), near);
      if (!jaw_) continue;
      // Along the mouth, so that a lip opens whole, from its red to its lining.
      const double along = std::max(1.0 - std::abs(places_[v].x) / corner, 0.0);
      const double opened = 0.5 + (lower_share - 0.5) * lip_opening(along);
      double jaw = kJawOfUpperLip + (kJawOfLowerLip - kJawOfUpperLip) * opened;
      if (within[v]) jaw += (jaw_of_inside(v) - jaw) * smooth_rise(length(kLipInside), length(kLipDeepest), near);
      double& share = (*jaw_)[v];
      const double reach = length(kPerioral + lower_share * (kPerioralOfJaw - kPerioral));
      share += (jaw - share) * (within[v] ? 1.0 : smooth_fall(near / reach));
    }
    put("lip_upper", lip_upper);
    put("lip_lower", lip_lower);
    put("lining", lining);
    put("vermilion", red);
    raised(lip_lower);
  }

  // Where lips lie the one on the other, ways along the skin tell them apart; in the mouth's depth both are as far.
  double jaw_of_inside(std::size_t v) const { return below_bite_[v] * along_jaw_[v]; }

  // What the levators of the upper lip may move: nearly nothing of the nose, less of the groove below it.
  void raised(const Weights& lip_lower) {
    const glm::dvec3* tip = place("nose_tip");
    if (tip == nullptr) return;
    Weights result(places_.size());
    for (std::size_t v = 0; v < places_.size(); ++v) {
      const glm::dvec3 p = (places_[v] - *tip) / scale_.axes;
      const glm::dvec3 q(places_[v].x / scale_.axes.x / 0.019, (p.y - 0.004) / 0.019, (p.z + 0.0088) / 0.022);
      const double nose = 1.0 - smooth_rise(0.7, 1.25, std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z));
      const double side = places_[v].x / scale_.axes.x / 0.007;
      const double groove = side * side < 4.0 ? square(1.0 - 0.25 * side * side) : 0.0;
      result[v] = (1.0 - 0.85 * nose) * (1.0 - 0.3 * groove) * (1.0 - lip_lower[v]);
    }
    put("raised", result);
  }

  static double square(double x) { return x * x; }

  void eye(const std::string& side, const std::string& suffix) {
    const std::string s = "_" + side;
    const auto upper = line({"eye_inner" + s, "lid_upper_mid" + s, "eye_outer" + s}, kEyeReach);
    const auto lower = line({"eye_inner" + s, "lid_lower_mid" + s, "eye_outer" + s}, kEyeReach);
    const glm::dvec3* top = place("lid_upper_mid" + s);
    const glm::dvec3* bottom = place("lid_lower_mid" + s);
    if (upper.size() < 3 || lower.size() < 3 || top == nullptr || bottom == nullptr) return;
    const glm::dvec3* brow = place("brow_mid" + s);
    const glm::dvec3* cheek = place("infraorbital" + s);
    const double above = brow != nullptr ? glm::distance(*top, *brow) : length(0.0251);
    const double below = cheek != nullptr ? glm::distance(*bottom, *cheek) : length(0.0123);
    const std::vector<double> to_upper = graph_.distances(upper, length(kEyeReach));
    const std::vector<double> to_lower = graph_.distances(lower, length(kEyeReach));
    const std::vector<bool> within = inside(upper, lower);
    Weights lid_upper(places_.size(), 0.0), lid_lower(places_.size(), 0.0);
    for (std::size_t v = 0; v < places_.size(); ++v) {
      const double near = std::min(to_upper[v], to_lower[v]);
      if (near == SurfaceGraph::kFar) continue;
      const double towards_lower =
          to_upper[v] == to_lower[v] ? 0.0 : std::clamp(to_upper[v] - to_lower[v], -length(1.0), length(1.0));
      const double corner = length(kLidCorner) + kLidCornerWidens * near;
      const double lower_share = smooth_rise(-corner, corner, towards_lower);
      const double back = smooth_fall((near - length(kLidBackWhole)) / length(kLidBackLeast - kLidBackWhole));
      const auto front = [&](double way) {
        return smooth_fall((near - kLidWhole * way) / ((kLidLeast - kLidWhole) * way));
      };
      // No skin is two eyes'.
      const double own =
          smooth_rise(length(kBridgeLeast), length(kBridgeAll), side == "L" ? places_[v].x : -places_[v].x);
      // Only the edge's own vertices count whole: where one lid meets the other is told by them.
      const double whole = near > 0.0 ? kLidSkin : 1.0;
      lid_upper[v] = whole * own * (1.0 - lower_share) * (within[v] ? back : front(above));
      lid_lower[v] = whole * own * lower_share * (within[v] ? back : front(below));
    }
    put("lid_upper" + suffix, lid_upper);
    put("lid_lower" + suffix, lid_lower);
  }

  // 1 on the head, 0 on the torso; the line between them rises from the throat to the nape.
  void neck() {
    const glm::dvec3* menton = place("menton");
    const glm::dvec3* hinge = place("jaw_hinge_L");
    if (menton == nullptr || hinge == nullptr) return;
    Weights result(places_.size());
    for (std::size_t v = 0; v < places_.size(); ++v) {
      const double y = (places_[v].y - menton->y) / scale_.axes.y;
      const double slope = 0.35 * ((places_[v].z - hinge->z) / scale_.axes.z + 0.0182);
      result[v] = smooth_rise(-0.072 + 0.2 * slope, 0.012 - 0.45 * slope, y);
    }
    put("neck", result);
  }

  Face& face_;
  const Landmarks& landmarks_;
  FaceScale scale_;
  std::vector<glm::dvec3> places_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;
  SurfaceGraph graph_;
  std::optional<Weights> jaw_;
  Weights along_jaw_;   // how far in front of the jaw's hinge, by vertex [0, 1]
  Weights below_bite_;  // how far below the line from the jaw's hinge to the mouth [0, 1]
};

}  // namespace

void add_regions(Face& face, const Landmarks& landmarks) { RegionMaker(face, landmarks).run(); }

}  // namespace nms::runtime
