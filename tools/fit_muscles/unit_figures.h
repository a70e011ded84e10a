#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <glm/vec3.hpp>
#include <tl/expected.hpp>

#include <nms/program/failure.h>

namespace nms::fit_muscles {

/// What was measured of a face that shows a unit at its maximum, where no displacement field is at hand.
struct UnitFigures {
  std::string unit;           ///< "AU12"; of an axis one of its ends: "AU63"
  double largest_mm = 0.0;    ///< displacement of the visible skin, on the subject's left half
  glm::dvec3 direction{0.0};  ///< of that, unit length; +x the subject's left, +y up, +z forward
  std::string near;           ///< the landmark it is near
  double reach_mm = 0.0;      ///< how far from it the largest displacement may be
  std::optional<double>
      area;  ///< share of the face's surface that moves by more than a fifth of the largest, in (0, 1]
  std::optional<double> gap_mm;    ///< change of the distance between the lips, in the middle
  std::optional<double> width;     ///< change of the mouth's width, as a share of that at rest
  std::optional<double> opening;   ///< of the left eye, as a share of that at rest
  std::vector<std::string> still;  ///< landmarks that hardly move: by less than a tenth of the largest (ours)
  bool own = false;                ///< set down by us, after what the FACS manual says moves, and not measured
};

/// A table, one unit a line, fields between blanks, `-` for none, `#` before a remark:
///   unit  largest-mm  x  y  z  near  reach-mm  area-%  gap-mm  width-%  opening-%  still,...  measured|own
/// Failures: figures_bad_line (place names file and line), figures_twice, figures_none.
[[nodiscard]] tl::expected<std::vector<UnitFigures>, program::Failure> read_unit_figures(std::string_view text,
                                                                                         std::string_view name);

}  // namespace nms::fit_muscles
