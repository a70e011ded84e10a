#include "curve_features.h"

#include <algorithm>
#include <cmath>

#include <nms/program/evaluate.h>

namespace nms::program {
namespace {

/// A swing turns back by more than this.
constexpr double kSwing = 0.01;

struct Point {
  std::int64_t time_ns = 0;
  double value = 0.0;
};

double magnitude(double value) { return value < 0.0 ? -value : value; }

/// Inner Bézier values of a segment.
Handles inner(const Program& p, const Curve& curve, const Knot& knot, const Knot& next) {
  if (knot.shape < kShapeFirstReserved) return p.handles_of(curve, knot);
  if (knot.shape == kShapeHold) return {knot.value, knot.value};
  if (knot.shape == kShapeSmooth) return {knot.value, next.value};
  const float third = (next.value - knot.value) / 3.0F;
  return {knot.value + third, next.value - third};
}

/// Adds the turning points inside a segment: where the derivative, a quadratic in u, is 0.
void add_turning_points(const Program& p, const Curve& curve, const Knot& knot, const Knot& next,
                        std::vector<Point>& out) {
  if (knot.shape >= kShapeFirstReserved) return;  // those go one way only
  const Handles h = inner(p, curve, knot, next);
  const double d0 = static_cast<double>(h.b1) - knot.value;
  const double d1 = static_cast<double>(h.b2) - h.b1;
  const double d2 = static_cast<double>(next.value) - h.b2;
  const double a = d0 - 2.0 * d1 + d2;
  const double b = 2.0 * (d1 - d0);
  double roots[2] = {-1.0, -1.0};
  if (magnitude(a) < 1e-12) {
    if (magnitude(b) > 1e-12) roots[0] = -d0 / b;
  } else if (const double root = b * b - 4.0 * a * d0; root > 0.0) {
    roots[0] = (-b - std::sqrt(root)) / (2.0 * a);
    roots[1] = (-b + std::sqrt(root)) / (2.0 * a);
    if (roots[0] > roots[1]) std::swap(roots[0], roots[1]);
  }
  for (const double u : roots) {
    if (!(u > 1e-6 && u < 1.0 - 1e-6)) continue;
    const auto t =
        knot.time_ns() + static_cast<std::int64_t>(u * static_cast<double>(next.time_ns() - knot.time_ns()));
    out.push_back({t, static_cast<double>(evaluate(p, curve, t))});
  }
}

/// Knots and turning points: between two of them the curve goes one way.
std::vector<Point> outline(const Program& p, const Curve& curve) {
  const auto knots = p.knots.subspan(curve.first_knot, curve.knot_count);
  std::vector<Point> out;
  for (std::size_t i = 0; i < knots.size(); ++i) {
    out.push_back({knots[i].time_ns(), static_cast<double>(knots[i].value)});
    if (i + 1 == knots.size()) break;
    add_turning_points(p, curve, knots[i], knots[i + 1], out);
    // A step holds up to its end.
    if (knots[i].shape == kShapeHold) out.push_back({knots[i + 1].time_ns(), static_cast<double>(knots[i].value)});
  }
  return out;
}

/// How often the outline goes away from rest and turns back by more than kSwing.
int count_swings(const std::vector<Point>& outline) {
  int swings = 0;
  double low = 0.0;   // the nearest to rest since the last swing
  double high = 0.0;  // the farthest since then
  bool away = false;
  int side = 0;
  for (const Point& p : outline) {
    const int here = p.value > 0.0 ? 1 : p.value < 0.0 ? -1 : side;
    const double v = magnitude(p.value);
    if (here != side) {  // through rest
      if (away) ++swings;
      away = false;
      side = here;
      low = 0.0;
    }
    if (away) {
      high = std::max(high, v);
      if (high - v > kSwing) {
        ++swings;
        away = false;
        low = v;
      }
    } else {
      low = std::min(low, v);
      if (v - low > kSwing) {
        away = true;
        high = v;
      }
    }
  }
  return swings + (away ? 1 : 0);
}

}  // namespace

CurveFeatures curve_features(const Program& program, const Curve& curve, double rest) {
  const std::vector<Point> points = outline(program, curve);
  CurveFeatures f;
  for (const Point& p : points)
    if (magnitude(p.value) > magnitude(f.peak)) f.peak = p.value;
  f.swings = count_swings(points);
  if (magnitude(f.peak) <= rest) return f;
  std::size_t first = points.size();
  std::size_t last = 0;
  bool at_peak = false;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (magnitude(points[i].value) > rest) {
      first = std::min(first, i);
      last = i;
    }
    if (magnitude(points[i].value) < magnitude(f.peak) - rest || (points[i].value < 0.0) != (f.peak < 0.0)) continue;
    if (!at_peak) f.apex_ns = points[i].time_ns;
    at_peak = true;
    f.release_ns = points[i].time_ns;
  }
  f.onset_ns = points[first == 0 ? 0 : first - 1].time_ns;
  f.offset_ns = points[std::min(last + 1, points.size() - 1)].time_ns;
  return f;
}

double largest_difference(const Program& a, const Curve& of_a, const Program& b, const Curve& of_b,
                          std::int64_t slack_ns) {
  std::vector<std::int64_t> times;
  for (const Knot& k : a.knots.subspan(of_a.first_knot, of_a.knot_count)) times.push_back(k.time_ns());
  for (const Knot& k : b.knots.subspan(of_b.first_knot, of_b.knot_count)) times.push_back(k.time_ns());
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  const auto value = [](const Program& p, const Curve& curve, std::int64_t t) {
    return static_cast<double>(evaluate(p, curve, t));
  };
  constexpr int kBetween = 8;
  double most = 0.0;
  for (std::size_t i = 0; i < times.size(); ++i)
    for (int k = 0; k < (i + 1 < times.size() ? kBetween : 1); ++k) {
      const std::int64_t step = i + 1 < times.size() ? (times[i + 1] - times[i]) / kBetween : 0;
      const std::int64_t t = times[i] + k * step;
      const double own = value(a, of_a, t);
      const double other[3] = {value(b, of_b, t - slack_ns), value(b, of_b, t), value(b, of_b, t + slack_ns)};
      const double low = std::min({other[0], other[1], other[2]});
      const double high = std::max({other[0], other[1], other[2]});
      most = std::max({most, own - high, low - own});
    }
  return most;
}

}  // namespace nms::program
