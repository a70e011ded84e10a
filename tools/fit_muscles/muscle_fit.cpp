#include "muscle_fit.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include <ceres/ceres.h>
#include <fmt/format.h>

#include <nms/runtime/muscle.h>

namespace nms::fit_muscles {

using program::Failure;
using program::Muscle;
using program::Program;
using program::Side;

namespace {

constexpr double kDifference = 4e-3;  // for derivatives, of what a parameter may be off by

runtime::MusclePlaces places_of(const Program& program, const Muscle& muscle) {
  runtime::MusclePlaces places;
  places.attachment = landmark_of(program, muscle, muscle.attachment).value_or(glm::dvec3(0.0)) +
                      sided(muscle.attachment_offset, muscle.side);
  places.insertion = places.attachment;
  if (muscle.insertion != program::StringId{}) {
    places.insertion = landmark_of(program, muscle, muscle.insertion).value_or(glm::dvec3(0.0)) +
                       sided(muscle.insertion_offset, muscle.side);
  }
  return places;
}

/// How much of the muscle's pull each point takes; empty: all of it, or the mesh knows no regions.
std::vector<float> weights_of(const Program& program, const Muscle& muscle, const RestMesh& rest) {
  const auto region = [&](program::StringId id) -> const std::vector<float>* {
    if (id == program::StringId{}) return nullptr;
    const std::string name(program.string(id));
    const char* side = muscle.side == Side::left ? "_left" : muscle.side == Side::right ? "_right" : "";
    for (const std::string& candidate : {name + side, name}) {
      if (const auto it = rest.regions.find(candidate); it != rest.regions.end()) return &it->second;
    }
    return nullptr;
  };
  std::vector<float> weights;
  if (const auto* only = region(muscle.region)) weights = *only;
  if (const auto* except = region(muscle.except)) {
    if (weights.empty()) weights.assign(rest.points.size(), 1.0F);
    for (std::size_t i = 0; i < weights.size(); ++i) weights[i] *= 1.0F - (*except)[i];
  }
  return weights;
}

std::vector<runtime::Pull> pulls_of(const Program& program, const Muscle& muscle, const RestMesh& rest) {
  return runtime::activation_set(muscle, places_of(program, muscle), rest.points, rest.normals,
                                 weights_of(program, muscle, rest));
}

/// All rows as one function of all parameters.
class Misses : public ceres::CostFunction {
 public:
  Misses(MuscleParameters& model, std::span<const std::unique_ptr<FitTarget>> targets, double stiffness)
      : model_(model), targets_(targets), stiff_(std::sqrt(stiffness)) {
    for (const auto& target : targets) rows_ += target->row_count();
    rows_ += model.parameters().size();
    set_num_residuals(static_cast<int>(rows_));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(model.parameters().size()));
  }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const std::size_t n = model_.parameters().size();
    std::vector<double> x(parameters[0], parameters[0] + n);
    if (!fill(x, {residuals, rows_})) return false;
    if (jacobians == nullptr || jacobians[0] == nullptr) return true;
    std::vector<double> above(rows_);
    std::vector<double> below(rows_);
    for (std::size_t i = 0; i < n; ++i) {
      const double at = x[i];
      x[i] = at + kDifference;
      if (!fill(x, above)) return false;
      x[i] = at - kDifference;
      if (!fill(x, below)) return false;
      x[i] = at;
      for (std::size_t r = 0; r < rows_; ++r) jacobians[0][r * n + i] = (above[r] - below[r]) / (2.0 * kDifference);
    }
    return true;
  }

 private:
  bool fill(std::span<const double> x, std::span<double> out) const {
    model_.set(x);
    for (const auto& target : targets_) {
      if (!target->misses(model_.muscles(), model_.shares(), out.first(target->row_count()))) return false;
      out = out.subspan(target->row_count());
    }
    for (std::size_t i = 0; i < x.size(); ++i) out[i] = stiff_ * (x[i] - model_.parameters()[i].start);
    return true;
  }

