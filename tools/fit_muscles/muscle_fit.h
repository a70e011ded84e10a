#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include <nms/program/failure.h>
#include <nms/program/program.h>

#include "displacement_fields.h"

namespace nms::fit_muscles {

/// Fits muscles to displacements that were measured.
///
/// With p a point at rest, d_e(p) where expression e takes it, u_m(p; x) what muscle m does to it at full contraction,
/// and k_me the muscle's contraction (its shares of the expression's units summed, stopped at the top as in the
/// runtime), the parameters x of the muscles and their shares make
///   sum over e, p of |sum_m k_me u_m(p; x) - d_e(p)|^2 / P  +  stiffness sum over i of ((x_i - x_i0) / s_i)^2
/// least (Levenberg and Marquardt, by Ceres; derivatives by central differences). x are attachment and insertion,
/// angle, radii and gain; s_i is how far a parameter is expected to be off: 10 mm, 0.2 rad, a quarter of a share. A
/// muscle of two sides has one set of parameters.
struct FitSettings {
  std::vector<std::string> muscles;  ///< those that are fitted, without side; empty: all that the expressions drive
  double stiffness = 1e-4;           ///< [mm^2]
  int most_steps = 60;
  bool fit_shares = true;  ///< of units that a muscle serves beside the first
};

/// How far the muscles are from an expression.
struct FitError {
  std::string expression;
  double measured_rms_mm = 0.0;  ///< of the displacements themselves: what no muscles at all would miss
  double before_rms_mm = 0.0;
  double after_rms_mm = 0.0;
  double before_max_mm = 0.0;
  double after_max_mm = 0.0;
};

struct FittedShare {
  std::string unit;    ///< without side
  std::string muscle;  ///< without side
  double share = 0.0;
};

struct FitResult {
  std::vector<program::Muscle> muscles;  ///< all of the program's, those fitted changed
  std::vector<std::string> fitted;       ///< their names, without side, in the program's order
  std::vector<FittedShare> shares;       ///< that were fitted
  std::vector<FitError> errors;          ///< one for each expression
  std::vector<std::string> left_out;  ///< muscles the expressions drive that move no points by themselves: lids, hinges
};

/// Failures: fit_nothing (no expression drives a muscle that is to be fitted), unknown_muscle, missing_landmark.
[[nodiscard]] tl::expected<FitResult, program::Failure> fit_muscles(const program::Program& program,
                                                                    const RestMesh& rest,
                                                                    std::span<const Expression> expressions,
                                                                    const FitSettings& settings = {});

/// What the muscles of the program, changed or not, do to the points.
/// @param shares  one for each of program.actuations
[[nodiscard]] std::vector<glm::dvec3> displacements(const program::Program& program,
                                                    std::span<const program::Muscle> muscles,
                                                    std::span<const double> shares, const RestMesh& rest,
                                                    std::span<const program::ChannelId> units);

/// A muscle's name without its side.
[[nodiscard]] std::string plain_muscle(const program::Program& program, const program::Muscle& muscle);

/// The fitted muscles as the language writes them, with what they missed by before and after.
[[nodiscard]] std::string muscle_text(const program::Program& program, const FitResult& result);

}  // namespace nms::fit_muscles
