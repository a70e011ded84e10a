#pragma once

namespace nms::runtime {

/// Trigonometry that gives the same bits on every machine: only +, -, *, / and sqrt, which IEEE 754 rounds correctly,
/// in a fixed order. The C library's own functions pick other code on other processors.
///
/// Errors against the true value are below 1e-15 for |x| <= 1000 rad (1e-12 is what is promised and tested).

inline constexpr double kPi = 3.14159265358979323846;
inline constexpr double kRadian = kPi / 180.0;  ///< one degree [rad]

/// @param x angle, |x| <= 1e6 [rad]
[[nodiscard]] double sine(double x);
/// @param x angle, |x| <= 1e6 [rad]
[[nodiscard]] double cosine(double x);
/// Angle of the point (x, y) from the +x axis, in [-pi, pi]; 0 for the origin. [rad]
[[nodiscard]] double arc_tangent(double y, double x);
/// In [0, pi]; x is clamped to [-1, 1]. [rad]
[[nodiscard]] double arc_cosine(double x);

}  // namespace nms::runtime