  MuscleParameters& model_;
  std::span<const std::unique_ptr<FitTarget>> targets_;
  double stiff_ = 0.0;
  std::size_t rows_ = 0;
};

struct Sizes {
  double rms_mm = 0.0;
  double max_mm = 0.0;
};

Sizes sizes_of(std::span<const glm::dvec3> metres) {
  Sizes sizes;
  double sum = 0.0;
  for (const glm::dvec3& d : metres) {
    const double squared = 1e6 * (d.x * d.x + d.y * d.y + d.z * d.z);
    sum += squared;
    sizes.max_mm = std::max(sizes.max_mm, std::sqrt(squared));
  }
  if (!metres.empty()) sizes.rms_mm = std::sqrt(sum / static_cast<double>(metres.size()));
  return sizes;
}

/// What the muscles miss of a field.
Sizes field_error(const MuscleParameters& model, const RestMesh& rest, const Expression& field) {
  std::vector<glm::dvec3> d = displacements(model.program(), model.muscles(), model.shares(), rest, field.units);
  for (std::size_t i = 0; i < d.size(); ++i) d[i] -= field.displacement[i];
  return sizes_of(d);
}

}  // namespace

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

tl::expected<FitResult, Failure> fit_muscles(const Program& program, const Measured& measured,
                                             const FitSettings& settings) {
  std::vector<std::unique_ptr<FitTarget>> targets;
  ParameterChoice choice;
  choice.muscles = settings.muscles;
  choice.fit_shares = settings.fit_shares;
  for (const Expression& field : measured.fields) choice.shown.push_back(field.units);
  if (!measured.fields.empty()) {
    targets.push_back(std::make_unique<FieldTarget>(program, *measured.rest, measured.fields));
  }
  FigureTarget* figures = nullptr;
  if (!measured.figures.empty()) {
    auto made = FigureTarget::create(program, *measured.face, measured.figures);
    if (!made) return tl::unexpected(made.error());
    figures = made->get();
    targets.push_back(std::move(*made));
    for (auto& shown : figures->shown()) choice.shown.push_back(std::move(shown));
    choice.lids_and_hinges = true;
  }
  MuscleParameters model(program);
  if (auto failure = model.choose(choice)) return tl::unexpected(std::move(*failure));

  FitResult result;
  for (const Expression& field : measured.fields) {
    const Sizes before = field_error(model, *measured.rest, field);
    result.errors.push_back({field.name, sizes_of(field.displacement).rms_mm, before.rms_mm, 0.0, before.max_mm, 0.0});
  }
  if (figures != nullptr) {
    const auto before = figures->movements(model.muscles(), model.shares());
    for (std::size_t u = 0; u < before.size(); ++u) result.figures.push_back({measured.figures[u], before[u], {}});
  }

  std::vector<double> x;
  for (const Parameter& p : model.parameters()) x.push_back(p.start);
  ceres::Problem problem;
  problem.AddResidualBlock(new Misses(model, targets, settings.stiffness), nullptr, x.data());
  for (std::size_t i = 0; i < x.size(); ++i) {
    problem.SetParameterLowerBound(x.data(), static_cast<int>(i), model.parameters()[i].low);
    problem.SetParameterUpperBound(x.data(), static_cast<int>(i), model.parameters()[i].high);
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  options.logging_type = ceres::SILENT;
  options.max_num_iterations = settings.most_steps;
  options.function_tolerance = settings.precision;
  options.num_threads = 1;  // the same steps on every run
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);

  model.set(x);
  for (std::size_t e = 0; e < measured.fields.size(); ++e) {
    const Sizes after = field_error(model, *measured.rest, measured.fields[e]);
    result.errors[e].after_rms_mm = after.rms_mm;
    result.errors[e].after_max_mm = after.max_mm;
  }
  if (figures != nullptr) {
    const auto after = figures->movements(model.muscles(), model.shares());
    for (std::size_t u = 0; u < after.size(); ++u) result.figures[u].after = after[u];
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
