#pragma once

#include <cstdint>
#include <span>

#include <nms/program/program.h>

namespace nms::program {

/// Values of every channel of `clip` at `time_ns`; channels that the clip does not speak of keep what `values` holds
/// ("unknown" is not zero).
///
/// For a time now and then: needs nothing but the program. For many times see BoundClip and Player, which give the same
/// bits.
///
/// @param values  in/out, one for each channel of the program; AUs in [0, 1], axes in [-1, 1]   [-]
/// Cost O(curves x log knots). No allocation. Safe from many threads.
void evaluate(const Program& program, const Clip& clip, std::int64_t time_ns, std::span<float> values);

/// The value of one curve. Cost O(log knots).
[[nodiscard]] float evaluate(const Program& program, const Curve& curve, std::int64_t time_ns);

/// Cross-fade of two clips' values, the one merge a runtime does: out = from + (to - from) s(u), s the smooth step.
/// A channel that only one of the two speaks of is faded from or to neutral.
void cross_fade(std::span<const float> from, std::span<const float> to, float u, std::span<float> out);

}  // namespace nms::program
