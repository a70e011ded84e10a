#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include <nms/program/failure.h>

namespace nms::runtime {

/// Seams shut by construction.
///
/// Surfaces that meet share a border curve, their *master*. A side of a surface is a stretch of one master, refined to
/// the surface's knots by knot insertion, which is exact; so it is a constant linear function of the master's control
/// points. The end of a master is a node shared with other curves, or a place on another curve. What remains free are
/// the *independent points* x: nodes, inner control points of curves, inner control points of surfaces. Every other
/// control point is a row of the constant matrix S times x; move x as you like, no seam opens.

inline constexpr std::uint32_t kNoIndex = std::numeric_limits<std::uint32_t>::max();

/// One entry of a sparse row over the independent points.
struct RowEntry {
  std::uint32_t point = 0;
  double weight = 0.0;
  friend bool operator==(const RowEntry&, const RowEntry&) = default;
};

/// A sparse row: points ascend, none repeated, weights sum to 1 (to 0 for derivatives).
using Row = std::vector<RowEntry>;

/// Where a master curve's end is: on a node, or on another curve.
struct CurveEnd {
  std::uint32_t node = kNoIndex;   ///< index of a node, or
  std::uint32_t curve = kNoIndex;  ///< index of the curve it lies on
  double at = 0.0;                 ///< parameter on that curve
};

/// A clamped, non-rational B-spline that owns a border.
struct MasterCurve {
  std::string name;
  int degree = 3;
  std::vector<double> knots;
  std::array<CurveEnd, 2> ends;  ///< at the domain's start and end
};

/// A stretch of a master; from > to runs it backwards.
struct SurfaceSide {
  std::uint32_t curve = 0;
  double from = 0.0;
  double to = 0.0;
};

/// A surface of the net. With sides: non-rational, clamped, borders owned by masters. Without: every control point is
/// an independent point, weights allowed.
///
/// Sides go round the border corner to corner: v low with u rising, u high with v rising, v high with u falling,
/// u low with v falling.
struct NetSurface {
  std::string name;
  int degree_u = 3;
  int degree_v = 3;
  std::vector<double> knots_u;
  std::vector<double> knots_v;
  std::vector<double> weights;  ///< u fastest, or empty
  std::optional<std::array<SurfaceSide, 4>> sides;

  std::size_t count_u() const { return knots_u.size() - static_cast<std::size_t>(degree_u) - 1; }
  std::size_t count_v() const { return knots_v.size() - static_cast<std::size_t>(degree_v) - 1; }
};

struct SurfaceNet {
  std::uint32_t node_count = 0;
  std::vector<MasterCurve> curves;
  std::vector<NetSurface> surfaces;
};

/// Whose control point an independent point is.
struct PointOwner {
  enum class Kind : std::uint8_t { node, curve, surface };
  Kind kind = Kind::node;
  std::uint32_t owner = 0;  ///< index of the node, curve or surface
  std::uint32_t index = 0;  ///< control point of it, u fastest; 0 for a node
};

/// The matrix S by rows, for every control point of every curve and surface.
struct Seams {
  std::vector<PointOwner> points;          ///< one for each independent point
  std::vector<std::vector<Row>> curves;    ///< [curve][control point]
  std::vector<std::vector<Row>> surfaces;  ///< [surface][control point], u fastest
};

/// Builds S. A net that contradicts itself is refused: "bad_knots", "missing_curve", "curve_cycle", "open_border",
/// "knots_not_nested"; the place names the curve or surface.
tl::expected<Seams, program::Failure> build_seams(const SurfaceNet& net);

/// sum of weight * row, zeros dropped.
Row combine(std::span<const Row* const> rows, std::span<const double> weights);

/// The curve's point at t as a row; an end that hangs on another curve is that curve's row, bit for bit.
Row curve_row(const SurfaceNet& net, const Seams& seams, std::uint32_t curve, double t);

/// What surface_row returns.
enum class Derivative : std::uint8_t { none, u, v };

/// The surface's point, or a first derivative, at (u, v) as a row. Derivatives of rational surfaces are not offered.
Row surface_row(const SurfaceNet& net, const Seams& seams, std::uint32_t surface, double u, double v,
                Derivative derivative = Derivative::none);

/// The place that owns the curve's point at t: follows ends that hang on other curves. A node has curve == kNoIndex.
CurveEnd canonical_place(const SurfaceNet& net, std::uint32_t curve, double t);

}  // namespace nms::runtime
