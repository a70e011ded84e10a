#pragma once

#include <cstdint>
#include <vector>

#include <nms/program/program.h>

namespace nms::program {

/// What a person sees of a curve.
struct CurveFeatures {
  double peak = 0.0;  ///< the value farthest from rest
  std::int64_t onset_ns = 0;
  std::int64_t apex_ns = 0;
  std::int64_t release_ns = 0;
  std::int64_t offset_ns = 0;
  int swings = 0;
};

/// @param rest  values up to here are no movement, and up to here below the peak as good as it
[[nodiscard]] CurveFeatures curve_features(const Program& program, const Curve& curve, double rest);

/// The largest difference of two curves that a shift of `slack_ns` does not explain, looked for at their knots and
/// between them.
[[nodiscard]] double largest_difference(const Program& a, const Curve& of_a, const Program& b, const Curve& of_b,
                                        std::int64_t slack_ns);

}  // namespace nms::program
