#pragma once

#include <array>
#include <cstddef>
#include <utility>

namespace nms::compiler {

/// A cubic in Bézier form over u in [0, 1].
struct Cubic {
  double p0 = 0.0, p1 = 0.0, p2 = 0.0, p3 = 0.0;

  [[nodiscard]] double value(double u) const {
    const double v = 1.0 - u;
    return ((v * v * v * p0 + 3.0 * v * v * u * p1) + 3.0 * v * u * u * p2) + u * u * u * p3;
  }
  [[nodiscard]] double derivative(double u) const {
    const double v = 1.0 - u;
    return 3.0 * (v * v * (p1 - p0) + 2.0 * v * u * (p2 - p1) + u * u * (p3 - p2));
  }
  [[nodiscard]] bool constant() const { return p0 == p1 && p1 == p2 && p2 == p3; }
};

/// Where f, of opposite signs at `lo` and `hi`, is 0. Bisected: no libm, same bits everywhere.
template <typename Function>
[[nodiscard]] double bisected(const Function& f, double lo, double hi) {
  const bool low_negative = f(lo) < 0.0;
  for (int i = 0; i < 60; ++i) {
    const double mid = 0.5 * (lo + hi);
    if ((f(mid) < 0.0) == low_negative)
      lo = mid;
    else
      hi = mid;
  }
  return 0.5 * (lo + hi);
}

/// [0, 1] in pieces on each of which a cubic only rises or only falls: their edges, rising, and how many pieces.
struct MonotonePieces {
  std::array<double, 4> edge{0.0, 1.0, 1.0, 1.0};
  std::size_t count = 1;
};

[[nodiscard]] inline MonotonePieces monotone_pieces(const Cubic& c) {
  const double q0 = c.p1 - c.p0, q1 = c.p2 - c.p1, q2 = c.p3 - c.p2;
  const auto slope = [&](double u) {
    const double v = 1.0 - u;
    return v * v * q0 + 2.0 * v * u * q1 + u * u * q2;
  };
  MonotonePieces out;
  // The vertex of the slope, a quadratic, splits [0, 1] into pieces with at most one sign change of it each.
  const double denominator = q0 - 2.0 * q1 + q2;
  double vertex = denominator == 0.0 ? 2.0 : (q0 - q1) / denominator;
  if (!(vertex > 0.0 && vertex < 1.0)) vertex = 1.0;
  for (const auto& [lo, hi] : {std::pair{0.0, vertex}, std::pair{vertex, 1.0}})
    if (lo < hi && (slope(lo) < 0.0) != (slope(hi) < 0.0)) out.edge[out.count++] = bisected(slope, lo, hi);
  out.edge[out.count] = 1.0;
  return out;
}

}  // namespace nms::compiler
