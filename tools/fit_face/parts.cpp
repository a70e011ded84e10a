#include "parts.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include <glm/common.hpp>

#include "lids.h"
#include "surface_through.h"
#include "tint.h"

namespace nms::fit_face {

namespace {

using std::numbers::pi;

constexpr double kEyeball_mm = 15.2;
constexpr double kCornea_mm = .2;  // above the sphere, fading out at 24 degrees; the lids slide 0.15 mm above that

constexpr int kTeethASide = 8;
constexpr double kArch = 1.463;  // half of the arch that they stand on [rad]

// A ring of the eyeball about its axis of view, from one angle off that axis to another. [degrees]
Shape eye_ring(double from, double to, double bulge) {
  return [=](double u, double v) {
    const double a = (from + (to - from) * v) * pi / 180;
    const double p = -2 * pi * u;
    const double radius = kEyeball_mm + bulge * (1 - std::pow(a / (24 * pi / 180), 2));
    return kEyeCentre + radius * glm::dvec3(std::sin(a) * std::cos(p), std::sin(a) * std::sin(p), std::cos(a));
  };
}

// The arch that the teeth stand on, from the right (-1) to the left (1), `off` mm outwards. y is 0.
glm::dvec3 arch(double t, double off) {
  const double angle = t * kArch;
  return {(27.5 + off) * std::sin(angle), 0, 66 + (38 + off) * std::cos(angle)};
}

// A row of teeth as one sheet: v runs down the front to the edge (at 0.7) and up behind. Between teeth the sheet sinks
// in and the edge is notched. [mm]
Shape teeth_row(double gum_y, double edge_y, double setback) {
  return [=](double u, double v) {
    const double t = 2 * u - 1;
    const double tooth = std::abs(t) * kTeethASide - std::floor(std::abs(t) * kTeethASide);
    const double crown = 1 - std::pow(std::abs(2 * tooth - 1), 6.0);
    const double towards_edge = edge_y < gum_y ? -1 : 1;
    const double notch = towards_edge * (1 - crown) * .6;
    double y = 0;
    double off = 0;
    if (v < .7) {
      const double w = v / .7;
      y = gum_y + (edge_y - gum_y) * w - notch * w;
      off = -.9 + 1.1 * crown * (.35 + .65 * std::sin(3.0 * std::min(1.0, w + .1)));
    } else {
      const double w = (v - .7) / .3;
      y = edge_y + (gum_y - edge_y) * w * .8 - notch;
      off = -.9 - 4.0 * w;
    }
    glm::dvec3 p = arch(t, off - setback);
    p.y = y;
    return p;
  };
}

Shape gum(double from_y, double to_y, double setback) {
  return [=](double u, double v) {
    glm::dvec3 p = arch(2 * u - 1, .2 - setback + 1.2 * v);
    p.y = from_y + (to_y - from_y) * v;
    return p;
  };
}

// A body of revolution, flattened, with a furrow along its top; v from the root to the tip. [mm]
glm::dvec3 tongue(double u, double v) {
  const double p = 2 * pi * u;
  const double half_width = 19 * std::sqrt(std::max(0.0, 1 - std::pow(v, 3.2))) + .05;
  const double half_height = 6.5 * std::sqrt(std::max(0.0, 1 - std::pow(v, 4.0))) + .05;
  const double furrow = std::cos(p) > 0 ? 1.3 * std::exp(-std::pow(std::sin(p) / .25, 2)) * (1 - v * v) : 0.0;
  return {half_width * std::sin(p), -42.5 - 2.5 * v * v + half_height * std::cos(p) - furrow, 46 + 44 * v};
}

// A bag that is open to the front, behind the lining; `rim` is the angle at which it ends, off the way back. From there
// on it reaches forward, to where the lining begins, as far as `reach` says: a lip that is drawn up or down shows no
// gap behind it. [mm]
glm::dvec3 mouth_bag(double u, double v, double rim, double reach) {
  constexpr double kRim = .8;
  const double p = 2 * pi * u;
  const double a = std::min(v / kRim, 1.0) * rim;
  const glm::dvec3 bag(31 * std::sin(a) * std::sin(p), -36 + 30 * std::sin(a) * std::cos(p), 71 - 31 * std::cos(a));
  const auto square = [](double x) { return std::copysign(std::pow(std::abs(x), .6), x); };
  const glm::dvec3 front(22.5 * square(std::sin(p)), -36 + 18 * square(std::cos(p)), 99);
  return glm::mix(bag, front, reach * std::max(0.0, (v - kRim) / (1 - kRim)));
}

constexpr double kBagRim = 2.45;  // [rad]

// The upper half reaches forward. The lower one ends far back: it would stand in an open mouth, before tongue and
// teeth.
glm::dvec3 mouth_roof(double u, double v) {
  constexpr double kLowerRim = .6;  // [rad]
  const double up = std::cos(2 * pi * u);
  return mouth_bag(u, v, kLowerRim + (kBagRim - kLowerRim) * smooth_step(-.8, -.2, up), smooth_step(-.2, .4, up));
}

// The bag's lower part again, for the jaw to take along: else an open mouth shows what is behind the head. Its sides
// stand higher than the mouth, so that they cover what opens between them and the roof. [mm]
glm::dvec3 mouth_floor(double u, double v) {
  constexpr double kFrom = 1 / 6.0;
  const double at = kFrom + (1 - 2 * kFrom) * u;
  return mouth_bag(at, v, kBagRim, 1 - smooth_step(.05, .45, std::cos(2 * pi * at)));
}

// The middle of a closed curve of 16 spans or fewer. [mm]
glm::dvec3 middle_of(const Model& m, const char* name, int spans) {
  glm::dvec3 centre(0.0);
  const std::uint32_t curve = m.curve(name);
  for (int i = 0; i < spans; ++i) centre += m.curve_point(curve, i) * kMillimetres / static_cast<double>(spans);
  return centre;
}

// An ellipsoid about a hole's inner end; dark, it stands for what lies behind. [mm]
Shape cap(const glm::dvec3& centre, const glm::dvec3& radii) {
  return [=](double u, double v) {
    const double p = -2 * pi * u;
    const double a = pi * v;
    return centre + radii * glm::dvec3(std::sin(a) * std::cos(p), std::cos(a), std::sin(a) * std::sin(p));
  };
}

}  // namespace

void add_parts(const Model& m, const Materials& materials, runtime::FaceFile& file) {
  const auto add = [&](runtime::FaceFileSurface s, const char* part, const char* frame, std::uint32_t material,
                       runtime::SurfaceSamples samples, bool mirrored) {
    s.part = part;
    s.frame = frame;
    s.material = material;
    s.samples = samples;
    s.mirrored = mirrored;
    file.surfaces.push_back(std::move(s));
  };
  const auto eye = [&](const char* name, std::uint32_t material, double from, double to, std::size_t spans,
                       double bulge) {
    add(surface_through(name, 16, spans, eye_ring(from, to, bulge)), "eyeball_left", "eye_left", material, {2, 2},
        true);
  };
  eye("pupil", materials.pupil, .01, 6.8, 1, kCornea_mm);
  eye("iris", materials.iris, 6.8, 20.6, 2, kCornea_mm);
  eye("limbus", materials.limbus, 20.6, 22.6, 1, kCornea_mm);
  eye("sclera", materials.sclera, 22.6, 150, 6, 0);

  const auto shaded = [](runtime::FaceFileSurface s) {
    for (const glm::dvec3& p : s.points) s.tint.push_back(light_in_mouth(p.z * 1000.0));
    return s;
  };
  const auto single = [&](const char* name, std::size_t spans_u, std::size_t spans_v, const Shape& shape,
                          const char* frame, std::uint32_t material, runtime::SurfaceSamples samples) {
    add(shaded(surface_through(name, spans_u, spans_v, shape)), name, frame, material, samples, false);
  };
  constexpr std::size_t kTeethSpans = 6 * 2 * kTeethASide;
  single("teeth_upper", kTeethSpans, 8, teeth_row(-22.0, -32.0, .6), "head", materials.teeth, {1, 2});
  single("teeth_lower", kTeethSpans, 8, teeth_row(-44.5, -34.0, 2.8), "jaw", materials.teeth, {1, 2});
  single("gums_upper", 20, 2, gum(-24.5, -12, 0), "head", materials.gums, {2, 2});
  single("gums_lower", 20, 2, gum(-43, -55, 2.2), "jaw", materials.gums, {2, 2});
  single("tongue", 16, 10, tongue, "jaw", materials.tongue, {2, 2});
  const auto stop = [&](const char* name, const char* part, const glm::dvec3& centre, const glm::dvec3& radii) {
    add(surface_through(name, 12, 6, cap(centre, radii)), part, "head", materials.dark, {1, 1}, true);
  };
  stop("nostril_cap", "nostril_cap_left", middle_of(m, "ND", 16) + glm::dvec3(0, 1.5, 0), {6.3, 6.0, 7});
  // The canal's end is a long hole.
  stop("ear_cap", "ear_cap_left", middle_of(m, "EC", 24) - glm::dvec3(1.5, 0, 0), {2, 6, 4});
  single("mouth_bag", 16, 10, mouth_roof, "head", materials.dark, {2, 2});
  single("mouth_floor", 8, 10, mouth_floor, "jaw", materials.dark, {2, 2});
}

}  // namespace nms::fit_face
