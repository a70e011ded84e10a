#include "muscle_parameters.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <glm/vec3.hpp>

namespace nms::fit_muscles {

using program::Failure;
using program::Muscle;
using program::MuscleKind;
using program::Program;
using program::Side;

namespace {

constexpr double kLength = 0.010;  // [m]
constexpr double kAngle = 0.2;     // [rad]
constexpr double kShare = 0.25;
constexpr double kLeastRadius = 0.001;  // [m]
constexpr double kFurthest = 0.030;     // that a place may go from where it begins [m]
constexpr double kSmaller = 0.25;       // of its first length, that a radius may become
constexpr double kLarger = 4.0;
constexpr double kLessGain = 0.5;  // of its first
constexpr double kMoreGain = 3.0;

const char* suffix(Side side) { return side == Side::left ? "_L" : side == Side::right ? "_R" : ""; }

std::string without_side(std::string_view name) {
  const bool sided_name = name.ends_with('L') || name.ends_with('R');
  return std::string(sided_name ? name.substr(0, name.size() - 1) : name);
}

}  // namespace

bool moves_points(MuscleKind kind) { return kind != MuscleKind::eyelid && kind != MuscleKind::hinge; }

std::optional<glm::dvec3> landmark_of(const Program& program, const Muscle& muscle, program::StringId id) {
  const std::string name(program.string(id));
  for (const std::string& candidate : {name + suffix(muscle.side), name, name + "_L"}) {
    for (const program::Landmark& mark : program.landmarks) {
      if (program.string(mark.name) == candidate)
        return glm::dvec3(mark.position[0], mark.position[1], mark.position[2]);
    }
  }
  return std::nullopt;
}

glm::dvec3 sided(const float (&offset)[3], Side side) {
  return {(side == Side::right ? -1.0 : 1.0) * static_cast<double>(offset[0]), offset[1], offset[2]};
}

/// Contraction of every muscle when the units are at their maximum: rig.h, contractions().
std::vector<double> contractions_of(const Program& program, std::span<const double> shares,
                                    std::span<const program::ChannelId> units) {
  std::vector<double> sum(program.muscles.size(), 0.0);
  std::vector<double> top(sum.size(), 1.0);
  for (std::size_t a = 0; a < program.actuations.size(); ++a) {
    const auto muscle = static_cast<std::size_t>(program.actuations[a].muscle);
    top[muscle] = std::max(top[muscle], shares[a]);
    for (const program::ChannelId unit : units) {
      if (program.actuations[a].channel == unit) sum[muscle] += shares[a];
    }
  }
  for (std::size_t m = 0; m < sum.size(); ++m) sum[m] = std::clamp(sum[m], 0.0, top[m]);
  return sum;
}

std::string plain_muscle(const Program& program, const Muscle& muscle) {
  std::string_view name = program.string(muscle.name);
  const std::string_view side = suffix(muscle.side);
  if (!side.empty() && name.ends_with(side)) name.remove_suffix(side.size());
  return std::string(name);
}

MuscleParameters::MuscleParameters(const Program& program) : program_(program) {
  muscles_.assign(program.muscles.begin(), program.muscles.end());
  for (const program::Actuation& a : program.actuations) shares_.push_back(static_cast<double>(a.share));
}

std::optional<Failure> MuscleParameters::choose(const ParameterChoice& choice) {
  for (const std::string& name : choice.muscles) {
    const bool known = std::any_of(muscles_.begin(), muscles_.end(),
                                   [&](const Muscle& m) { return plain_muscle(program_, m) == name; });
    if (!known) {
      return Failure{"unknown_muscle", name, "the face has no muscle of that name", "name it without its side"};
    }
  }
  std::set<std::size_t> driven;
  for (const std::vector<program::ChannelId>& units : choice.shown) {
    const std::vector<double> k = contractions_of(program_, shares_, units);
    for (std::size_t m = 0; m < k.size(); ++m) {
      if (k[m] > 0.0) driven.insert(m);
    }
  }
  const auto has = [](const std::vector<std::string>& names, const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  for (const std::size_t m : driven) {
    const Muscle muscle = muscles_[m];
    const std::string name = plain_muscle(program_, muscle);
    if (!moves_points(muscle.kind) && !choice.lids_and_hinges) {
      if (!has(left_out, name)) left_out.push_back(name);
      continue;
    }
    for (const program::StringId mark : {muscle.attachment, muscle.insertion}) {
      if (mark == program::StringId{} || landmark_of(program_, muscle, mark)) continue;
      return Failure{"missing_landmark", name, fmt::format("the face has no landmark '{}'", program_.string(mark)),
                     "give a face that has it"};
    }
    if ((!choice.muscles.empty() && !has(choice.muscles, name)) || has(fitted, name)) continue;
    fitted.push_back(name);
    add_parameters(name, muscle);
    if (choice.fit_shares) add_shares(name, choice);
  }
  if (fitted.empty()) {
    return Failure{"fit_nothing", "fit", "what is shown drives no muscle that is to be fitted",
                   "name units that the face shows, and their muscles"};
  }
  return std::nullopt;
}

void MuscleParameters::set(std::span<const double> values) {
  for (std::size_t i = 0; i < parameters_.size(); ++i) {
    const Parameter& p = parameters_[i];
    if (!p.unit.empty()) {
      for (std::size_t a = 0; a < shares_.size(); ++a) {
        if (is_share(program_.actuations[a], p)) shares_[a] = values[i] * p.scale;
      }
      continue;
    }
    for (Muscle& m : muscles_) {
      if (plain_muscle(program_, m) != p.muscle) continue;
      const float v = static_cast<float>(values[i] * p.scale);
      if (p.place != nullptr) {
        (m.*p.place)[p.axis] = v;
      } else if (p.gap) {
        m.dissipation_radius = m.insertion_radius + v;
      } else {
        if (p.field == &Muscle::insertion_radius) m.dissipation_radius += v - m.insertion_radius;
        m.*p.field = v;
      }
    }
  }
}

bool MuscleParameters::is_share(const program::Actuation& a, const Parameter& p) const {
  return plain_muscle(program_, program_.muscles[static_cast<std::size_t>(a.muscle)]) == p.muscle &&
         without_side(program_.string(program_.channels[static_cast<std::size_t>(a.channel)].name)) == p.unit;
}

void MuscleParameters::add(Parameter p, double value) {
  p.start = value / p.scale;
  p.low = std::min(p.low / p.scale, p.start);
  p.high = std::max(p.high / p.scale, p.start);
  parameters_.push_back(std::move(p));
}

void MuscleParameters::add_place(const std::string& name, const Muscle& m, float (Muscle::*place)[3]) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    // A muscle in the middle stays there.
    if (m.side == Side::none && axis == 0) continue;
    const double value = static_cast<double>((m.*place)[axis]);
    Parameter p;
    p.muscle = name;
    p.place = place;
    p.axis = axis;
    p.scale = kLength;
    p.low = value - kFurthest;
    p.high = value + kFurthest;
    add(std::move(p), value);
  }
}

