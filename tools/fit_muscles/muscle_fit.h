#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include <nms/program/failure.h>
#include <nms/program/program.h>

#include "displacement_fields.h"
#include "fit_target.h"
#include "muscle_parameters.h"

namespace nms::fit_muscles {

/// Fits muscles to what was measured: displacement fields, figures, or both.
///
/// With p a point at rest, d_e(p) where expression e takes it, u_m(p; x) what muscle m does to it at full contraction,
/// and k_me the muscle's contraction (its shares of the expression's units summed, stopped at the top as in the
/// runtime), the parameters x of the muscles and their shares make
///   sum over e, p of |sum_m k_me u_m(p; x) - d_e(p)|^2 / P  +  what figures are missed by (fit_target.h)
///   +  stiffness sum over i of ((x_i - x_i0) / s_i)^2
/// least (Levenberg and Marquardt, by Ceres; derivatives by central differences). x are attachment and insertion,
/// angle, radii, slide and gain; s_i is how far a parameter is expected to be off: 10 mm, 0.2 rad, a quarter of a
/// share. A muscle of two sides has one set of parameters. Lids and hinges are fitted to figures, not to fields.
struct FitSettings {
  std::vector<std::string> muscles;  ///< those that are fitted, without side; empty: all that the expressions drive
  double stiffness = 1e-4;           ///< [mm^2]
  int most_steps = 60;
  double precision = 1e-4;  ///< the fit ends where a step makes less of the sum smaller than this share
  bool fit_shares = true;   ///< of units that a muscle serves beside the first
};

/// What is fitted to; either may be empty.
struct Measured {
  const RestMesh* rest = nullptr;  ///< of the fields
  std::span<const Expression> fields;
  const runtime::Face* face = nullptr;  ///< of the figures
  std::span<const UnitFigures> figures;
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

/// A unit's figures, and what the muscles make of them.
struct FigureError {
  UnitFigures measured;
  UnitMovement before;
  UnitMovement after;
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
  std::vector<FitError> errors;          ///< one for each field
  std::vector<FigureError> figures;      ///< one for each unit
  std::vector<std::string> left_out;     ///< lids and hinges that fields drive, where there are no figures
};

/// Failures: fit_nothing (what was measured drives no muscle that is to be fitted), unknown_muscle, missing_landmark,
/// those of FigureTarget::create().
[[nodiscard]] tl::expected<FitResult, program::Failure> fit_muscles(const program::Program& program,
                                                                    const Measured& measured,
                                                                    const FitSettings& settings = {});

/// What the muscles of the program, changed or not, do to the points.
/// @param shares  one for each of program.actuations
[[nodiscard]] std::vector<glm::dvec3> displacements(const program::Program& program,
                                                    std::span<const program::Muscle> muscles,
                                                    std::span<const double> shares, const RestMesh& rest,
                                                    std::span<const program::ChannelId> units);

/// What was missed by before and after, a line for each field and unit: "AU12: rms 1.492 mm -> 0.000 mm, ...".
[[nodiscard]] std::vector<std::string> report_lines(const FitResult& result);

/// The fitted muscles as the language writes them, with what they missed by before and after.
[[nodiscard]] std::string muscle_text(const program::Program& program, const FitResult& result);

}  // namespace nms::fit_muscles
