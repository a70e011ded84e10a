#include "fit_target.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include <nms/runtime/face_file.h>

#include "muscle_fit.h"

namespace nms::fit_muscles {

using program::Failure;

namespace {

constexpr double kWeight_mm = 0.03;  // of a figure that is missed by what is let pass
constexpr double kSize = 0.10;
constexpr double kDirection = 0.17;
constexpr double kArea = 0.4;
constexpr double kLeastArea = 0.01;
constexpr double kGap = 0.15;
constexpr double kLeastGap_mm = 0.7;
constexpr double kWidth = 0.03;
constexpr double kOpening = 0.05;
constexpr double kStill = 0.10;  // of the largest displacement
constexpr double kStillMore = 0.05;

bool all_finite(std::span<const double> values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

/// The channels' values that show a unit, both sides where it has sides.
std::optional<std::vector<float>> values_of(const program::Program& program, std::string_view unit) {
  std::vector<float> values(program.channels.size(), 0.0F);
  bool known = false;
  for (std::size_t c = 0; c < values.size(); ++c) {
    const program::Channel& channel = program.channels[c];
    const std::string name(program.string(channel.name));
    if (channel.kind == program::ChannelKind::axis) {
      if (program.string(channel.positive) == unit) values[c] = 1.0F;
      if (program.string(channel.negative) == unit) values[c] = -1.0F;
    } else if (name == unit || name == fmt::format("{}L", unit) || name == fmt::format("{}R", unit)) {
      values[c] = 1.0F;
    }
    known = known || values[c] != 0.0F;
  }
  return known ? std::optional(std::move(values)) : std::nullopt;
}

}  // namespace

bool FieldTarget::misses(std::span<const program::Muscle> muscles, std::span<const double> shares,
                         std::span<double> out) {
  const std::size_t count = rest_.points.size();
  const double share = 1000.0 / std::sqrt(static_cast<double>(std::max<std::size_t>(count * expressions_.size(), 1)));
  for (std::size_t e = 0; e < expressions_.size(); ++e) {
    const std::vector<glm::dvec3> d = displacements(program_, muscles, shares, rest_, expressions_[e].units);
    for (std::size_t i = 0; i < count; ++i) {
      const glm::dvec3 miss = share * (d[i] - expressions_[e].displacement[i]);
      for (std::size_t k = 0; k < 3; ++k) out[3 * (e * count + i) + k] = miss[static_cast<int>(k)];
    }
  }
  return all_finite(out);
}

FigureTarget::FigureTarget(const program::Program& program, const runtime::Face& face)
    : program_(program), face_(face), gauge_(face, runtime::landmarks_of(face, program)) {}

// Binding costs what its muscles cost: those that no unit drives are left out, but for lids and hinges.
void FigureTarget::keep_driven() {
  std::vector<bool> keep(program_.muscles.size());
  for (std::size_t m = 0; m < keep.size(); ++m) keep[m] = !moves_points(program_.muscles[m].kind);
  for (const Unit& unit : units_) {
    for (const program::Actuation& a : program_.actuations) {
      if (unit.values[static_cast<std::size_t>(a.channel)] > 0.0F) keep[static_cast<std::size_t>(a.muscle)] = true;
    }
  }
  std::vector<std::uint32_t> now(keep.size(), 0);
  for (std::uint32_t m = 0; m < keep.size(); ++m) {
    if (!keep[m]) continue;
    now[m] = static_cast<std::uint32_t>(kept_.size());
    kept_.push_back(m);
  }
  muscles_.resize(kept_.size());
  for (std::uint32_t a = 0; a < program_.actuations.size(); ++a) {
    program::Actuation actuation = program_.actuations[a];
    const auto muscle = static_cast<std::size_t>(actuation.muscle);
    if (!keep[muscle]) continue;
    actuation.muscle = program::MuscleId{now[muscle]};
    actuations_.push_back(actuation);
    actuation_.push_back(a);
  }
}

tl::expected<std::unique_ptr<FigureTarget>, Failure> FigureTarget::create(const program::Program& program,
                                                                          const runtime::Face& face,
                                                                          std::span<const UnitFigures> figures) {
  if (auto rig = runtime::bind(face, program); !rig) return tl::unexpected(rig.error());
  std::unique_ptr<FigureTarget> target(new FigureTarget(program, face));
  const runtime::Landmarks landmarks = runtime::landmarks_of(face, program);
  for (const UnitFigures& f : figures) {
    auto values = values_of(program, f.unit);
    if (!values) {
      return tl::unexpected(Failure{"unknown_unit", f.unit, fmt::format("there is no unit '{}'", f.unit),
                                    "name units as the library does: AU12, AU30L, AU63"});
    }
    Unit unit{f, std::move(*values), glm::dvec3(0.0), {}};
    std::vector<std::string> marks = f.still;
    marks.push_back(f.near);
    for (const std::string& mark : marks) {
      const auto place = landmarks.find(mark);
      if (place == landmarks.end()) {
        return tl::unexpected(Failure{"missing_landmark", f.unit, fmt::format("the face has no landmark '{}'", mark),
                                      "name one that the face has, with its side"});
      }
      unit.near = place->second;
      if (unit.still.size() < f.still.size()) unit.still.push_back(target->gauge_.nearest(place->second));
    }
    target->units_.push_back(std::move(unit));
  }
  target->keep_driven();
  return target;
}

std::vector<std::vector<program::ChannelId>> FigureTarget::shown() const {
  std::vector<std::vector<program::ChannelId>> all;
  for (const Unit& unit : units_) {
    std::vector<program::ChannelId>& channels = all.emplace_back();
    for (std::uint32_t c = 0; c < unit.values.size(); ++c) {
      if (unit.values[c] > 0.0F) channels.push_back(program::ChannelId{c});
    }
  }
  return all;
}

template <typename Use>
bool FigureTarget::each_unit(std::span<const program::Muscle> muscles, std::span<const double> shares, Use use) {
  for (std::size_t m = 0; m < kept_.size(); ++m) muscles_[m] = muscles[kept_[m]];
  for (std::size_t a = 0; a < actuations_.size(); ++a) actuations_[a].share = static_cast<float>(shares[actuation_[a]]);
  program::Program changed = program_;
  changed.muscles = muscles_;
  changed.actuations = actuations_;
  const auto rig = runtime::bind(face_, changed);
  if (!rig) return false;
  runtime::Pose pose = runtime::make_pose(face_, *rig);
  for (std::size_t u = 0; u < units_.size(); ++u) {
    runtime::pose_face(face_, *rig, units_[u].values, pose);
    use(u, pose);
  }
  return true;
}

bool FigureTarget::misses(std::span<const program::Muscle> muscles, std::span<const double> shares,
                          std::span<double> out) {
  std::fill(out.begin(), out.end(), 0.0);
  const bool bound = each_unit(muscles, shares, [&](std::size_t u, const runtime::Pose& pose) {
    const UnitFigures& f = units_[u].figures;
    const UnitMovement m = gauge_.measure_smoothly(pose.positions);
    const std::span<double> row = out.subspan(kRows * u, kRows);
    row[0] = (m.largest_mm / f.largest_mm - 1.0) / kSize;
    for (std::size_t k = 0; k < 3; ++k) {
      const int axis = static_cast<int>(k);
      row[1 + k] = (m.direction[axis] - f.direction[axis]) / kDirection;
    }
    const double off_mm = 1000.0 * glm::distance(m.place, units_[u].near);
    row[4] = std::max(0.0, off_mm - 0.5 * f.reach_mm) / (0.25 * f.reach_mm);
    if (f.area) row[5] = (m.area - *f.area) / (kArea * *f.area + kLeastArea);
    if (f.gap_mm) row[6] = (m.gap_mm - *f.gap_mm) / std::max(kLeastGap_mm, kGap * std::abs(*f.gap_mm));
    if (f.opening) row[7] = (m.opening - *f.opening) / kOpening;
    if (f.width) row[9] = (m.width - *f.width) / kWidth;
    double restless = 0.0;
    for (const std::uint32_t v : units_[u].still) {
      const double moved_mm = 1000.0 * glm::distance(glm::dvec3(pose.positions[v]), gauge_.rest()[v]);
      const double more = std::max(0.0, moved_mm / f.largest_mm - kStill) / kStillMore;
      restless += more * more;
    }
    row[8] = std::sqrt(restless);
    for (double& r : row) r *= kWeight_mm;
  });
  return bound && all_finite(out);
}

std::vector<UnitMovement> FigureTarget::movements(std::span<const program::Muscle> muscles,
                                                  std::span<const double> shares) {
  std::vector<UnitMovement> all(units_.size());
  each_unit(muscles, shares,
            [&](std::size_t u, const runtime::Pose& pose) { all[u] = gauge_.measure(pose.positions); });
  return all;
}

}  // namespace nms::fit_muscles
