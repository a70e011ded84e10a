// What each action unit does to the face, measured and held to figures.
//
// "measured" figures are of ICT-FaceKit Light's expression shapes (mean of scans, artist-finished): the largest
// displacement of the visible skin's left half at full weight, its direction (+x the subject's left, +y up, +z
// forward), the landmark it is near, the change of the lips' gap in the middle, and the eye's opening. Bars: 25
// degrees, 30 %, the landmark's reach. Where that model is no pure unit of FACS (AU4, 7, 9, 24, 33, 34), or has none,
// figures are our own, after what the FACS manual says moves.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include "ada_fixture.h"

namespace {

using namespace nms;
using namespace nms::ada;

struct Movement {
  double largest_mm = 0.0;
  glm::dvec3 direction{0.0};
  std::uint32_t vertex = 0;
  double area = 0.0;       // share of the face's surface that moves more than a fifth of the largest
  double gap_mm = 0.0;     // between the lips, in the middle
  double opening = 0.0;    // of the left eye, seen from the front, of that at rest
  double mirror_mm = 0.0;  // largest difference between a vertex and its mirror image
};

/// Skin that can be seen: neither shells nor what lies inside mouth, nostrils and lids.
const std::vector<char>& visible() {
  static const std::vector<char> out = [] {
    std::vector<char> seen(rest().size(), 0);
    std::vector<glm::dvec3> normals(rest().size(), glm::dvec3(0.0));
    for (const Triangle& t : skin_triangles()) {
      const glm::dvec3 n = glm::cross(rest()[t[1]] - rest()[t[0]], rest()[t[2]] - rest()[t[0]]);
      for (const std::uint32_t v : t) {
        seen[v] = 1;
        normals[v] += n;
      }
    }
    const auto lining = vertex_weights("lining");
    const auto nostril = vertex_weights("nostril");
    const glm::dvec3 centre = landmark(all_units(), "eye_centre_L");
    for (std::size_t v = 0; v < seen.size(); ++v) {
      if (lining[v] > 0.3F || nostril[v] > 0.3F) seen[v] = 0;
      const glm::dvec3 from_eye = rest()[v] - glm::dvec3(std::copysign(centre.x, rest()[v].x), centre.y, centre.z);
      if (glm::length(from_eye) < 0.021 && glm::dot(from_eye, normals[v]) < 0.0) seen[v] = 0;
    }
    return seen;
  }();
  return out;
}

// The lips' edges in the middle, and the lids' along the left eye: vertices.
struct Edges {
  std::vector<std::uint32_t> upper_lip, lower_lip;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> lids;  // upper, lower
};

const Edges& edges() {
  static const Edges out = [] {
    Edges e;
    const auto upper = vertex_weights("lip_upper");
    const auto lower = vertex_weights("lip_lower");
    const auto lining = vertex_weights("lining");
    for (std::uint32_t v = 0; v < rest().size(); ++v) {
      if (std::abs(rest()[v].x) > 0.0002 || lining[v] > 0.5F) continue;
      if (upper[v] > 0.95F) e.upper_lip.push_back(v);
      if (lower[v] > 0.95F) e.lower_lip.push_back(v);
    }
    const auto upper_lid = vertex_weights("lid_upper_left");
    const auto lower_lid = vertex_weights("lid_lower_left");
    constexpr int kColumns = 16;
    const double inner = landmark(all_units(), "eye_inner_L").x;
    const double outer = landmark(all_units(), "eye_outer_L").x;
    for (int c = 0; c < kColumns; ++c) {
      const double from = inner + (outer - inner) * c / kColumns;
      const double to = inner + (outer - inner) * (c + 1) / kColumns;
      std::uint32_t low = 0, high = 0;
      double y_low = 1.0, y_high = -1.0;
      for (std::uint32_t v = 0; v < rest().size(); ++v) {
        const glm::dvec3& p = rest()[v];
        if (p.x < from || p.x >= to) continue;
        if (upper_lid[v] > 0.99F && p.y < y_low) y_low = p.y, low = v;
        if (lower_lid[v] > 0.99F && p.y > y_high) y_high = p.y, high = v;
      }
      if (y_low < 1.0 && y_high > -1.0) e.lids.emplace_back(low, high);
    }
    return e;
  }();
  return out;
}

template <typename Points>
double lip_gap_mm(const Points& p) {
  double up = 1.0, low = -1.0;
  for (const std::uint32_t v : edges().upper_lip) up = std::min(up, static_cast<double>(p[v].y));
  for (const std::uint32_t v : edges().lower_lip) low = std::max(low, static_cast<double>(p[v].y));
  return (up - low) * 1000.0;
}

template <typename Points>
double lid_area(const Points& p) {
  double sum = 0.0;
  for (const auto& [up, low] : edges().lids) sum += std::max(0.0, static_cast<double>(p[up].y - p[low].y));
  return sum;
}

Movement measure(const Bound& b, const std::vector<float>& values) {
  static runtime::Pose pose = runtime::make_pose(face(), b.rig);
  runtime::pose_face(face(), b.rig, values, pose);
  Movement m;
  const auto& places = rest();
  for (std::uint32_t v = 0; v < places.size(); ++v) {
    const glm::dvec3 moved = glm::dvec3(pose.positions[v]) - places[v];
    const double mm = glm::length(moved) * 1000.0;
    const int other = partners()[v];
    if (other >= 0) {
      const glm::vec3 q = pose.positions[static_cast<std::size_t>(other)];
      m.mirror_mm =
          std::max(m.mirror_mm, 1000.0 * glm::distance(glm::dvec3(pose.positions[v]), glm::dvec3(-q.x, q.y, q.z)));
    }
    if (!visible()[v] || places[v].x < -1e-6 || mm <= m.largest_mm) continue;
    m.largest_mm = mm;
    m.direction = moved / (mm / 1000.0);
    m.vertex = v;
  }
  double area = 0.0, moving = 0.0;
  for (const Triangle& t : skin_triangles()) {
    const glm::dvec3 c = (places[t[0]] + places[t[1]] + places[t[2]]) / 3.0;
    if (!visible()[t[0]] || c.z < 0.02 || c.y < -0.085 || c.y > 0.115) continue;  // the mask of the face
    const double a = glm::length(glm::cross(places[t[1]] - places[t[0]], places[t[2]] - places[t[0]]));
    area += a;
    if (glm::distance(glm::dvec3(pose.positions[t[0]]), places[t[0]]) * 1000.0 > 0.2 * m.largest_mm) moving += a;
  }
  m.area = area > 0.0 ? moving / area : 0.0;
  m.gap_mm = lip_gap_mm(pose.positions) - lip_gap_mm(places);
  m.opening = lid_area(pose.positions) / lid_area(places);
  return m;
}

struct Figure {
  const char* unit;
  double largest_mm;
  glm::dvec3 direction;
  const char* near;  // landmark
  double reach_mm;   // how far from it the largest displacement may be
  std::optional<double> gap_mm = {};
  std::optional<double> opening = {};
  bool own = false;
};

const std::vector<Figure>& figures() {
  static const std::vector<Figure> all = {
#include "ada_figures.inc"
  };
  return all;
}

double degrees_between(const glm::dvec3& a, const glm::dvec3& b) {
  const double c = glm::dot(a, b) / (glm::length(a) * glm::length(b));
  return std::acos(std::clamp(c, -1.0, 1.0)) * 57.29577951308232;
}

std::string report_line(const Bound& b, const Figure* f, const std::string& unit, const Movement& m) {
  const glm::dvec3 d = m.direction;
  std::string line = fmt::format(
      "{:7} {:5.1f} mm ({:5.2f} {:5.2f} {:5.2f}) at {:18} area {:3.0f} % gap {:+5.1f} eye {:3.0f} %", unit,
      m.largest_mm, d.x, d.y, d.z, nearest_landmark(b, rest()[m.vertex]), m.area * 100, m.gap_mm, m.opening * 100);
  if (f == nullptr) return line;
  line += fmt::format(" | {:5.1f} {:+4.0f} % {:3.0f} deg {:4.1f} mm from {}", f->largest_mm,
                      100 * (m.largest_mm / f->largest_mm - 1), degrees_between(m.direction, f->direction),
                      1000 * glm::distance(rest()[m.vertex], landmark(b, f->near)), f->near);
  if (f->gap_mm) line += fmt::format(" gap {:+.1f}", *f->gap_mm);
  if (f->opening) line += fmt::format(" eye {:.0f} %", *f->opening * 100);
  return line;
}

TEST(AdaUnits, MoveAsMeasured) {
  const Bound& b = all_units();
  const bool print = std::getenv("NMS_REPORT") != nullptr;
  for (const Figure& f : figures()) {
    const Movement m = measure(b, values_of(b, {f.unit}));
    const std::string line = report_line(b, &f, f.unit, m);
    if (print) fmt::print("{}\n", line);
    EXPECT_LE(degrees_between(m.direction, f.direction), 25.0) << line;
    EXPECT_NEAR(m.largest_mm, f.largest_mm, 0.3 * f.largest_mm) << line;
    EXPECT_LE(1000 * glm::distance(rest()[m.vertex], landmark(b, f.near)), f.reach_mm) << line;
    if (f.gap_mm) {
      EXPECT_NEAR(m.gap_mm, *f.gap_mm, std::max(1.5, 0.3 * *f.gap_mm)) << line;
    }
    if (f.opening) {
      EXPECT_NEAR(m.opening, *f.opening, 0.10) << line;
    }
  }
}

}  // namespace