void MuscleParameters::add_number(const std::string& name, const Muscle& m, float Muscle::*field, double scale,
                                  double low, double high) {
  Parameter p;
  p.muscle = name;
  p.field = field;
  p.scale = scale;
  p.low = low;
  p.high = high;
  add(std::move(p), static_cast<double>(m.*field));
}

void MuscleParameters::add_radius(const std::string& name, const Muscle& m, float Muscle::*field) {
  const double value = static_cast<double>(m.*field);
  add_number(name, m, field, kLength, std::max(kLeastRadius, kSmaller * value), kLarger * value);
}

// It keeps its sign and something of its strength: of two muscles that do the same, none is fitted away.
void MuscleParameters::add_gain(const std::string& name, const Muscle& m, float Muscle::*field, double scale) {
  const double value = static_cast<double>(m.*field);
  if (value == 0.0) return;
  add_number(name, m, field, scale, std::min(kLessGain * value, kMoreGain * value),
             std::max(kLessGain * value, kMoreGain * value));
}

void MuscleParameters::add_gap(const std::string& name, const Muscle& m) {
  const double value = static_cast<double>(m.dissipation_radius - m.insertion_radius);
  Parameter p;
  p.muscle = name;
  p.gap = true;
  p.scale = kLength;
  p.low = std::max(kLeastRadius, kSmaller * value);
  p.high = kLarger * value;
  add(std::move(p), value);
}

// What a muscle does not shift at all stays: a jaw that opens does not go aside.
void MuscleParameters::add_slide(const std::string& name, const Muscle& m) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double value = static_cast<double>(m.slide[axis]);
    if (value == 0.0) continue;
    Parameter p;
    p.muscle = name;
    p.place = &Muscle::slide;
    p.axis = axis;
    p.scale = kLength;
    p.low = std::min(0.0, 3.0 * value);
    p.high = std::max(0.0, 3.0 * value);
    add(std::move(p), value);
  }
}

