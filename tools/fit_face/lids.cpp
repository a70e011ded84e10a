#include "lids.h"

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include <glm/geometric.hpp>

namespace nms::fit_face {

namespace {

struct Lid {
  const char* surface;
  const char* edge;
};
constexpr std::array<Lid, 2> kLids = {{{"lid_u", "Lu"}, {"lid_l", "Ll"}}};

// The eyeball has 15.2 mm and a cornea 0.2 mm higher: 0.15 mm remain.
constexpr double kLidRadius_mm = 15.55;
// How far a back reaches behind its edge; 24 degrees, more than the lids need when they close.
constexpr double kLidReach_rad = 0.42;
// The edge lies up to 3 mm off the sphere; the back comes down to it within the first quarter.
constexpr double kLidDescent = 12.0;
constexpr int kLidSamples = 48;

// The middle of the eye's opening, seen from the eye's centre.
glm::dvec3 middle_of_opening(const Model& m) {
  glm::dvec3 middle(0.0);
  for (const Lid& lid : kLids) {
    const std::uint32_t edge = m.curve(lid.edge);
    const double end = m.net.curves[edge].knots.back();
    for (int i = 0; i <= 40; ++i) {
      middle += glm::normalize(m.curve_point(edge, end * i / 40.0) * kMillimetres - kEyeCentre);
    }
  }
  return glm::normalize(middle);
}

bool on_an_edge(const Model& m, std::uint32_t point) {
  const runtime::PointOwner& owner = m.seams.points[point];
  if (owner.kind == runtime::PointOwner::Kind::curve) {
    return owner.owner == m.curve("Lu") || owner.owner == m.curve("Ll");
  }
  if (owner.kind != runtime::PointOwner::Kind::node) return false;
  const std::uint32_t edge = m.curve("Lu");
  const glm::dvec3 p = m.x[point] * kMillimetres;
  for (const double corner : {0.0, m.net.curves[edge].knots.back()}) {
    if (glm::distance(p, m.curve_point(edge, corner) * kMillimetres) < 0.01) return true;
  }
  return false;
}

}  // namespace

void shape_lid_backs(Model& m) {
  const glm::dvec3 middle = middle_of_opening(m);
  PointSolver solver(m);
  for (const Lid& lid : kLids) {
    const std::uint32_t s = m.surface(lid.surface);
    for (const runtime::Row& row : m.seams.surfaces[s]) {
      for (const runtime::RowEntry& e : row) {
        if (!on_an_edge(m, e.point)) solver.release(e.point);
      }
    }
    const runtime::NetSurface& surface = m.net.surfaces[s];
    for (int j = 0; j <= kLidSamples; ++j) {
      for (int i = 0; i <= kLidSamples; ++i) {
        const double u = surface.knots_u.back() * i / kLidSamples;
        const double v = surface.knots_v.back() * j / kLidSamples;
        const Beside b =
            beside(m, surface, lid.edge, static_cast<double>(i) / kLidSamples, static_cast<double>(j) / kLidSamples);
        if (b.across == 0) continue;
        const glm::dvec3 edge = m.curve_point(m.curve(lid.edge), b.along) * kMillimetres - kEyeCentre;
        const double edge_radius = glm::length(edge);
        const glm::dvec3 direction = edge / edge_radius;
        const glm::dvec3 axis = glm::normalize(glm::cross(middle, direction));
        const double angle = b.across * kLidReach_rad;
        const glm::dvec3 turned = direction * std::cos(angle) + glm::cross(axis, direction) * std::sin(angle);
        const double radius = kLidRadius_mm + (edge_radius - kLidRadius_mm) * std::exp(-b.across * kLidDescent);
        solver.want(runtime::surface_row(m.net, m.seams, s, u, v), (kEyeCentre + turned * radius) / kMillimetres, 1.0);
      }
    }
  }
  solver.solve();
}

double mouth_corner(const Model& m) {
  double corner = 0;
  double furthest = -1;
  for (int i = 0; i <= 320; ++i) {
    const double x = m.curve_point(m.curve("margin"), i / 10.0).x;
    if (x > furthest) {
      furthest = x;
      corner = i / 10.0;
    }
  }
  return corner;
}

void tuck_lining(Model& m) {
  const double corner = mouth_corner(m);
  constexpr double kSpans = 3.5;                 // of the lip's curve, to either side of the corner
  constexpr glm::dvec3 kInwards{-.30, 0, -.32};  // in units of 10 mm: clears the lip's back by 1 mm
  const std::uint32_t s = m.surface("lining");
  const runtime::NetSurface& lining = m.net.surfaces[s];
  const std::vector<runtime::Row>& rows = m.seams.surfaces[s];
  std::vector<bool> done(m.x.size(), false);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Beside b = beside(m, lining, "margin", greville(lining.knots_u, i % lining.count_u()),
                            greville(lining.knots_v, i / lining.count_u()));
    if (b.across == 0 || rows[i].size() != 1 || done[rows[i][0].point]) continue;
    done[rows[i][0].point] = true;
    const double weight = std::exp(-std::pow((b.along - corner) / kSpans, 2)) * smooth_step(0, .5, b.across);
    m.x[rows[i][0].point] += kInwards * weight;
  }
}

}  // namespace nms::fit_face
