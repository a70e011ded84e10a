#include "tint.h"

#include <cmath>
#include <string>

#include <glm/geometric.hpp>

#include "lids.h"

namespace nms::fit_face {

namespace {

struct Blush {
  glm::dvec3 centre;  // [mm], left side
  double radius;      // [mm]
  double strength;
};
constexpr Blush kBlushes[] = {
    {{42, -4, 88}, 20, .5},    // cheek
    {{0, 2, 130}, 11, .45},    // tip of the nose
    {{0, -64, 110}, 13, .25},  // chin
    {{78, 5, 5}, 20, .5},      // ear
};
constexpr double kSocket_mm = 26;
constexpr double kSocket = .22;
constexpr double kUpperLashes = .8;
constexpr double kLowerLashes = .4;
constexpr double kDeepestLight = .35;  // share of the light at the back of the mouth
constexpr double kDeepest_z = 56;      // [mm]
constexpr double kLight_z = 96;        // [mm]

glm::vec3 skin_tint(const glm::dvec3& p) {
  const auto falloff = [&](const glm::dvec3& centre, double radius) {
    const glm::dvec3 d(std::abs(p.x) - centre.x, p.y - centre.y, p.z - centre.z);
    return std::exp(-glm::dot(d, d) / (radius * radius));
  };
  double red = 0;
  for (const Blush& b : kBlushes) red += b.strength * falloff(b.centre, b.radius);
  const double socket = kSocket * falloff(kEyeCentre, kSocket_mm);
  return {1 - .02 * red - .8 * socket, 1 - .26 * red - 1.05 * socket, 1 - .24 * red - .9 * socket};
}

// How much of the lashes' dark is at a place: on the lids' edges, and a little way to both sides.
double lash(const Model& m, const runtime::NetSurface& g, double u, double v) {
  const bool front = g.name.starts_with("orb_");
  if (!front && !g.name.starts_with("lid_")) return 0;
  const bool upper = g.name == "orb_u" || g.name == "lid_u" || g.name == "orb_m";
  const double across = beside(m, g, upper ? "Lu" : "Ll", u, v).across;
  const double edge = front ? smooth_step(.80, 1, 1 - across) : 1 - smooth_step(0, .3, across);
  return (upper ? kUpperLashes : kLowerLashes) * edge;
}

}  // namespace

void add_tint(const Model& m, runtime::FaceFileSurface& s) {
  const runtime::NetSurface& g = s.geometry;
  const bool white = s.part == "nostril" || s.part == "lip" || s.part == "lining";
  for (std::size_t i = 0; i < s.points.size(); ++i) {
    glm::vec3 tint = white ? glm::vec3(1) : skin_tint(s.points[i] * 1000.0);
    tint *=
        static_cast<float>(1 - lash(m, g, greville(g.knots_u, i % g.count_u()), greville(g.knots_v, i / g.count_u())));
    s.tint.push_back(tint);
  }
}

glm::vec3 light_in_mouth(double z) {
  return glm::vec3(static_cast<float>(kDeepestLight + (1 - kDeepestLight) * smooth_step(kDeepest_z, kLight_z, z)));
}

}  // namespace nms::fit_face
