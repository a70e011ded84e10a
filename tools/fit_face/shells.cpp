#include "shells.h"

#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "lids.h"
#include "model.h"
#include "skin_mesh.h"
#include "surface_through.h"
#include "tint.h"

namespace nms::fit_face {

namespace {

double bump(double x, double centre, double width) { return std::exp(-std::pow((x - centre) / width, 2)); }

// An ellipse's quadrant: 0 at 0 with an upright tangent, 1 from 1 on.
double round_end(double t) { return t < 1 ? std::sqrt(t * (2 - t)) : 1; }

// A band from the nose (u = 0) outwards, arched, thinning to its tail; v across it, thickest in its middle. [mm]
glm::dvec3 brow(const SkinMesh& skin, double u, double v) {
  const double across = 2 * v - 1;
  const double x = 10.5 + 49 * u;
  const double middle = 59.8 + 5.4 * smooth_step(0, .7, u) - 8.5 * smooth_step(.6, 1.05, u);
  const double half_width =
      (3.4 + .9 * smooth_step(0, .25, u)) * (1 - .82 * smooth_step(.4, 1, u)) * (.22 + .78 * round_end(u / .13));
  const double lift = .15 + .75 * (1 - across * across) * smooth_step(-.1, .12, u) * (1.05 - smooth_step(.8, 1.1, u));
  const double y = middle + half_width * across;
  const auto place = skin.cast({x, y, 300}, {0, 0, -1}, SkinMesh::Hit::first);
  if (!place) fail(fmt::format("the brow hangs beside the face at x {} y {}", x, y));
  return place->point + place->normal * lift;
}

// Distance of the skull from the head's centre. Where the ear's hole lets the ray out, that of the nearest vertex.
double skull_radius(const SkinMesh& skin, const glm::dvec3& centre, const glm::dvec3& direction) {
  if (const auto hit = skin.cast(centre, direction, SkinMesh::Hit::last)) return glm::length(hit->point - centre);
  constexpr double kShoulders_mm = -60;  // below this is no head
  double best = 1e9;
  double radius = 90;
  for (const glm::dvec3& p : skin.vertices()) {
    if (p.y < kShoulders_mm) continue;
    const double apart = 1 - glm::dot(glm::normalize(p - centre), direction);
    if (apart >= best) continue;
    best = apart;
    radius = glm::length(p - centre);
  }
  return radius;
}

// u goes round from the forehead (0) over the ear (1/2) to the nape (1), v from the hairline up to the crown. [mm]
glm::dvec3 hair(const SkinMesh& skin, double u, double v) {
  const glm::dvec3 centre(0, 42, 8);
  const double azimuth = std::numbers::pi * u;
  const double front = 1 - smooth_step(.13, .33, u);
  const double side = smooth_step(.2, .34, u) * (1 - smooth_step(.46, .62, u));
  const double back = smooth_step(.5, .8, u);
  double hairline = .68 * front + .16 * (1 - front) * (1 - side) * (1 - back) + side * .14 + back * -.74;
  hairline += .06 * bump(u, .2, .05);  // recedes at the temple
  const double elevation = hairline + (std::numbers::pi / 2 - hairline) * v;
  const glm::dvec3 direction(std::sin(azimuth) * std::cos(elevation), std::sin(elevation),
                             std::cos(azimuth) * std::cos(elevation));
  const double waves = .5 * std::sin(u * 60) * smooth_step(0, .2, v) * (1 - smooth_step(.6, 1, v));
  const double lift = .4 + 8.5 * smooth_step(0, .3, v) + 2.5 * smooth_step(.2, .9, v) + waves;
  return centre + direction * (skull_radius(skin, centre, direction) + lift);
}

// The cheek's inside, from where the lining ends at the mouth's corner (v = 0) back along the teeth: an open mouth
// shows it between the bag's halves. u goes from the upper lip's side to the lower one's. [mm]
glm::dvec3 cheek(const Model& m, double u, double v) {
  constexpr double kUpper = 5;  // spans of the lip's curve from the corner on
  constexpr double kLower = 9;
  constexpr glm::dvec3 kBehindLining{.3, 0, .4};
  // Out of the way of the bag at once, then back, and never quite straight back: what is seen edge-on from the front
  // shows through skin where a viewer's depths are coarse.
  constexpr double kOut = 9.5;
  constexpr double kOutAt = .3;
  constexpr double kFlare = .2;
  constexpr double kEnd_z = 66;
  constexpr double kMiddle_y = -36;
  constexpr double kWidens = 4;
  const double along = mouth_corner(m) - kUpper + (kUpper + kLower) * u;
  const glm::dvec3 from = m.curve_point(m.curve("deep"), along) * kMillimetres + kBehindLining;
  const double back = (from.z - kEnd_z) * v;
  return {from.x + kOut * std::sin(std::min(1.0, v / kOutAt) * std::numbers::pi / 2) + kFlare * back,
          from.y + kWidens * (from.y - kMiddle_y) * v, from.z - back};
}

}  // namespace

void add_shells(const Model& m, const Materials& materials, runtime::FaceFile& file) {
  const SkinMesh skin(m);
  const auto add = [&](runtime::FaceFileSurface s, const char* part, std::uint32_t material,
                       const char* rides = "skin") {
    s.part = part;
    s.rides = rides;
    s.material = material;
    s.samples = {2, 2};
    file.surfaces.push_back(std::move(s));
  };
  add(surface_through("brow_hair", 16, 4, [&](double u, double v) { return brow(skin, u, v); }), "brow",
      materials.brow);
  add(surface_through("hair_cap", 32, 12, [&](double u, double v) { return hair(skin, u, v); }), "hair",
      materials.hair);
  runtime::FaceFileSurface inside =
      surface_through("cheek_inside", 7, 4, [&](double u, double v) { return cheek(m, u, v); });
  for (const glm::dvec3& p : inside.points) inside.tint.push_back(light_in_mouth(p.z * 1000.0));
  add(std::move(inside), "cheek_inside", materials.cheek, "lining");
}

}  // namespace nms::fit_face
