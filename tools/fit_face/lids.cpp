#include "lids.h"

#include <array>
#include <cmath>
#include <string>
#include <utility>
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

// Between closed lips the scan's margins cross by 0.2 mm beside the corner: the upper lip's lies below the lower one's,
// and where one turns into the other the surface turns inside out. Here the upper one goes up and the lower one down,
// most a little way from the corner, so that the corner is a narrow U.
void part_corner(Model& m) {
  const double corner = mouth_corner(m);
  constexpr double kPart = .022;   // each way, in units of 10 mm
  constexpr double kSpans = 1.4;   // of the lip's curve, from the corner to where they part most
  constexpr double kLip = .45;     // share of the lip's width that takes part
  constexpr double kLining = .75;  // and of the lining's
  const auto raise = [&](double along) {
    const double s = (corner - along) / kSpans;
    return kPart * s * std::exp(.5 * (1 - s * s));
  };
  const std::uint32_t margin = m.curve("margin");
  std::vector<bool> done(m.x.size(), false);
  const auto shift = [&](const runtime::Row& row, double along, double share) {
    if (row.size() != 1 || done[row[0].point]) return;
    done[row[0].point] = true;
    m.x[row[0].point].y += share * raise(along);
  };
  const std::vector<double>& knots = m.net.curves[margin].knots;
  for (std::size_t i = 0; i < m.seams.curves[margin].size(); ++i) {
    shift(m.seams.curves[margin][i], greville(knots, i) * knots.back(), 1.0);
  }
  for (const auto& [name, reach] : {std::pair("lip", kLip), std::pair("lining", kLining)}) {
    const runtime::NetSurface& surface = m.net.surfaces[m.surface(name)];
    const std::vector<runtime::Row>& rows = m.seams.surfaces[m.surface(name)];
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const Beside b = beside(m, surface, "margin", greville(surface.knots_u, i % surface.count_u()),
                              greville(surface.knots_v, i / surface.count_u()));
      shift(rows[i], b.along, 1 - smooth_step(0, reach, b.across));
    }
  }
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
