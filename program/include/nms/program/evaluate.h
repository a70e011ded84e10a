#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <nms/program/program.h>

namespace nms::program {

/// Values of every channel of `clip` at `time_ns`; channels that the clip does not speak of keep what `values` holds
/// ("unknown" is not zero).
///
/// @param values  in/out, one for each channel of the program; AUs in [0, 1], axes in [-1, 1]   [-]
/// Cost O(curves x log knots). No allocation. Safe from many threads.
void evaluate(const Program& program, const Clip& clip, std::int64_t time_ns, std::span<float> values);

/// The value of one curve. Cost O(log knots).
[[nodiscard]] float evaluate(const Program& program, const Curve& curve, std::int64_t time_ns);

/// The value of one knot's segment at a time inside it; `next` is the knot after it.
[[nodiscard]] float segment_value(const Program& program, const Knot& knot, const Knot& next, std::int64_t time_ns);

/// Sequential play: costs only what changes from one time to the next. Going back, or far ahead, is a seek: a search,
/// never a replay. Gives the same bits as `evaluate`.
class Player {
 public:
  /// @pre program and clip outlive the player; clip is of the program
  Player(const Program& program, const Clip& clip);
  /// As `evaluate`.
  void advance(std::int64_t time_ns, std::span<float> values);

 private:
  const Program* program_;
  const Clip* clip_;
  std::vector<std::uint32_t> current_;  ///< for each curve of the clip: the knot at or before the time, or kNone
  std::uint32_t next_play_ = 0;         ///< first knot of the play list after the time
  std::int64_t time_ns_ = 0;
  bool placed_ = false;
};

/// Cross-fade of two clips' values, the one merge a runtime does: out = from + (to - from) s(u), s the smooth step.
/// A channel that only one of the two speaks of is faded from or to neutral.
void cross_fade(std::span<const float> from, std::span<const float> to, float u, std::span<float> out);

}  // namespace nms::program
