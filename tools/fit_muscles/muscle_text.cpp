#include <cmath>
#include <cstdint>

#include <fmt/format.h>

#include <nms/program/enum_names.h>

#include "muscle_fit.h"

namespace nms::fit_muscles {

using program::Falloff;
using program::Muscle;
using program::MuscleKind;
using program::Program;
using program::Side;

namespace {

constexpr double kDegrees = 57.29577951308232;

/// A hundredth is enough for a muscle's place; zeros at the end are not written.
std::string number(double value) {
  std::string text = fmt::format("{:.2f}", value);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.ends_with('.')) text.pop_back();
  return text == "-0" ? "0" : text;
}

std::string length(float metres) { return number(1000.0 * static_cast<double>(metres)) + "mm"; }

std::string triple(const float (&v)[3]) {
  return fmt::format("({}, {}, {})", length(v[0]), length(v[1]), length(v[2]));
}

bool any(const float (&v)[3]) { return v[0] != 0.0F || v[1] != 0.0F || v[2] != 0.0F; }

std::string place(const Program& program, program::StringId mark, const float (&offset)[3]) {
  const std::string name(program.string(mark));
  return any(offset) ? name + " + " + triple(offset) : name;
}

const char* first_word(MuscleKind kind) {
  switch (kind) {
    case MuscleKind::linear:
    case MuscleKind::sheet:
    case MuscleKind::roll:
      return "from";
    case MuscleKind::eyelid:
      return "about";
    case MuscleKind::sphincter:
    case MuscleKind::bulge:
    case MuscleKind::hinge:
      break;
  }
  return "at";
}

std::string one_muscle(const Program& program, const Muscle& m, const std::string& name) {
  const bool pulls = m.kind == MuscleKind::linear || m.kind == MuscleKind::sheet;
  const bool swells = m.kind == MuscleKind::sphincter || m.kind == MuscleKind::bulge;
  std::string text =
      fmt::format("muscle {}{} : {} {} {}", name, m.side == Side::none ? "" : " sides", program::enum_name(m.kind),
                  first_word(m.kind), place(program, m.attachment, m.attachment_offset));
  if (m.insertion != program::StringId{}) text += " to " + place(program, m.insertion, m.insertion_offset);
  text += " {\n";
  const auto line = [&](std::string_view property, const std::string& value) {
    text += fmt::format("  {} {}\n", property, value);
  };
  if (m.frame != program::Frame::none) line("frame", std::string(program::enum_name(m.frame)));
  if (m.angle != 0.0F && m.kind != MuscleKind::sheet && !swells) {
    line("angle", number(kDegrees * static_cast<double>(m.angle)) + "deg");
  }
  if (!swells && m.insertion_radius != 0.0F) line("insertion", length(m.insertion_radius));
  if (!swells && m.dissipation_radius != 0.0F) line("dissipation", length(m.dissipation_radius));
  if (!swells && m.perpendicular_radius != 0.0F) line("perpendicular", length(m.perpendicular_radius));
  if (swells) {
    line("major", length(m.major_radius));
    line("minor", length(m.minor_radius));
  }
  if (pulls || m.kind == MuscleKind::sphincter) line("limit", number(100.0 * static_cast<double>(m.limit)) + "%");
  if (swells) line(m.kind == MuscleKind::bulge ? "push" : "protrusion", length(m.amount));
  if (m.closes != 0.0F) line("closes", number(100.0 * static_cast<double>(m.closes)) + "%");
  if (m.falloff == Falloff::thesis) line("falloff", "thesis");
  if (any(m.slide)) line("slide", triple(m.slide));
  if (m.region != program::StringId{}) line("region", std::string(program.string(m.region)));
  if (m.except != program::StringId{}) line("except", std::string(program.string(m.except)));
  return text + "}\n";
}

/// Before, after and measured, as one line.
std::string figure_line(const FigureError& e) {
  const UnitFigures& f = e.measured;
  std::string line =
      fmt::format("{}: {:.1f} mm -> {:.1f} mm of {:.1f} mm, {:.0f} deg -> {:.0f} deg off", f.unit, e.before.largest_mm,
                  e.after.largest_mm, f.largest_mm, degrees_between(e.before.direction, f.direction),
                  degrees_between(e.after.direction, f.direction));
  if (f.area) {
    line += fmt::format(", area {:.1f} % -> {:.1f} % of {:.0f} %", 100.0 * e.before.area, 100.0 * e.after.area,
                        100.0 * *f.area);
  }
  if (f.gap_mm) {
    line +=
        fmt::format(", lips' gap {:+.1f} mm -> {:+.1f} mm of {:+.1f} mm", e.before.gap_mm, e.after.gap_mm, *f.gap_mm);
  }
  if (f.width) {
    line += fmt::format(", mouth's width {:+.0f} % -> {:+.0f} % of {:+.0f} %", 100.0 * e.before.width,
                        100.0 * e.after.width, 100.0 * *f.width);
  }
  if (f.opening) {
    line += fmt::format(", eye {:.0f} % -> {:.0f} % of {:.0f} %", 100.0 * e.before.opening, 100.0 * e.after.opening,
                        100.0 * *f.opening);
  }
  return line;
}

}  // namespace

std::vector<std::string> report_lines(const FitResult& result) {
  std::vector<std::string> lines;
  for (const FitError& e : result.errors) {
    lines.push_back(fmt::format("{}: rms {:.3f} mm -> {:.3f} mm, max {:.2f} mm -> {:.2f} mm, of {:.3f} mm rms",
                                e.expression, e.before_rms_mm, e.after_rms_mm, e.before_max_mm, e.after_max_mm,
                                e.measured_rms_mm));
  }
  for (const FigureError& e : result.figures) lines.push_back(figure_line(e));
  return lines;
}

std::string muscle_text(const Program& program, const FitResult& result) {
  std::string text = "// Fitted to what was measured; before and after:\n";
  for (const std::string& line : report_lines(result)) text += fmt::format("//   {}\n", line);
  for (const FittedShare& s : result.shares) {
    text += fmt::format("// share of {} in {}: {}%\n", s.muscle, s.unit, number(100.0 * s.share));
  }
  for (const std::string& name : result.fitted) {
    for (const Muscle& m : result.muscles) {
      // What the left one says is mirrored for the right one.
      if (m.side == Side::right || plain_muscle(program, m) != name) continue;
      text += "\n" + one_muscle(program, m, name);
      break;
    }
  }
  return text;
}

}  // namespace nms::fit_muscles
