#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace nms::fit_face {

/// A border curve, drawn along the scan's edges and diagonals.
struct LayoutCurve {
  std::string name;
  bool feature = false;                                 ///< follows a ridge of the scan: never smoothed
  bool midline = false;                                 ///< stays on x = 0
  std::vector<std::pair<std::uint32_t, double>> knots;  ///< the scan's vertex, parameter
  std::vector<std::uint32_t> vertices;                  ///< all, from end to end
};

/// A surface: four stretches of border curves, corner to corner.
struct LayoutSurface {
  struct Side {
    std::string curve;
    double from = 0.0;
    double to = 0.0;
  };
  std::string name;
  std::uint32_t samples_u = 1;  ///< vertices per span
  std::uint32_t samples_v = 1;
  std::string part;
  std::array<Side, 4> sides;
};

struct Layout {
  std::vector<LayoutCurve> curves;
  std::vector<LayoutSurface> surfaces;
};

/// Reads layout.txt, which says in its head how it is written. Ends the program where it cannot.
Layout read_layout(const std::string& path);

}  // namespace nms::fit_face
