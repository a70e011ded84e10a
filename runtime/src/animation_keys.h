#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include <nms/program/program.h>

namespace nms::runtime {

/// Keys of one glTF animation sampler with LINEAR interpolation.
struct Keys {
  std::vector<float> times;   ///< strictly ascending, from 0                [s]
  std::vector<float> values;  ///< width for each time
};

/// How values between two keys are read.
enum class Interpolation : std::uint8_t { linear, slerp };

/// Moments of a clip where some curve may bend or jump: its ends, every knot, and 1 ms before each jump. Ascending.
[[nodiscard]] std::vector<std::int64_t> break_times(const program::Program& program, const program::Clip& clip);

/// Keys such that interpolation stays within `tolerance` of `signal`: of each value (linear), or in radians (slerp of
/// quaternions x y z w). Intervals between `breaks` are halved until that holds, down to 1 ms; then keys that the
/// others imply are dropped.
/// @param breaks ascending, at least one   [ns]
/// @param looks  within each interval: 5, or 3 where a look is dear and the sum of all is measured afterwards
/// @param tolerance  linear: one for each value; slerp: one   [-], [rad]
[[nodiscard]] Keys fit_keys(std::span<const std::int64_t> breaks, Interpolation interpolation,
                            std::span<const double> tolerance,
                            const std::function<void(std::int64_t, std::span<float>)>& signal, std::size_t looks = 5);

}  // namespace nms::runtime
