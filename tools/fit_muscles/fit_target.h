#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include <nms/program/failure.h>
#include <nms/program/program.h>
#include <nms/runtime/face.h>
#include <nms/runtime/rig.h>

#include "displacement_fields.h"
#include "unit_figures.h"
#include "unit_movement.h"

namespace nms::fit_muscles {

/// Something that was measured, and by how much muscles miss it. What they miss is in millimetres or counts like them,
/// so that different things can stand side by side.
class FitTarget {
 public:
  FitTarget() = default;
  FitTarget(const FitTarget&) = delete;
  FitTarget& operator=(const FitTarget&) = delete;
  virtual ~FitTarget() = default;

  [[nodiscard]] virtual std::size_t row_count() const = 0;
  /// Their squares' sum is what the fit makes least.
  /// @param out  row_count() numbers [mm]
  /// @return false: these muscles do nothing that can be measured (a number that is none)
  virtual bool misses(std::span<const program::Muscle> muscles, std::span<const double> shares,
                      std::span<double> out) = 0;
};

/// Displacement fields: rows are the differences at the points, over the root of the points' number.
class FieldTarget : public FitTarget {
 public:
  FieldTarget(const program::Program& program, const RestMesh& rest, std::span<const Expression> expressions)
      : program_(program), rest_(rest), expressions_(expressions) {}

  [[nodiscard]] std::size_t row_count() const override { return 3 * rest_.points.size() * expressions_.size(); }
  bool misses(std::span<const program::Muscle> muscles, std::span<const double> shares, std::span<double> out) override;

 private:
  const program::Program& program_;
  const RestMesh& rest_;
  std::span<const Expression> expressions_;
};

/// Figures, measured on a whole face as the runtime moves it: regions, lids, jaw and rolling lips count.
///
/// A figure that is missed by what is let pass counts as 0.03 mm rms of a field. Let pass are: 10 % of the size, 10
/// degrees, a quarter of the reach beyond its half, two fifths of the area (and 1 % of the face), 15 % of the lips' gap
/// (at least 0.7 mm), 3 % of the mouth's width, 5 % of the eye's opening, and a tenth of the largest displacement, and
/// half as much again, where the face should be still.
class FigureTarget : public FitTarget {
 public:
  /// Failures: unknown_unit, missing_landmark, those of runtime::bind().
  static tl::expected<std::unique_ptr<FigureTarget>, program::Failure> create(const program::Program& program,
                                                                              const runtime::Face& face,
                                                                              std::span<const UnitFigures> figures);

  [[nodiscard]] std::size_t row_count() const override { return kRows * units_.size(); }
  bool misses(std::span<const program::Muscle> muscles, std::span<const double> shares, std::span<double> out) override;

  /// As measured, not smoothed.
  std::vector<UnitMovement> movements(std::span<const program::Muscle> muscles, std::span<const double> shares);

  /// Channels that each unit's muscles hang on.
  [[nodiscard]] std::vector<std::vector<program::ChannelId>> shown() const;

 private:
  static constexpr std::size_t kRows = 10;

  struct Unit {
    UnitFigures figures;
    std::vector<float> values;         // of the channels
    glm::dvec3 near{0.0};              // [m]
    std::vector<std::uint32_t> still;  // vertices
  };

  FigureTarget(const program::Program& program, const runtime::Face& face);
  void keep_driven();
  template <typename Use>
  bool each_unit(std::span<const program::Muscle> muscles, std::span<const double> shares, Use use);

  const program::Program& program_;
  const runtime::Face& face_;
  MovementGauge gauge_;
  std::vector<Unit> units_;
  std::vector<std::uint32_t> kept_;             // of the program's muscles, those that are bound
  std::vector<program::Muscle> muscles_;        // the same, changed
  std::vector<program::Actuation> actuations_;  // theirs
  std::vector<std::uint32_t> actuation_;        // of the program, for each of these
};

}  // namespace nms::fit_muscles
