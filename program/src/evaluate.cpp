#include <nms/program/evaluate.h>

#include <algorithm>
#include <cassert>
#include <cstddef>

#include "cubic.h"

namespace nms::program {
namespace {

float smooth_step(float u) { return u * u * (3.0F - 2.0F * u); }

/// What holds for a curve at a time.
Cubic cubic_at(const Program& program, const Curve& curve, std::int64_t time_ns) {
  const auto knots = program.knots.subspan(curve.first_knot, curve.knot_count);
  const auto after = std::upper_bound(knots.begin(), knots.end(), time_ns,
                                      [](std::int64_t time, const Knot& knot) { return time < knot.time_ns(); });
  if (after == knots.begin()) {
    return cubic_before(program, curve);
  }
  return cubic_from(program, curve, curve.first_knot + static_cast<std::size_t>(after - knots.begin()) - 1);
}

}  // namespace

void evaluate(const Program& program, const Clip& clip, std::int64_t time_ns, std::span<float> values) {
  assert(values.size() == program.channels.size());
  for (const Curve& curve : program.curves.subspan(clip.first_curve, clip.curve_count)) {
    values[static_cast<std::size_t>(curve.channel)] =
        evaluate(program, curve, time_ns);
  }
}

float evaluate(const Program& program, const Curve& curve, std::int64_t time_ns) {
  return held_value(cubic_at(program, curve, time_ns), lowest(program, curve), static_cast<double>(time_ns));
}

void cross_fade(std::span<const float> from, std::span<const float> to, float u, std::span<float> out) {
  assert(from.size() == to.size() && to.size() == out.size());
  const float s = u > 0.0F ? smooth_step(std::min(u, 1.0F)) : 0.0F;  // a NaN stays with `from`
  for (std::size_t i = 0; i < out.size(); ++i) {
    const float a = from[i];
    const float b = to[i];
    // Rounding may pass an end by a bit; a fade never leaves what it fades between.
    out[i] = s >= 1.0F ? b : std::clamp(a + (b - a) * s, std::min(a, b), std::max(a, b));
  }
}

}  // namespace nms::program
