// What each action unit does to the face, measured and held to figures: tools/fit_muscles/measured_units.tsv, which says
// where they are from. Bars: the direction within 25 degrees, the size within 30 %, the landmark's reach.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <nms/runtime/face_file.h>

#include "../tools/fit_muscles/unit_figures.h"
#include "../tools/fit_muscles/unit_movement.h"
#include "ada_fixture.h"

namespace {

using namespace nms;
using namespace nms::ada;
using fit_muscles::degrees_between;
using fit_muscles::UnitFigures;
using fit_muscles::UnitMovement;

constexpr double kDirection_deg = 25.0;
constexpr double kSize = 0.3;
constexpr double kOpening = 0.10;

std::vector<UnitFigures> figures() {
  std::ifstream file(std::string(NMS_SOURCE_DIR) + "/tools/fit_muscles/measured_units.tsv", std::ios::binary);
  const std::string text(std::istreambuf_iterator<char>(file), {});
  auto read = fit_muscles::read_unit_figures(text, "measured_units.tsv");
  if (!read) ADD_FAILURE() << read.error().place << ": " << read.error().cause;
  return read ? *std::move(read) : std::vector<UnitFigures>{};
}

UnitMovement measure(const Bound& b, const std::string& unit) {
  static const fit_muscles::MovementGauge gauge(face(), runtime::landmarks_of(face(), b.image.program()));
  static runtime::Pose pose = runtime::make_pose(face(), b.rig);
  runtime::pose_face(face(), b.rig, values_of(b, {unit}), pose);
  return gauge.measure(pose.positions);
}

std::string report_line(const Bound& b, const UnitFigures& f, const UnitMovement& m) {
  const glm::dvec3 d = m.direction;
  std::string line = fmt::format(
      "{:6} {:5.1f} mm {:+4.0f} % {:3.0f} deg ({:5.2f} {:5.2f} {:5.2f}) {:4.1f} mm from {}, at {}; area {:.1f} %", f.unit,
      m.largest_mm, 100 * (m.largest_mm / f.largest_mm - 1), degrees_between(d, f.direction), d.x, d.y, d.z,
      1000 * glm::distance(m.place, landmark(b, f.near)), f.near, nearest_landmark(b, m.place), 100 * m.area);
  if (f.area) line += fmt::format(" of {:.0f} %", 100 * *f.area);
  if (f.gap_mm) line += fmt::format("; gap {:+.1f} of {:+.1f} mm", m.gap_mm, *f.gap_mm);
  if (f.opening) line += fmt::format("; eye {:.0f} of {:.0f} %", 100 * m.opening, 100 * *f.opening);
  return line;
}

TEST(AdaUnits, MoveAsMeasured) {
  const Bound& b = all_units();
  const bool print = std::getenv("NMS_REPORT") != nullptr;
  for (const UnitFigures& f : figures()) {
    const UnitMovement m = measure(b, f.unit);
    const std::string line = report_line(b, f, m);
    if (print) fmt::print("{}\n", line);
    EXPECT_LE(degrees_between(m.direction, f.direction), kDirection_deg) << line;
    EXPECT_NEAR(m.largest_mm, f.largest_mm, kSize * f.largest_mm) << line;
    EXPECT_LE(1000 * glm::distance(m.place, landmark(b, f.near)), f.reach_mm) << line;
    if (f.gap_mm) {
      EXPECT_NEAR(m.gap_mm, *f.gap_mm, std::max(1.5, 0.3 * *f.gap_mm)) << line;
    }
    if (f.opening) {
      EXPECT_NEAR(m.opening, *f.opening, kOpening) << line;
    }
  }
}

}  // namespace
