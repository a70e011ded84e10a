#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

namespace nms::runtime {

/// NURBS curves and surfaces of any degree, after Piegl and Tiller, "The NURBS Book", 2nd edition (1997).
///
/// A knot vector of n control points and degree p has n + p + 1 entries, never falling, and its domain is
/// [knots[p], knots[n]]. Parameters outside the domain are clamped to it. Coordinates are metres throughout.

/// Highest degree the evaluators take.
inline constexpr int kMaxNurbsDegree = 15;

/// The p + 1 basis functions that do not vanish on one span, and their first derivatives.
struct BasisValues {
  std::size_t first = 0;  ///< index of the control point that value[0] belongs to
  int degree = 0;
  double value[kMaxNurbsDegree + 1] = {};       ///< degree + 1 used, sum 1
  double derivative[kMaxNurbsDegree + 1] = {};  ///< degree + 1 used, sum 0   [1 / knot]
};

struct NurbsCurve {
  int degree = 3;
  std::vector<double> knots;       ///< points.size() + degree + 1
  std::vector<glm::dvec3> points;  ///< control points                       [m]
  std::vector<double> weights;     ///< one for each point, or empty: all 1
};

struct NurbsSurface {
  int degree_u = 3;
  int degree_v = 3;
  std::size_t count_u = 0;
  std::size_t count_v = 0;
  std::vector<double> knots_u;     ///< count_u + degree_u + 1
  std::vector<double> knots_v;     ///< count_v + degree_v + 1
  std::vector<glm::dvec3> points;  ///< count_u * count_v, u runs fastest, as in X3D    [m]
  std::vector<double> weights;     ///< one for each point, or empty: all 1
};

struct CurveSample {
  glm::dvec3 point;
  glm::dvec3 tangent;  ///< dC/du, not normalised
};

struct SurfaceSample {
  glm::dvec3 point;
  glm::dvec3 du;  ///< dS/du
  glm::dvec3 dv;  ///< dS/dv; outside is where cross(du, dv) points
};

/// What is wrong with a knot vector, or nothing: wrong length, falling, not finite, an empty domain, or an inner knot
/// of a multiplicity above the degree (the curve would fall apart).
std::optional<std::string> knot_fault(std::span<const double> knots, int degree, std::size_t point_count);

/// 0 .. spans in steps of 1, ends repeated degree + 1 times.
std::vector<double> clamped_uniform_knots(int degree, std::size_t spans);

/// The span [knots[i], knots[i + 1]) that holds u (A2.1); the last non-empty one at the domain's end.
std::size_t find_span(std::span<const double> knots, int degree, double u);

/// Basis functions and first derivatives at u (A2.2, A2.3).
/// @pre !knot_fault(knots, degree, knots.size() - degree - 1), degree in [1, kMaxNurbsDegree]
BasisValues basis(std::span<const double> knots, int degree, double u);

/// The distinct knots of the domain, ascending: the borders of the spans.
std::vector<double> span_borders(std::span<const double> knots, int degree);

/// A4.1 and A4.2, first derivative.
CurveSample evaluate(const NurbsCurve& curve, double u);

/// A4.3 and A4.4, first derivatives.
SurfaceSample evaluate(const NurbsSurface& surface, double u, double v);

}  // namespace nms::runtime
