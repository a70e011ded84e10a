#include "regions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include <nms/runtime/muscle.h>

#include "lids.h"

namespace nms::fit_face {

struct Regions::Weights {
  double lip_upper = 0, lip_lower = 0, lining = 0, lid_upper = 0, lid_lower = 0, jaw = 0, neck = 0, nostril = 0,
         ear = 0, raised = 0;
};

namespace {

template <std::size_t N>
bool is_one_of(const std::string& name, const std::array<const char*, N>& names) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

// The lips' curves run from the upper midline at 0 to the lower one at this.
constexpr double kLipSpans = 32;
// Upper turns to lower lip over this many spans to either side of the corner.
constexpr double kCornerSpans = 2.5;
// The jaw's share of the upper and of the lower lip, in their middles: the upper one is drawn along a little.
constexpr double kJawOfUpperLip = .03;
constexpr double kJawOfLowerLip = .85;
// Skin slides over the chin: it takes so much of the bone's turn (42 of 49 mm at the widest, on the reference face).
constexpr double kJawOfSkin = .90;

// The jaw turns about its hinge (y -5.5, z 18.2). Skin moves with it below the line from the hinge to the mouth's
// opening, the more the further below, and the less the nearer to the hinge; the neck stays. [mm]
double jaw_share(const glm::dvec3& p) {
  const double y = p.y + 5.5;
  const double z = p.z - 18.2;
  const double mouth_y = -33.6 + 5.5;
  const double mouth_z = 112.7 - 18.2;
  const double length = std::sqrt(mouth_y * mouth_y + mouth_z * mouth_z);
  const double below = -(y * mouth_z - z * mouth_y) / length;
  const double along = (y * mouth_y + z * mouth_z) / length;
  return smooth_step(-6, 34 + .1 * std::abs(p.x), below) * smooth_step(2, 42, along) * smooth_step(-135, -88, p.y) *
         kJawOfSkin;
}

// What the levators of the upper lip may move: nearly nothing of the nose, less of the groove below it. [mm]
double raised_share(const glm::dvec3& p) {
  const glm::dvec3 q((p.x) / 19, (p.y - 6) / 19, (p.z - 122) / 22);
  const double nose = 1 - smooth_step(.7, 1.25, std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z));
  const double groove = std::exp(-std::pow(p.x / 7, 2));
  return (1 - .85 * nose) * (1 - .3 * groove);
}

// 1 on the head, 0 on the torso; the line between them rises from the throat to the nape. [mm]
double neck_share(const glm::dvec3& p) {
  const double slope = p.z * .35;
  return smooth_step(-150 + slope * .2, -66 - slope * .45, p.y);
}

}  // namespace

Regions::Regions(const Model& model) : model_(model), mouth_corner_(fit_face::mouth_corner(model)) {}

void Regions::around_mouth(const std::string& name, const runtime::NetSurface* surface, double u, double v,
                           Weights& w) const {
  static constexpr std::array<const char*, 12> kMouth = {"lip",  "margin", "verm", "deep", "lining", "perioral",
                                                         "m_mv", "l_mv",   "m_dv", "l_dv", "m_vQ",   "l_vQ"};
  if (!is_one_of(name, kMouth)) return;
  Beside b;
  if (surface != nullptr) b = beside(model_, *surface, name == "lining" ? "margin" : "verm", u, v);
  double along = surface != nullptr ? b.along : u * kLipSpans;
  if (name.starts_with("m_")) along = 0;
  if (name.starts_with("l_")) along = kLipSpans;
  double keep = 1;
  if (name == "perioral") keep = 1 - smooth_step(0, 1, b.across);
  if (name == "m_vQ" || name == "l_vQ") keep = 1 - smooth_step(0, 1, u);
  const double lower = smooth_step(mouth_corner_ - kCornerSpans, mouth_corner_ + kCornerSpans, along);
  w.lip_upper = (1 - lower) * keep;
  w.lip_lower = lower * keep;
  const double opened = along < mouth_corner_
                            ? .5 - .5 * runtime::lip_opening((mouth_corner_ - along) / mouth_corner_)
                            : .5 + .5 * runtime::lip_opening((along - mouth_corner_) / (kLipSpans - mouth_corner_));
  const double jaw = kJawOfUpperLip + (kJawOfLowerLip - kJawOfUpperLip) * opened;
  w.jaw += (jaw - w.jaw) * keep;
  if (name == "lining") w.lining = b.across;
  if (name == "deep") w.lining = 1;
  if (name == "m_dv" || name == "l_dv") w.lining = 1 - u;
}

// Lids turn whole; the skin around them follows less and less.
void Regions::around_eye(const std::string& name, const runtime::NetSurface* surface, double u, double v,
                         Weights& w) const {
  constexpr double kStill = .05;  // the outermost share of the way that does not follow at all
  if (name == "Lu" || name == "lid_u" || name == "Du") w.lid_upper = 1;
  if (name == "Ll" || name == "lid_l" || name == "Dl") w.lid_lower = 1;
  if (name == "dout" || name == "din") w.lid_upper = w.lid_lower = .5;
  if (name == "orb_u" || name == "orb_m") {
    w.lid_upper = smooth_step(kStill, 1, 1 - beside(model_, *surface, "Lu", u, v).across);
  }
  if (name == "orb_l") w.lid_lower = smooth_step(kStill, 1, 1 - beside(model_, *surface, "Ll", u, v).across);
  if (name == "cup") w.lid_upper = smooth_step(kStill, 1, u);
}

Regions::Weights Regions::weights(const std::string& name, const runtime::NetSurface* surface, double u, double v,
                                  const glm::dvec3& p) const {
  Weights w;
  w.jaw = jaw_share(p);
  w.neck = neck_share(p);
  around_mouth(name, surface, u, v, w);
  around_eye(name, surface, u, v, w);
  w.raised = raised_share(p) * (1 - w.lip_lower);
  if (name == "nostril" || name == "ND") w.nostril = 1;
  if (name == "ear" || name == "EC") w.ear = 1;
  return w;
}

namespace {

template <typename Weights>
void append(const Weights& w, std::map<std::string, std::vector<float>>& regions) {
  const auto put = [&](const char* name, double weight) { regions[name].push_back(static_cast<float>(weight)); };
  put("lip_upper", w.lip_upper);
  put("lip_lower", w.lip_lower);
  put("lining", w.lining);
  put("lid_upper_left", w.lid_upper);
  put("lid_lower_left", w.lid_lower);
  put("jaw", w.jaw);
  put("neck", w.neck);
  put("nostril", w.nostril);
  put("ear", w.ear);
  put("raised", w.raised);
}

}  // namespace

void Regions::add_to(runtime::FaceFileCurve& c) const {
  for (std::size_t i = 0; i < c.points.size(); ++i) {
    append(weights(c.curve.name, nullptr, greville(c.curve.knots, i), 0, c.points[i] * 1000.0), c.regions);
  }
}

void Regions::add_to(runtime::FaceFileSurface& s) const {
  const runtime::NetSurface& g = s.geometry;
  for (std::size_t i = 0; i < s.points.size(); ++i) {
    const double u = greville(g.knots_u, i % g.count_u());
    const double v = greville(g.knots_v, i / g.count_u());
    append(weights(g.name, &g, u, v, s.points[i] * 1000.0), s.regions);
  }
}

}  // namespace nms::fit_face
