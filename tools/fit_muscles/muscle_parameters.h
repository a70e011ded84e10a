#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <nms/program/failure.h>
#include <glm/vec3.hpp>

#include <nms/program/program.h>

namespace nms::fit_muscles {

/// One number that is fitted, and where it stands in a muscle. It counts in units of about what it may be off by, so
/// that steps and differences are alike for all: 10 mm, 0.2 rad, a quarter of a share.
struct Parameter {
  std::string muscle;                            ///< without side; of a share too
  float program::Muscle::*field = nullptr;       ///< a radius, an angle, a gain
  float (program::Muscle::*place)[3] = nullptr;  ///< an offset, a slide
  std::size_t axis = 0;                          ///< of the place
  bool gap = false;                              ///< dissipation: counted from the insertion on
  std::string unit;                              ///< of a share, without side
  double scale = 1.0;                            ///< [m], [rad] or [-]
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  double start = 0.0;
};

/// What may be fitted, and what of it.
struct ParameterChoice {
  std::vector<std::string> muscles;                    ///< without side; empty: all that are driven
  std::vector<std::vector<program::ChannelId>> shown;  ///< units that each of the targets shows
  bool fit_shares = true;                              ///< of units that a muscle serves beside the first
  bool lids_and_hinges = false;                        ///< they move no points by themselves, but a whole face
};

/// All muscles and shares of a program, those chosen as one vector of numbers.
class MuscleParameters {
 public:
  explicit MuscleParameters(const program::Program& program);

  /// Failures: unknown_muscle, missing_landmark, fit_nothing.
  [[nodiscard]] std::optional<program::Failure> choose(const ParameterChoice& choice);

  void set(std::span<const double> values);

  [[nodiscard]] const program::Program& program() const { return program_; }
  [[nodiscard]] const std::vector<Parameter>& parameters() const { return parameters_; }
  [[nodiscard]] const std::vector<program::Muscle>& muscles() const { return muscles_; }
  [[nodiscard]] const std::vector<double>& shares() const { return shares_; }  ///< one for each actuation

  std::vector<std::string> fitted;    ///< names without side, in the program's order
  std::vector<std::string> left_out;  ///< driven, but not to be fitted by what is measured

 private:
  bool is_share(const program::Actuation& a, const Parameter& p) const;
  void add(Parameter p, double value);
  void add_place(const std::string& name, const program::Muscle& m, float (program::Muscle::*place)[3]);
  void add_number(const std::string& name, const program::Muscle& m, float program::Muscle::*field, double scale,
                  double low, double high);
  void add_radius(const std::string& name, const program::Muscle& m, float program::Muscle::*field);
  void add_gain(const std::string& name, const program::Muscle& m, float program::Muscle::*field, double scale);
  void add_gap(const std::string& name, const program::Muscle& m);
  void add_slide(const std::string& name, const program::Muscle& m);
  void add_parameters(const std::string& name, const program::Muscle& muscle);
  void add_shares(const std::string& muscle, const ParameterChoice& choice);

  const program::Program& program_;
  std::vector<program::Muscle> muscles_;
  std::vector<double> shares_;
  std::vector<Parameter> parameters_;
};

/// Contraction of every muscle when the units are at their maximum: rig.h, contractions().
[[nodiscard]] std::vector<double> contractions_of(const program::Program& program, std::span<const double> shares,
                                                  std::span<const program::ChannelId> units);

/// A muscle's name without its side.
[[nodiscard]] std::string plain_muscle(const program::Program& program, const program::Muscle& muscle);

/// Whether the muscle moves points by itself: not lids and hinges.
[[nodiscard]] bool moves_points(program::MuscleKind kind);

/// A landmark by a muscle's word for it.
[[nodiscard]] std::optional<glm::dvec3> landmark_of(const program::Program& program, const program::Muscle& muscle,
                                                    program::StringId id);

/// An offset, x away from the midline on the muscle's side.
[[nodiscard]] glm::dvec3 sided(const float (&offset)[3], program::Side side);

}  // namespace nms::fit_muscles
