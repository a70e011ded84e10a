#pragma once

#include <cstdint>

#include <nms/program/program.h>

namespace nms::program {

/// A segment in power form: ((a u + b) u + c) u + d, u = (t - start) rate.
///
/// Times are whole nanoseconds below 2^53, so t - start is exact in double, and u = 0 only at the start: there the
/// value is d, the knot's own, to the bit. At its end the next segment has begun. In between the sum is of doubles in
/// one fixed order, and is right to half a unit of the float it is rounded to, all but always: the same bits on every
/// machine, with SIMD or without, as long as no multiplication is contracted with an addition.
struct Cubic {
  double start = 0.0;  ///< [ns]
  double rate = 0.0;   ///< 1 / length; of a constant 0  [1/ns]
  double a = 0.0;
  double b = 0.0;
  double c = 0.0;
  double d = 0.0;
};

/// @param time_ns  a whole number
[[nodiscard]] inline float value_of(double start, double rate, double a, double b, double c, double d, double time_ns) {
  const double u = (time_ns - start) * rate;
  return static_cast<float>(((a * u + b) * u + c) * u + d);
}

/// Inner control values may lie outside a channel's range, its values may not.
[[nodiscard]] inline float held(float value, float low) {
  const float above = value > low ? value : low;
  return above < 1.0F ? above : 1.0F;
}

[[nodiscard]] inline float held_value(const Cubic& cubic, float low, double time_ns) {
  return held(value_of(cubic.start, cubic.rate, cubic.a, cubic.b, cubic.c, cubic.d, time_ns), low);
}

[[nodiscard]] inline float lowest(const Program& program, const Curve& curve) {
  return program.channels[static_cast<std::size_t>(curve.channel)].kind == ChannelKind::axis ? -1.0F : 0.0F;
}

/// What holds from a knot, an index into the knot table, up to its curve's next.
/// @pre knot is of curve
[[nodiscard]] Cubic cubic_from(const Program& program, const Curve& curve, std::size_t knot);

/// What holds before the curve's first knot.
[[nodiscard]] Cubic cubic_before(const Program& program, const Curve& curve);

}  // namespace nms::program