void MuscleParameters::add_parameters(const std::string& name, const Muscle& muscle) {
  // A radius that is left out is the muscle's own length; from here on it is a number.
  const auto from = landmark_of(program_, muscle, muscle.attachment).value_or(glm::dvec3(0.0)) +
                    sided(muscle.attachment_offset, muscle.side);
  const auto to = muscle.insertion == program::StringId{}
                      ? from
                      : landmark_of(program_, muscle, muscle.insertion).value_or(glm::dvec3(0.0)) +
                            sided(muscle.insertion_offset, muscle.side);
  const glm::dvec3 along = to - from;
  const float length = static_cast<float>(std::sqrt(along.x * along.x + along.y * along.y + along.z * along.z));
  const bool pulls = muscle.kind == MuscleKind::linear || muscle.kind == MuscleKind::sheet;
  const bool swells = muscle.kind == MuscleKind::sphincter || muscle.kind == MuscleKind::bulge;
  Muscle m = muscle;
  for (Muscle& other : muscles_) {
    if (plain_muscle(program_, other) != name) continue;
    if (pulls && other.insertion_radius <= 0.0F) other.insertion_radius = length;
    if (swells && other.major_radius <= 0.0F) other.major_radius = length;
    if (swells && other.minor_radius <= 0.0F) other.minor_radius = other.major_radius;
    if (other.side == muscle.side) m = other;
  }
  const double angle = static_cast<double>(m.angle);
  switch (m.kind) {
    case MuscleKind::linear:
    case MuscleKind::sheet:
      add_place(name, m, &Muscle::attachment_offset);
      if (m.insertion != program::StringId{}) add_place(name, m, &Muscle::insertion_offset);
      add_radius(name, m, &Muscle::insertion_radius);
      add_gap(name, m);
      if (m.kind == MuscleKind::linear) {
        add_number(name, m, &Muscle::angle, kAngle, 0.05, 1.57);
      } else {
        add_radius(name, m, &Muscle::perpendicular_radius);
      }
      add_gain(name, m, &Muscle::limit, kShare);
      return;
    case MuscleKind::sphincter:
    case MuscleKind::bulge:
      add_place(name, m, &Muscle::attachment_offset);
      if (m.insertion != program::StringId{}) add_place(name, m, &Muscle::insertion_offset);
      add_radius(name, m, &Muscle::major_radius);
      add_radius(name, m, &Muscle::minor_radius);
      if (m.kind == MuscleKind::sphincter) add_gain(name, m, &Muscle::limit, kShare);
      add_gain(name, m, &Muscle::amount, kLength);
      return;
    case MuscleKind::roll:
      // It runs to the mouth's corner: that end stays.
      add_place(name, m, &Muscle::attachment_offset);
      add_radius(name, m, &Muscle::insertion_radius);
      add_gap(name, m);
      add_radius(name, m, &Muscle::perpendicular_radius);
      add_number(name, m, &Muscle::angle, kAngle, std::min(0.0, 2.0 * angle), std::max(0.0, 2.0 * angle));
      add_slide(name, m);
      return;
    case MuscleKind::hinge:
      if (angle != 0.0)
        add_number(name, m, &Muscle::angle, kAngle, std::min(0.0, 2.0 * angle), std::max(0.0, 2.0 * angle));
      add_slide(name, m);
      return;
    case MuscleKind::eyelid:
      if (m.closes > 0.0F) {
        add_number(name, m, &Muscle::closes, kShare, 0.0, 1.0);
      } else {
        add_number(name, m, &Muscle::angle, kAngle, std::min(0.0, 2.0 * angle), std::max(0.0, 2.0 * angle));
      }
      return;
  }
}

// The gain and the share of the first unit are one number; those of further units are numbers of their own.
void MuscleParameters::add_shares(const std::string& muscle, const ParameterChoice& choice) {
  std::vector<std::string> units;
  for (const std::vector<program::ChannelId>& shown : choice.shown) {
    for (const program::ChannelId channel : shown) {
      const std::string unit = without_side(program_.string(program_.channels[static_cast<std::size_t>(channel)].name));
      if (std::find(units.begin(), units.end(), unit) != units.end()) continue;
      Parameter p;
      p.muscle = muscle;
      p.unit = unit;
      std::optional<double> share;
      for (std::size_t a = 0; a < shares_.size(); ++a) {
        if (is_share(program_.actuations[a], p)) share = shares_[a];
      }
      if (!share) continue;
      units.push_back(unit);
      if (units.size() == 1) continue;
      p.scale = kShare;
      p.low = 0.0;
      p.high = 2.0;
      add(std::move(p), *share);
    }
  }
}

}  // namespace nms::fit_muscles
