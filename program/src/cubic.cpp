#include "cubic.h"

namespace nms::program {
namespace {

Cubic constant(float value) {
  Cubic cubic;
  cubic.d = value;
  return cubic;
}

}  // namespace

Cubic cubic_from(const Program& program, const Curve& curve, std::size_t knot) {
  const Knot& here = program.knots[knot];
  if (here.shape == kShapeHold || knot + 1 == std::size_t{curve.first_knot} + curve.knot_count) {
    return constant(here.value);
  }
  const Knot& next = program.knots[knot + 1];
  if (next.time_ns() == here.time_ns()) {
    return constant(here.value);
  }
  Cubic cubic;
  cubic.start = static_cast<double>(here.time_ns());
  cubic.rate = 1.0 / static_cast<double>(next.time_ns() - here.time_ns());
  const double v0 = here.value;
  const double rise = static_cast<double>(next.value) - v0;
  cubic.d = v0;
  if (here.shape == kShapeLinear) {
    cubic.c = rise;
  } else if (here.shape == kShapeSmooth) {
    cubic.b = 3.0 * rise;
    cubic.a = -2.0 * rise;
  } else {
    const Handles& inner = program.handles_of(curve, here);
    cubic.c = 3.0 * (inner.b1 - v0);
    cubic.b = 3.0 * (static_cast<double>(inner.b2) - inner.b1) - cubic.c;
    cubic.a = rise - cubic.c - cubic.b;
  }
  return cubic;
}

Cubic cubic_before(const Program& program, const Curve& curve) {
  return constant(program.knots[curve.first_knot].value);
}

}  // namespace nms::program
