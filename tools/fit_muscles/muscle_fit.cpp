#include "muscle_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include <ceres/ceres.h>
#include <fmt/format.h>

#include <nms/runtime/muscle.h>

namespace nms::fit_muscles {

using program::Failure;
using program::Muscle;
using program::MuscleKind;
using program::Program;
using program::Side;

namespace {

// A parameter counts in units of about what it may be off by, so that steps and differences are alike for all.
constexpr double kLength = 0.010;  // [m]
constexpr double kAngle = 0.2;     // [rad]
constexpr double kShare = 0.25;
constexpr double kDifference = 1e-3;    // of those units
constexpr double kLeastRadius = 0.001;  // [m]

bool moves_points(MuscleKind kind) { return kind != MuscleKind::eyelid && kind != MuscleKind::hinge; }

const char* suffix(Side side) { return side == Side::left ? "_L" : side == Side::right ? "_R" : ""; }

std::string without_side(std::string_view name) {
  const bool sided = name.ends_with('L') || name.ends_with('R');
  return std::string(sided ? name.substr(0, name.size() - 1) : name);
}

std::optional<glm::dvec3> landmark(const Program& program, const Muscle& muscle, program::StringId id) {
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

runtime::MusclePlaces places_of(const Program& program, const Muscle& muscle) {
  runtime::MusclePlaces places;
  places.attachment = landmark(program, muscle, muscle.attachment).value_or(glm::dvec3(0.0)) +
                      sided(muscle.attachment_offset, muscle.side);
  places.insertion = places.attachment;
  if (muscle.insertion != program::StringId{}) {
    places.insertion = landmark(program, muscle, muscle.insertion).value_or(glm::dvec3(0.0)) +
                       sided(muscle.insertion_offset, muscle.side);
  }
  return places;
}

std::vector<runtime::Pull> pulls_of(const Program& program, const Muscle& muscle, const RestMesh& rest) {
  return runtime::activation_set(muscle, places_of(program, muscle), rest.points, rest.normals, {});
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

/// One number that is fitted, and where it stands in a muscle.
struct Parameter {
  std::string muscle;              // without side; of a share too
  float Muscle::*field = nullptr;  // a radius, an angle, a gain
  float (Muscle::*place)[3] = nullptr;
  std::size_t axis = 0;  // of the place
  bool gap = false;      // dissipation: counted from the insertion on
  std::string unit;      // of a share, without side
  double scale = kLength;
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  double start = 0.0;
};

/// The muscles, shares and parameters, and what changes with which.
class Model {
 public:
  Model(const Program& program, const RestMesh& rest, std::span<const Expression> expressions)
      : program_(program), rest_(rest), expressions_(expressions) {
    muscles_.assign(program.muscles.begin(), program.muscles.end());
    for (const program::Actuation& a : program.actuations) shares_.push_back(static_cast<double>(a.share));
  }

  std::optional<Failure> choose(const FitSettings& settings) {
    for (const std::string& name : settings.muscles) {
      const bool known = std::any_of(muscles_.begin(), muscles_.end(),
                                     [&](const Muscle& m) { return plain_muscle(program_, m) == name; });
      if (!known) {
        return Failure{"unknown_muscle", name, "the face has no muscle of that name", "name it without its side"};
      }
    }
    std::set<std::size_t> driven;
    for (const Expression& e : expressions_) {
      const std::vector<double> k = contractions_of(program_, shares_, e.units);
      for (std::size_t m = 0; m < k.size(); ++m) {
        if (k[m] > 0.0) driven.insert(m);
      }
    }
    for (const std::size_t m : driven) {
      const Muscle& muscle = muscles_[m];
      const std::string name = plain_muscle(program_, muscle);
      if (!moves_points(muscle.kind)) {
        if (std::find(left_out.begin(), left_out.end(), name) == left_out.end()) left_out.push_back(name);
        continue;
      }
      for (const program::StringId mark : {muscle.attachment, muscle.insertion}) {
        if (mark == program::StringId{} || landmark(program_, muscle, mark)) continue;
        return Failure{"missing_landmark", name, fmt::format("the face has no landmark '{}'", program_.string(mark)),
                       "give a face that has it"};
      }
      const bool wanted = settings.muscles.empty() ||
                          std::find(settings.muscles.begin(), settings.muscles.end(), name) != settings.muscles.end();
      if (!wanted || muscle.kind == MuscleKind::roll) continue;
      if (std::find(fitted.begin(), fitted.end(), name) != fitted.end()) continue;
      fitted.push_back(name);
      add_parameters(name, muscles_[m]);
      if (settings.fit_shares) add_shares(name);
    }
    if (fitted.empty()) {
      return Failure{"fit_nothing", "fit", "the expressions drive no muscle that is to be fitted",
                     "name units that the face shows, and their muscles"};
    }
    return std::nullopt;
  }

  [[nodiscard]] const std::vector<Parameter>& parameters() const { return parameters_; }
  [[nodiscard]] std::size_t residual_count() const { return 3 * rest_.points.size() * expressions_.size(); }

  void set(std::size_t index, double value) {
    const Parameter& p = parameters_[index];
    if (!p.unit.empty()) {
      for (std::size_t a = 0; a < shares_.size(); ++a) {
        if (is_share(program_.actuations[a], p)) shares_[a] = value * p.scale;
      }
      return;
    }
    for (Muscle& m : muscles_) {
      if (plain_muscle(program_, m) != p.muscle) continue;
      const float v = static_cast<float>(value * p.scale);
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

  void set_all(const double* values) {
    for (std::size_t i = 0; i < parameters_.size(); ++i) set(i, values[i]);
  }

  /// What the muscles do to the points in every expression, less what was measured. [mm]
  void misses(std::span<double> out) const {
    const std::size_t count = rest_.points.size();
    for (std::size_t e = 0; e < expressions_.size(); ++e) {
      const std::vector<glm::dvec3> d = displacements(program_, muscles_, shares_, rest_, expressions_[e].units);
      for (std::size_t i = 0; i < count; ++i) {
        const glm::dvec3 miss = 1000.0 * (d[i] - expressions_[e].displacement[i]);
        for (std::size_t k = 0; k < 3; ++k) out[3 * (e * count + i) + k] = miss[static_cast<int>(k)];
      }
    }
  }

  [[nodiscard]] const std::vector<Muscle>& muscles() const { return muscles_; }
  [[nodiscard]] const std::vector<double>& shares() const { return shares_; }

  std::vector<std::string> fitted;
  std::vector<std::string> left_out;

 private:
  bool is_share(const program::Actuation& a, const Parameter& p) const {
    return plain_muscle(program_, program_.muscles[static_cast<std::size_t>(a.muscle)]) == p.muscle &&
           without_side(program_.string(program_.channels[static_cast<std::size_t>(a.channel)].name)) == p.unit;
  }

  void add(Parameter p, double value) {
    p.start = value / p.scale;
    p.low /= p.scale;
    p.high /= p.scale;
    p.start = std::clamp(p.start, p.low, p.high);
    parameters_.push_back(std::move(p));
  }

  void add_place(const std::string& name, const Muscle& m, float (Muscle::*place)[3]) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      // A muscle in the middle stays there.
      if (m.side == Side::none && axis == 0) continue;
      Parameter p;
      p.muscle = name;
      p.place = place;
      p.axis = axis;
      p.low = -0.05;
      p.high = 0.05;
      add(std::move(p), static_cast<double>((m.*place)[axis]));
    }
  }

  void add_number(const std::string& name, const Muscle& m, float Muscle::*field, double scale, double low,
                  double high) {
    Parameter p;
    p.muscle = name;
    p.field = field;
    p.scale = scale;
    p.low = low;
    p.high = high;
    add(std::move(p), static_cast<double>(m.*field));
  }

  void add_parameters(const std::string& name, Muscle& muscle) {
    // A radius that is left out is the muscle's own length; from here on it is a number.
    const runtime::MusclePlaces places = places_of(program_, muscle);
    const glm::dvec3 along = places.insertion - places.attachment;
    const double length = std::sqrt(along.x * along.x + along.y * along.y + along.z * along.z);
    for (Muscle& m : muscles_) {
      if (plain_muscle(program_, m) != name) continue;
      const bool pulls = m.kind == MuscleKind::linear || m.kind == MuscleKind::sheet;
      if (pulls && m.insertion_radius <= 0.0F) m.insertion_radius = static_cast<float>(length);
      if (!pulls && m.major_radius <= 0.0F) m.major_radius = static_cast<float>(length);
      if (!pulls && m.minor_radius <= 0.0F) m.minor_radius = m.major_radius;
    }
    const Muscle m = muscle;
    add_place(name, m, &Muscle::attachment_offset);
    if (m.insertion != program::StringId{}) add_place(name, m, &Muscle::insertion_offset);
    if (m.kind == MuscleKind::linear || m.kind == MuscleKind::sheet) {
      add_number(name, m, &Muscle::insertion_radius, kLength, kLeastRadius, 0.2);
      Parameter gap;
      gap.muscle = name;
      gap.gap = true;
      gap.low = kLeastRadius;
      gap.high = 0.2;
      add(std::move(gap), static_cast<double>(m.dissipation_radius - m.insertion_radius));
      if (m.kind == MuscleKind::linear) {
        add_number(name, m, &Muscle::angle, kAngle, 0.05, 1.57);
      } else {
        add_number(name, m, &Muscle::perpendicular_radius, kLength, kLeastRadius, 0.2);
      }
      add_number(name, m, &Muscle::limit, kShare, 0.0, 2.0);
      return;
    }
    add_number(name, m, &Muscle::major_radius, kLength, kLeastRadius, 0.2);
    add_number(name, m, &Muscle::minor_radius, kLength, kLeastRadius, 0.2);
    if (m.kind == MuscleKind::sphincter) add_number(name, m, &Muscle::limit, kShare, 0.0, 1.0);
    add_number(name, m, &Muscle::amount, kLength, -0.1, 0.1);
  }

  // The gain and the share of the first unit are one number; those of further units are numbers of their own.
  void add_shares(const std::string& muscle) {
    std::vector<std::string> units;
    for (const Expression& e : expressions_) {
      for (const program::ChannelId channel : e.units) {
        const std::string unit =
            without_side(program_.string(program_.channels[static_cast<std::size_t>(channel)].name));
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

  const Program& program_;
  const RestMesh& rest_;
  std::span<const Expression> expressions_;
  std::vector<Muscle> muscles_;
  std::vector<double> shares_;  // one for each actuation
  std::vector<Parameter> parameters_;
};

/// All residuals as one function of all parameters.
class Misses : public ceres::CostFunction {
 public:
  Misses(Model& model, double stiffness) : model_(model) {
    const std::size_t parameters = model.parameters().size();
    set_num_residuals(static_cast<int>(model.residual_count() + parameters));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(parameters));
    stiff_ = std::sqrt(stiffness);
  }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const std::size_t n = model_.parameters().size();
    const std::size_t rows = model_.residual_count() + n;
    fill(parameters[0], {residuals, rows});
    if (jacobians == nullptr || jacobians[0] == nullptr) return true;
    std::vector<double> x(parameters[0], parameters[0] + n);
    std::vector<double> above(rows);
    std::vector<double> below(rows);
    for (std::size_t i = 0; i < n; ++i) {
      const double at = x[i];
      x[i] = at + kDifference;
      fill(x.data(), above);
      x[i] = at - kDifference;
      fill(x.data(), below);
      x[i] = at;
      for (std::size_t r = 0; r < rows; ++r) jacobians[0][r * n + i] = (above[r] - below[r]) / (2.0 * kDifference);
    }
    return true;
  }

 private:
  void fill(const double* x, std::span<double> out) const {
    model_.set_all(x);
    const std::size_t count = model_.residual_count();
    model_.misses(out.first(count));
    const double per_point = 1.0 / std::sqrt(static_cast<double>(std::max<std::size_t>(count, 1)) / 3.0);
    for (std::size_t r = 0; r < count; ++r) out[r] *= per_point;
    for (std::size_t i = 0; i < model_.parameters().size(); ++i) {
      out[count + i] = stiff_ * (x[i] - model_.parameters()[i].start);
    }
  }

  Model& model_;
  double stiff_ = 0.0;
};

struct Sizes {
  double rms_mm = 0.0;
  double max_mm = 0.0;
};

Sizes sizes_of(std::span<const double> triples_mm) {
  Sizes sizes;
  double sum = 0.0;
  for (std::size_t i = 0; i + 2 < triples_mm.size(); i += 3) {
    double squared = 0.0;
    for (std::size_t k = 0; k < 3; ++k) squared += triples_mm[i + k] * triples_mm[i + k];
    sum += squared;
    sizes.max_mm = std::max(sizes.max_mm, std::sqrt(squared));
  }
  if (!triples_mm.empty()) sizes.rms_mm = std::sqrt(sum / (static_cast<double>(triples_mm.size()) / 3.0));
  return sizes;
}

}  // namespace

std::string plain_muscle(const Program& program, const Muscle& muscle) {
  std::string_view name = program.string(muscle.name);
  const std::string_view side = suffix(muscle.side);
  if (!side.empty() && name.ends_with(side)) name.remove_suffix(side.size());
  return std::string(name);
}

std::vector<glm::dvec3> displacements(const Program& program, std::span<const Muscle> muscles,
                                      std::span<const double> shares, const RestMesh& rest,
                                      std::span<const program::ChannelId> units) {
  std::vector<glm::dvec3> sum(rest.points.size(), glm::dvec3(0.0));
  const std::vector<double> k = contractions_of(program, shares, units);
  for (std::size_t m = 0; m < muscles.size(); ++m) {
    if (k[m] == 0.0 || !moves_points(muscles[m].kind)) continue;
    for (const runtime::Pull& pull : pulls_of(program, muscles[m], rest)) sum[pull.point] += k[m] * pull.displacement;
  }
  return sum;
}

tl::expected<FitResult, Failure> fit_muscles(const Program& program, const RestMesh& rest,
                                             std::span<const Expression> expressions, const FitSettings& settings) {
  Model model(program, rest, expressions);
  if (auto failure = model.choose(settings)) return tl::unexpected(std::move(*failure));

  FitResult result;
  std::vector<double> misses(model.residual_count());
  const std::size_t per_expression = 3 * rest.points.size();
  model.misses(misses);
  for (std::size_t e = 0; e < expressions.size(); ++e) {
    const Sizes sizes = sizes_of(std::span(misses).subspan(e * per_expression, per_expression));
    FitError error;
    error.expression = expressions[e].name;
    error.before_rms_mm = sizes.rms_mm;
    error.before_max_mm = sizes.max_mm;
    std::vector<double> measured;
    for (const glm::dvec3& d : expressions[e].displacement)
      measured.insert(measured.end(), {1e3 * d.x, 1e3 * d.y, 1e3 * d.z});
    error.measured_rms_mm = sizes_of(measured).rms_mm;
    result.errors.push_back(std::move(error));
  }

  std::vector<double> x;
  for (const Parameter& p : model.parameters()) x.push_back(p.start);
  ceres::Problem problem;
  problem.AddResidualBlock(new Misses(model, settings.stiffness), nullptr, x.data());
  for (std::size_t i = 0; i < x.size(); ++i) {
    problem.SetParameterLowerBound(x.data(), static_cast<int>(i), model.parameters()[i].low);
    problem.SetParameterUpperBound(x.data(), static_cast<int>(i), model.parameters()[i].high);
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  options.logging_type = ceres::SILENT;
  options.max_num_iterations = settings.most_steps;
  options.num_threads = 1;  // the same steps on every run
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);

  model.set_all(x.data());
  model.misses(misses);
  for (std::size_t e = 0; e < expressions.size(); ++e) {
    const Sizes sizes = sizes_of(std::span(misses).subspan(e * per_expression, per_expression));
    result.errors[e].after_rms_mm = sizes.rms_mm;
    result.errors[e].after_max_mm = sizes.max_mm;
  }
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Parameter& p = model.parameters()[i];
    if (!p.unit.empty()) result.shares.push_back({p.unit, p.muscle, x[i] * p.scale});
  }
  result.muscles = model.muscles();
  result.fitted = model.fitted;
  result.left_out = model.left_out;
  return result;
}

}  // namespace nms::fit_muscles
