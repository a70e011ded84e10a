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

std::string place(const Program& program, program::StringId mark, const float (&offset)[3]) {
  std::string text(program.string(mark));
  if (offset[0] != 0.0F || offset[1] != 0.0F || offset[2] != 0.0F) {
    text += fmt::format(" + ({}, {}, {})", length(offset[0]), length(offset[1]), length(offset[2]));
  }
  return text;
}

std::string one_muscle(const Program& program, const Muscle& m, const std::string& name) {
  const bool pulls = m.kind == MuscleKind::linear || m.kind == MuscleKind::sheet;
  std::string text =
      fmt::format("muscle {}{} : {} {} {}", name, m.side == Side::none ? "" : " sides", program::enum_name(m.kind),
                  pulls ? "from" : "at", place(program, m.attachment, m.attachment_offset));
  if (m.insertion != program::StringId{}) text += " to " + place(program, m.insertion, m.insertion_offset);
  text += " {\n";
  const auto line = [&](std::string_view property, const std::string& value) {
    text += fmt::format("  {} {}\n", property, value);
  };
  if (m.kind == MuscleKind::linear) line("angle", number(kDegrees * static_cast<double>(m.angle)) + "deg");
  if (pulls) {
    line("insertion", length(m.insertion_radius));
    line("dissipation", length(m.dissipation_radius));
    if (m.kind == MuscleKind::sheet) line("perpendicular", length(m.perpendicular_radius));
  } else {
    line("major", length(m.major_radius));
    line("minor", length(m.minor_radius));
    line(m.kind == MuscleKind::bulge ? "push" : "protrusion", length(m.amount));
  }
  if (m.kind != MuscleKind::bulge) line("limit", number(100.0 * static_cast<double>(m.limit)) + "%");
  if (m.falloff == Falloff::thesis) line("falloff", "thesis");
  if (m.region != program::StringId{}) line("region", std::string(program.string(m.region)));
  if (m.except != program::StringId{}) line("except", std::string(program.string(m.except)));
  return text + "}\n";
}

}  // namespace

std::string muscle_text(const Program& program, const FitResult& result) {
  std::string text = "// Fitted to measured displacements. Missed by, before and after:\n";
  for (const FitError& e : result.errors) {
    text +=
        fmt::format("//   {}: {:.3f} mm and {:.3f} mm rms, {:.2f} mm and {:.2f} mm at most, of {:.3f} mm rms\n",
                    e.expression, e.before_rms_mm, e.after_rms_mm, e.before_max_mm, e.after_max_mm, e.measured_rms_mm);
  }
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
