#include <nms/program/evaluate.h>

#include <algorithm>
#include <cassert>
#include <cstddef>

/// A cubic Bézier segment over [t0, t1], u = (t - t0) / (t1 - t0):
///   B(u) = (1-u)^3 v0 + 3(1-u)^2 u b1 + 3(1-u) u^2 b2 + u^3 v1.
/// Times are int64 nanoseconds below 2^53, so t - t0 and t1 - t0 are exact in double, and u = 0 only at t0. B is summed
/// by de Casteljau in float32: six steps a + (b - a) u, each the same on every processor, which keep a constant
/// constant. At both ends the knots' own values are returned, to the bit.
namespace nms::program {
namespace {

float mix(float a, float b, float u) { return a + (b - a) * u; }

float smooth_step(float u) { return u * u * (3.0F - 2.0F * u); }

/// The last of the curve's knots at or before the time, or kNone.
std::uint32_t knot_at(const Program& program, const Curve& curve, std::int64_t time_ns) {
  const auto knots = program.knots.subspan(curve.first_knot, curve.knot_count);
  const auto after = std::upper_bound(knots.begin(), knots.end(), time_ns,
                                      [](std::int64_t time, const Knot& knot) { return time < knot.time_ns; });
  return after == knots.begin() ? kNone : curve.first_knot + static_cast<std::uint32_t>(after - knots.begin()) - 1;
}

/// The curve's value at a time whose knot, see `knot_at`, is known. What both ways of evaluation share.
float curve_value(const Program& program, const Curve& curve, std::uint32_t knot, std::int64_t time_ns) {
  if (knot == kNone) {
    return program.knots[curve.first_knot].value;
  }
  const Knot& here = program.knots[knot];
  if (here.shape == kShapeHold || knot + 1 == curve.first_knot + curve.knot_count) {
    return here.value;
  }
  const float value = segment_value(program, here, program.knots[knot + 1], time_ns);
  const bool is_axis = program.channels[static_cast<std::size_t>(curve.channel)].kind == ChannelKind::axis;
  return std::clamp(value, is_axis ? -1.0F : 0.0F, 1.0F);  // inner control values may lie outside
}

}  // namespace

float segment_value(const Program& program, const Knot& knot, const Knot& next, std::int64_t time_ns) {
  if (time_ns >= next.time_ns) {
    return next.value;
  }
  if (time_ns <= knot.time_ns || knot.shape == kShapeHold) {
    return knot.value;
  }
  const auto u = static_cast<float>(static_cast<double>(time_ns - knot.time_ns) /
                                    static_cast<double>(next.time_ns - knot.time_ns));
  if (knot.shape == kShapeLinear) {
    return mix(knot.value, next.value, u);
  }
  if (knot.shape == kShapeSmooth) {
    return mix(knot.value, next.value, smooth_step(u));
  }
  const Handles& inner = program.handles[knot.shape];
  const float a = mix(knot.value, inner.b1, u);
  const float b = mix(inner.b1, inner.b2, u);
  const float c = mix(inner.b2, next.value, u);
  return mix(mix(a, b, u), mix(b, c, u), u);
}

void evaluate(const Program& program, const Clip& clip, std::int64_t time_ns, std::span<float> values) {
  assert(values.size() == program.channels.size());
  for (const Curve& curve : program.curves.subspan(clip.first_curve, clip.curve_count)) {
    values[static_cast<std::size_t>(curve.channel)] =
        evaluate(program, curve, time_ns);
  }
}

float evaluate(const Program& program, const Curve& curve, std::int64_t time_ns) {
  return curve_value(program, curve, knot_at(program, curve, time_ns), time_ns);
}

Player::Player(const Program& program, const Clip& clip)
    : program_(&program), clip_(&clip), current_(clip.curve_count, kNone) {}

void Player::advance(std::int64_t time_ns, std::span<float> values) {
  const Program& program = *program_;
  assert(values.size() == program.channels.size());
  const auto curves = program.curves.subspan(clip_->first_curve, clip_->curve_count);
  const auto plays = program.plays.subspan(clip_->first_play, clip_->play_count);
  const auto play_time = [&](std::size_t play) { return program.knots[plays[play]].time_ns; };

  // Past about one knot a curve, one search for each curve is cheaper than to walk.
  const std::size_t far_play = std::size_t{next_play_} + curves.size();
  const bool is_far = far_play < plays.size() && play_time(far_play) <= time_ns;
  if (!placed_ || time_ns < time_ns_ || is_far) {
    for (std::size_t c = 0; c < curves.size(); ++c) {
      current_[c] = knot_at(program, curves[c], time_ns);
    }
    const auto after =
        std::upper_bound(plays.begin(), plays.end(), time_ns,
                         [&](std::int64_t time, std::uint32_t knot) { return time < program.knots[knot].time_ns; });
    next_play_ = static_cast<std::uint32_t>(after - plays.begin());
  } else {
    for (; next_play_ < plays.size() && play_time(next_play_) <= time_ns; ++next_play_) {
      const std::uint32_t knot = plays[next_play_];
      const auto after =
          std::upper_bound(curves.begin(), curves.end(), knot,
                           [](std::uint32_t index, const Curve& curve) { return index < curve.first_knot; });
      current_[static_cast<std::size_t>(after - curves.begin()) - 1] = knot;
    }
  }
  placed_ = true;
  time_ns_ = time_ns;
  for (std::size_t c = 0; c < curves.size(); ++c) {
    values[static_cast<std::size_t>(curves[c].channel)] = curve_value(program, curves[c], current_[c], time_ns);
  }
}

void cross_fade(std::span<const float> from, std::span<const float> to, float u, std::span<float> out) {
  assert(from.size() == to.size() && to.size() == out.size());
  const float s = u > 0.0F ? smooth_step(std::min(u, 1.0F)) : 0.0F;  // a NaN stays with `from`
  for (std::size_t i = 0; i < out.size(); ++i) {
    const float a = from[i];
    const float b = to[i];
    // Rounding may pass an end by a bit; a fade never leaves what it fades between.
    out[i] = s >= 1.0F ? b : std::clamp(mix(a, b, s), std::min(a, b), std::max(a, b));
  }
}

}  // namespace nms::program
