#include <nms/runtime/muscle.h>

#include <algorithm>
#include <cassert>
#include <cmath>

#include <nms/runtime/trigonometry.h>

namespace nms::runtime {
namespace {

using program::Falloff;
using program::Muscle;
using program::MuscleKind;

// Of half a mouth's width, from its middle: where a lip's two halves slide all the way.
constexpr double kMiddle = 0.5;

double dot(glm::dvec3 a, glm::dvec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
double length(glm::dvec3 a) { return std::sqrt(dot(a, a)); }
double square(double x) { return x * x; }

// A length that is 0 in the record stands for the muscle vector's own.
double or_length(float radius, double m) { return radius > 0.0F ? static_cast<double>(radius) : m; }

// Parts of v along and across the muscle's vector.
struct Split {
  double along = 0.0;   // signed
  double across = 0.0;  // >= 0
};

Split split(glm::dvec3 v, glm::dvec3 direction) {
  const double along = dot(v, direction);
  return {along, length(v - along * direction)};
}

// Share of the way from the rim of an ellipse: Waters' a = 1 - sqrt((s_maj/r_maj)^2 + (s_min/r_min)^2), the same as the
// form with the product of the radii below.
double squared_ellipse_radius(const Muscle& muscle, const MusclePlaces& places, glm::dvec3 p) {
  glm::dvec3 v = p - places.attachment;
  glm::dvec3 m = places.insertion - places.attachment;
  double m_length = length(m);
  if (m_length == 0.0) {
    m = glm::dvec3(1.0, 0.0, 0.0);
    m_length = 0.0;
  } else {
    m = m / m_length;
  }
  if (muscle.side == program::Side::none) {
    v.x = std::abs(v.x);
    m.x = std::abs(m.x);
  }
  const double major = or_length(muscle.major_radius, m_length);
  const double minor = or_length(muscle.minor_radius, major);
  if (major <= 0.0 || minor <= 0.0) return 2.0;
  const Split s = split(v, m);
  return square(s.along / major) + square(s.across / minor);
}

}  // namespace

double smooth_fall(double t) {
  if (t <= 0.0) return 1.0;
  if (t >= 1.0) return 0.0;
  return 1.0 - t * t * (3.0 - 2.0 * t);
}

double smooth_rise(double from, double to, double at) { return 1.0 - smooth_fall((at - from) / (to - from)); }

double lip_opening(double t) {
  const double rest = 1.0 - std::clamp(t, 0.0, 1.0);
  return 1.0 - rest * rest;
}

double radial_factor(Falloff law, double distance, double insertion, double dissipation) {
  double factor = 1.0;
  if (distance <= insertion) {
    if (insertion > 0.0) factor = sine(distance / insertion * (kPi / 2.0));
  } else {
    if (distance >= dissipation) return 0.0;
    factor = cosine((distance - insertion) / (dissipation - insertion) * (kPi / 2.0));
  }
  return law == Falloff::thesis ? factor : factor * factor;
}

double angular_factor(Falloff law, double cos_phi, double cos_angle) {
  if (cos_phi < cos_angle) return 0.0;
  if (law == Falloff::thesis) return std::max(cos_phi, 0.0);
  const double width = 1.0 - cos_angle;
  if (width <= 0.0) return 0.0;
  return std::max(cos_phi, 0.0) * smooth_fall((1.0 - cos_phi) / width);
}

glm::dvec3 linear_pull(const Muscle& muscle, const MusclePlaces& places, glm::dvec3 p) {
  const glm::dvec3 v = p - places.attachment;
  const glm::dvec3 m = places.insertion - places.attachment;
  const double distance = length(v);
  const double m_length = length(m);
  if (distance == 0.0 || m_length == 0.0) return glm::dvec3(0.0);
  const double a = angular_factor(muscle.falloff, dot(v, m) / (distance * m_length), cosine(muscle.angle));
  if (a == 0.0) return glm::dvec3(0.0);
  const double r = radial_factor(muscle.falloff, distance, or_length(muscle.insertion_radius, m_length),
                                 static_cast<double>(muscle.dissipation_radius));
  const double pull = std::min(muscle.limit * m_length * a * r, distance);
  return -(pull / distance) * v;
}

glm::dvec3 sheet_pull(const Muscle& muscle, const MusclePlaces& places, glm::dvec3 p) {
  const glm::dvec3 v = p - places.attachment;
  const glm::dvec3 m = places.insertion - places.attachment;
  const double m_length = length(m);
  const double width = static_cast<double>(muscle.perpendicular_radius);
  if (m_length == 0.0 || width <= 0.0) return glm::dvec3(0.0);
  const glm::dvec3 direction = m / m_length;
  const Split s = split(v, direction);
  if (s.across >= width) return glm::dvec3(0.0);
  const bool thesis = muscle.falloff == Falloff::thesis;
  if (!thesis && s.along <= 0.0) return glm::dvec3(0.0);

  const double insertion = or_length(muscle.insertion_radius, m_length);
  const double along = std::abs(s.along);
  const double parallel =
      radial_factor(muscle.falloff, along, insertion, static_cast<double>(muscle.dissipation_radius));
  double perpendicular = cosine(s.across / width * (kPi / 2.0));
  if (!thesis) perpendicular *= perpendicular;
  // Behind the middle of the vector a point may be nearer to the attachment than the pull is long.
  const double pull = muscle.limit * m_length * parallel * perpendicular;
  return -(thesis ? pull : std::min(pull, along)) * direction;
}

glm::dvec3 sphincter_pull(const Muscle& muscle, const MusclePlaces& places, glm::dvec3 p) {
  const double q2 = squared_ellipse_radius(muscle, places, p);
  if (q2 >= 1.0) return glm::dvec3(0.0);
  const double a = 1.0 - std::sqrt(q2);
  const double s = muscle.falloff == Falloff::thesis ? a : 1.0 - smooth_fall(a);
  const double limit = std::min(static_cast<double>(muscle.limit), 1.0);
  return s * (glm::dvec3(0.0, 0.0, muscle.amount) - limit * (p - places.attachment));
}

glm::dvec3 bulge_push(const Muscle& muscle, const MusclePlaces& places, glm::dvec3 p, glm::dvec3 normal) {
  const double q2 = squared_ellipse_radius(muscle, places, p);
  if (q2 >= 1.0) return glm::dvec3(0.0);
  return (muscle.amount * square(1.0 - q2)) * normal;
}

glm::dvec3 roll_shift(const Muscle& muscle, const MusclePlaces& places, glm::dvec3 p) {
  const glm::dvec3 middle = places.attachment;
  const glm::dvec3 corner = places.insertion;
  const double width = std::abs(corner.x - middle.x);
  if (width <= 0.0) return glm::dvec3(0.0);
  const double x = p.x - middle.x;
  const double s = std::min(std::abs(x) / width, 1.0);
  const glm::dvec3 track(p.x, middle.y + s * s * (corner.y - middle.y), middle.z + s * s * (corner.z - middle.z));
  const double slope = 2.0 * s / width * (x < 0.0 ? -1.0 : 1.0);
  glm::dvec3 t(1.0, slope * (corner.y - middle.y), slope * (corner.z - middle.z));
  t = t / length(t);
  const double inner = static_cast<double>(muscle.insertion_radius);
  const double outer = static_cast<double>(muscle.dissipation_radius);
  const glm::dvec3 v = p - track;
  const double f = outer > inner ? smooth_fall((length(v) - inner) / (outer - inner)) : 1.0;
  const double whole = std::min(static_cast<double>(muscle.perpendicular_radius) / width, 0.99);
  const double share = f * smooth_fall((s - whole) / (1.0 - whole));
  if (share == 0.0) return glm::dvec3(0.0);
  // Rodrigues' rotation.
  const double angle = share * static_cast<double>(muscle.angle);
  const double c = cosine(angle);
  const glm::dvec3 across(t.y * v.z - t.z * v.y, t.z * v.x - t.x * v.z, t.x * v.y - t.y * v.x);
  const glm::dvec3 turned = c * v + sine(angle) * across + (1.0 - c) * dot(t, v) * t;
  // Halves slide apart or together, and the lip's middle stays: between them the slide must grow more slowly than x.
  const double sideways = smooth_rise(0.0, kMiddle, s) * (x < 0.0 ? -1.0 : 1.0);
  const glm::dvec3 slide(sideways * static_cast<double>(muscle.slide[0]), muscle.slide[1], muscle.slide[2]);
  return turned - v + share * slide;
}

std::vector<Pull> activation_set(const Muscle& muscle, const MusclePlaces& places, std::span<const glm::dvec3> points,
                                 std::span<const glm::dvec3> normals, std::span<const float> weights) {
  assert(weights.empty() || weights.size() == points.size());
  std::vector<Pull> set;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const double weight = weights.empty() ? 1.0 : static_cast<double>(weights[i]);
    if (weight <= 0.0) continue;
    glm::dvec3 d(0.0);
    switch (muscle.kind) {
      case MuscleKind::linear:
        d = linear_pull(muscle, places, points[i]);
        break;
      case MuscleKind::sheet:
        d = sheet_pull(muscle, places, points[i]);
        break;
      case MuscleKind::sphincter:
        d = sphincter_pull(muscle, places, points[i]);
        break;
      case MuscleKind::bulge:
        d = bulge_push(muscle, places, points[i], normals[i]);
        break;
      case MuscleKind::roll:
        d = roll_shift(muscle, places, points[i]);
        break;
      case MuscleKind::eyelid:
      case MuscleKind::hinge:
        return set;
    }
    d *= weight;
    if (dot(d, d) > 0.0) set.push_back({i, d});
  }
  return set;
}

// ------------------------------------------------------------------------------------------------ eyelids

glm::dvec3 turn_about_x(glm::dvec3 p, glm::dvec3 centre, double s, double c) {
  const glm::dvec3 v = p - centre;
  return centre + glm::dvec3(v.x, c * v.y - s * v.z, s * v.y + c * v.z);
}

glm::dvec3 turn_about_y(glm::dvec3 p, glm::dvec3 centre, double s, double c) {
  const glm::dvec3 v = p - centre;
  return centre + glm::dvec3(c * v.x + s * v.z, v.y, c * v.z - s * v.x);
}

double elevation(glm::dvec3 p, glm::dvec3 centre) { return arc_tangent(p.y - centre.y, p.z - centre.z); }

LidMargin::LidMargin(Lid lid, std::span<const glm::dvec3> points, glm::dvec3 centre) {
  // Points of one column differ by rounding only; lid backs lie between the edge's columns. A column is 1/24 of the
  // fissure: about 1.1 mm, half the distance of the edge's control points.
  constexpr int kColumns = 24;
  if (points.empty()) return;
  double low = points[0].x;
  double high = points[0].x;
  for (const glm::dvec3& p : points) {
    low = std::min(low, p.x);
    high = std::max(high, p.x);
  }
  const double width = (high - low) / kColumns;
  if (width <= 0.0) {
    x_.push_back(low);
    elevation_.push_back(elevation(points[0], centre));
    return;
  }
  std::vector<const glm::dvec3*> best(kColumns, nullptr);
  for (const glm::dvec3& p : points) {
    // Columns mirror with the face: a point on a column's border must not go left on one side, right on the other.
    const double at = (p.x - low) / width;
    const double mirrored = (high - p.x) / width;
    const int column = centre.x >= 0.0 ? std::min(static_cast<int>(at), kColumns - 1)
                                       : kColumns - 1 - std::min(static_cast<int>(mirrored), kColumns - 1);
    const glm::dvec3*& b = best[static_cast<std::size_t>(column)];
    const double e = elevation(p, centre);
    if (b == nullptr || (lid == Lid::upper ? e < elevation(*b, centre) : e > elevation(*b, centre))) b = &p;
  }
  for (const glm::dvec3* b : best) {
    if (b == nullptr) continue;
    x_.push_back(b->x);
    elevation_.push_back(elevation(*b, centre));
  }
}

double LidMargin::elevation_at(double x) const {
  if (x_.empty()) return 0.0;
  if (x <= x_.front()) return elevation_.front();
  if (x >= x_.back()) return elevation_.back();
  const auto next = std::upper_bound(x_.begin(), x_.end(), x);
  const std::size_t i = static_cast<std::size_t>(next - x_.begin());
  const double t = (x - x_[i - 1]) / (x_[i] - x_[i - 1]);
  return elevation_[i - 1] + t * (elevation_[i] - elevation_[i - 1]);
}

double closing_angle(const LidMargin& upper, const LidMargin& lower, double x) {
  if (upper.empty() || lower.empty()) return 0.0;
  if (x < std::max(upper.first_x(), lower.first_x()) || x > std::min(upper.last_x(), lower.last_x())) return 0.0;
  return std::max(upper.elevation_at(x) - lower.elevation_at(x), 0.0);
}

}  // namespace nms::runtime
