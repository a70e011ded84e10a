#include "curve_course.h"

#include <algorithm>

#include "cubic.h"

namespace nms::compiler {
namespace {

/// A stretch on which the curve only rises or only falls: u in [u0, u1] of a cubic that begins at `time_ns`.
struct Run {
  Cubic cubic;
  std::int64_t time_ns = 0;
  double length_ns = 0.0;
  double u0 = 0.0;
  double u1 = 0.0;

  [[nodiscard]] Moment at(double u) const {
    return {time_ns + static_cast<std::int64_t>(u * length_ns + 0.5), cubic.value(u)};
  }
  [[nodiscard]] Moment start() const { return at(u0); }
  [[nodiscard]] Moment end() const { return at(u1); }
  /// Where it passes a level that lies between its ends.
  [[nodiscard]] Moment passes(double level) const {
    return at(bisected([&](double u) { return cubic.value(u) - level; }, u0, u1));
  }
};

Run instant(const Curve& curve, std::int64_t time_ns) {
  const double v = curve.value(time_ns);
  return {{v, v, v, v}, time_ns, 0.0, 0.0, 0.0};
}

/// All runs of [from, to] in order, its ends by themselves too. A run's end before a jump is a value that the curve
/// comes as near to as one likes, and counts.
template <typename Visit>
void for_each_run(const Curve& curve, std::int64_t from, std::int64_t to, Visit visit) {
  visit(instant(curve, from));
  for (std::size_t i = 0; i + 1 < curve.knots.size(); ++i) {
    const CurveKnot& left = curve.knots[i];
    const CurveKnot& right = curve.knots[i + 1];
    const std::int64_t begin = std::max(left.time_ns, from);
    const std::int64_t end = std::min(right.time_ns, to);
    if (begin >= end) continue;
    const double length = static_cast<double>(right.time_ns - left.time_ns);
    const double first = static_cast<double>(begin - left.time_ns) / length;
    const double last = end == right.time_ns ? 1.0 : static_cast<double>(end - left.time_ns) / length;
    Run run{{left.value, left.b1, left.b2, right.value}, left.time_ns, length, 0.0, 0.0};
    const MonotonePieces pieces = monotone_pieces(run.cubic);
    for (std::size_t p = 0; p < pieces.count; ++p) {
      run.u0 = std::max(pieces.edge[p], first);
      run.u1 = std::min(pieces.edge[p + 1], last);
      if (run.u0 < run.u1) visit(run);
    }
  }
  visit(instant(curve, to));
}

}  // namespace

Verdict stays(const Curve& curve, std::int64_t from_ns, std::int64_t to_ns, const Bounds& bounds) {
  Verdict verdict;
  double most = 0.0;
  // How far a value is from being allowed; negative where it is.
  const auto excess = [&](double v) {
    return bounds.outside ? std::min(v - bounds.low, bounds.high - v) : std::max(bounds.low - v, v - bounds.high);
  };
  const auto bad = [&](double v) { return bounds.outside ? excess(v) >= 0.0 : excess(v) > 0.0; };
  const auto note = [&](const Moment& m) {
    if (verdict.holds) {
      verdict.holds = false;
      verdict.first = verdict.worst = m;
      most = excess(m.value);
    } else if (excess(m.value) > most) {
      verdict.worst = m;
      most = excess(m.value);
    }
  };
  for_each_run(curve, from_ns, to_ns, [&](const Run& run) {
    const Moment start = run.start();
    const Moment end = run.end();
    if (bad(start.value)) note(start);
    if (verdict.holds) {
      const bool from_below = start.value < bounds.low;
      const bool from_above = start.value > bounds.high;
      if (bounds.outside) {
        if (from_below && end.value >= bounds.low) note(run.passes(bounds.low));
        if (from_above && end.value <= bounds.high) note(run.passes(bounds.high));
      } else if (bad(end.value)) {
        note(run.passes(end.value < bounds.low ? bounds.low : bounds.high));
      }
    }
    if (bad(end.value)) note(end);
  });
  return verdict;
}

Verdict rises(const Curve& curve, std::int64_t from_ns, std::int64_t to_ns, double slack) {
  Verdict verdict;
  Moment top{from_ns, curve.value(from_ns)};
  double most = slack;
  const auto drop = [&](const Moment& m) {
    if (verdict.holds) {
      verdict.holds = false;
      verdict.first = m;
      verdict.before = top;
      verdict.worst = m;
    }
    if (top.value - m.value > most) {
      most = top.value - m.value;
      verdict.worst = m;
    }
  };
  for_each_run(curve, from_ns, to_ns, [&](const Run& run) {
    const Moment start = run.start();
    const Moment end = run.end();
    if (start.value > top.value) top = start;
    if (top.value - start.value > slack) drop(start);
    if (top.value - end.value > slack) {
      if (verdict.holds) drop(run.passes(top.value - slack));
      drop(end);
    }
    if (end.value > top.value) top = end;
  });
  if (!verdict.holds) return verdict;
  // Rounding is no rise.
  constexpr double kLeast = 1e-6;
  const Moment end{to_ns, curve.value(to_ns)};
  verdict.before = {from_ns, curve.value(from_ns)};
  verdict.holds = end.value > verdict.before.value + kLeast;
  if (!verdict.holds) verdict.first = verdict.worst = end;
  return verdict;
}

std::vector<TimeRange> ranges_at_least(const Curve& curve, double level) {
  std::vector<TimeRange> out;
  if (curve.empty()) return out;
  bool inside = false;
  const auto enter = [&](const Moment& m) {
    if (!inside) out.push_back({m.time_ns, m.time_ns});
    inside = true;
  };
  const auto leave = [&](const Moment& m) {
    if (inside) out.back().end_ns = m.time_ns;
    inside = false;
  };
  for_each_run(curve, curve.knots.front().time_ns, curve.knots.back().time_ns, [&](const Run& run) {
    const Moment start = run.start();
    const Moment end = run.end();
    start.value >= level ? enter(start) : leave(start);
    if (start.value < level && end.value >= level) enter(run.passes(level));
    if (start.value >= level && end.value < level) leave(run.passes(level));
  });
  leave({curve.knots.back().time_ns, 0.0});
  return out;
}

}  // namespace nms::compiler
