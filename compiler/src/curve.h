#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

/// Piecewise cubic curves over integer nanoseconds, and the few operators that merging is made of.
///
/// A curve is a list of knots; segment i runs from knot i to knot i + 1 as the cubic Bézier (v_i, b1_i, b2_i, v_{i+1}).
/// Before the first knot the first value holds, after the last the last. Two knots may share a time: a jump.
/// Addition, maximum and clamping are exact (knots are added where two cubics cross); only products are fitted.
namespace nms::compiler {

/// Largest error of a fitted product: 0.1 % of an action unit, halved for rounding and merging once more.
inline constexpr double kFitTolerance = 5e-4;

struct CurveKnot {
  std::int64_t time_ns = 0;
  double value = 0.0;
  double b1 = 0.0;  ///< inner control values of the segment that starts here; the last knot's are unused
  double b2 = 0.0;
  std::uint32_t source = 0xFFFFFFFFU;  ///< index into the clip's table of sources
};

struct Curve {
  std::vector<CurveKnot> knots;

  [[nodiscard]] bool empty() const { return knots.empty(); }
  [[nodiscard]] double value(std::int64_t time_ns) const;
};

/// The easings of the language, by name.
enum class Easing : std::uint8_t { smooth, linear, cosine, step, spring };

/// The easing of an envelope: how far a thing has come does not swing past its end.
[[nodiscard]] constexpr Easing settled(Easing easing) { return easing == Easing::spring ? Easing::smooth : easing; }

/// Appends the way from the curve's last knot to (time, value) by an easing. A curve without knots starts there.
/// Source: of the segment, kept on the knot that starts it.
void ease_to(Curve& curve, std::int64_t time_ns, double value, Easing easing, std::uint32_t source);

/// The curve up to a time at which it has begun, exactly; it ends with a knot there.
[[nodiscard]] Curve until(const Curve& curve, std::int64_t time_ns);
/// The curve from a time on, exactly; it begins with a knot there, unless it begins later.
[[nodiscard]] Curve since(Curve curve, std::int64_t time_ns);
/// How many cubics `ease_to` appends at most, all between the two values. Nothing: it has to be drawn to say.
[[nodiscard]] std::optional<std::size_t> most_pieces(Easing easing);

[[nodiscard]] Curve scaled(Curve curve, double factor);
[[nodiscard]] Curve add(const Curve& a, const Curve& b);
/// The larger of the two at every time; where they are equal, `a`.
[[nodiscard]] Curve maximum(const Curve& a, const Curve& b);
[[nodiscard]] Curve clamped(const Curve& a, double low, double high);
/// a + b - a b: what two layers make of one action unit. Values in [0, 1].
[[nodiscard]] Curve either(const Curve& a, const Curve& b);
/// base (1 - w) + over: `over` takes the place of `base` as far as its envelope w in [0, 1] says.
[[nodiscard]] Curve replaced(const Curve& base, const Curve& over, const Curve& w);

/// Drops knots that change nothing. Values and jumps stay.
void simplify(Curve& curve);

}  // namespace nms::compiler
