#pragma once

#include <cstdint>
#include <vector>

#include "curve.h"

/// What a curve does over a span of time, decided on its cubics: between any two samples it may do something else.
namespace nms::compiler {

struct Moment {
  std::int64_t time_ns = 0;
  double value = 0.0;
};

/// Values that are allowed: [low, high]; or, `outside`, all others.
struct Bounds {
  double low = 0.0;
  double high = 0.0;
  bool outside = false;
};

struct Verdict {
  bool holds = true;
  Moment first;   ///< where it first does not hold
  Moment worst;   ///< where it is farthest from holding
  Moment before;  ///< of `rising`: the value that it should not have gone back from
};

/// Whether the curve's value is allowed at every time of [from, to].
[[nodiscard]] Verdict stays(const Curve& curve, std::int64_t from_ns, std::int64_t to_ns, const Bounds& bounds);

/// Whether the curve ends higher than it starts and never goes back by more than `slack` on its way.
[[nodiscard]] Verdict rises(const Curve& curve, std::int64_t from_ns, std::int64_t to_ns, double slack);

struct TimeRange {
  std::int64_t start_ns = 0;
  std::int64_t end_ns = 0;
};

/// Where the curve is `level` or more between its first and its last knot, in order of time.
[[nodiscard]] std::vector<TimeRange> ranges_at_least(const Curve& curve, double level);

}  // namespace nms::compiler
