#include <nms/runtime/trigonometry.h>

#include <cmath>
#include <cstdint>

namespace nms::runtime {
namespace {

// pi/2 in three parts. The first two have 33 bits, so that n times them is exact for |n| < 2^20 (Cody and Waite 1980,
// "Software Manual for the Elementary Functions", ch. 8).
constexpr double kHalfPi1 = 0x1.921fb54400000p+0;
constexpr double kHalfPi2 = 0x1.0b4611a600000p-34;
constexpr double kHalfPi3 = 0x1.3198a2e037073p-69;

// Taylor's series on [-pi/4, pi/4]; what is cut off is below 1e-18.
double sine_series(double x) {
  const double z = x * x;
  double sum = 1.0 / 355687428096000.0;  // 1 / 17!
  sum = sum * z - 1.0 / 1307674368000.0;
  sum = sum * z + 1.0 / 6227020800.0;
  sum = sum * z - 1.0 / 39916800.0;
  sum = sum * z + 1.0 / 362880.0;
  sum = sum * z - 1.0 / 5040.0;
  sum = sum * z + 1.0 / 120.0;
  sum = sum * z - 1.0 / 6.0;
  return x + x * z * sum;
}

double cosine_series(double x) {
  const double z = x * x;
  double sum = -1.0 / 6402373705728000.0;  // 1 / 18!
  sum = sum * z + 1.0 / 20922789888000.0;
  sum = sum * z - 1.0 / 87178291200.0;
  sum = sum * z + 1.0 / 479001600.0;
  sum = sum * z - 1.0 / 3628800.0;
  sum = sum * z + 1.0 / 40320.0;
  sum = sum * z - 1.0 / 720.0;
  sum = sum * z + 1.0 / 24.0;
  sum = sum * z - 0.5;
  return 1.0 + z * sum;
}

struct Reduced {
  double x;      // in about [-pi/4, pi/4]
  int quadrant;  // 0 .. 3
};

Reduced reduce(double x) {
  const double n = std::floor(x * (2.0 / kPi) + 0.5);
  const double r = ((x - n * kHalfPi1) - n * kHalfPi2) - n * kHalfPi3;
  return {r, static_cast<int>(static_cast<std::int64_t>(n) & 3)};
}

// arc tangent of k / 8
constexpr double kArcTangentTable[9] = {
    0.0,
    0.12435499454676144,
    0.24497866312686414,
    0.35877067027057225,
    0.4636476090008061,
    0.5585993153435624,
    0.6435011087932844,
    0.7188299996216245,
    0.7853981633974483,
};

// For x in [0, 1]: atan(x) = atan(c) + atan((x - c) / (1 + x c)) with c the nearest eighth; the rest is below 1/16, and
// its series is cut off below 1e-19.
double arc_tangent_unit(double x) {
  const int k = static_cast<int>(x * 8.0 + 0.5);
  const double c = k * 0.125;
  const double t = (x - c) / (1.0 + x * c);
  const double z = t * t;
  double sum = 1.0 / 13.0;
  sum = sum * z - 1.0 / 11.0;
  sum = sum * z + 1.0 / 9.0;
  sum = sum * z - 1.0 / 7.0;
  sum = sum * z + 1.0 / 5.0;
  sum = sum * z - 1.0 / 3.0;
  return kArcTangentTable[k] + (t + t * z * sum);
}

}  // namespace

double sine(double x) {
  const Reduced r = reduce(x);
  const double value = (r.quadrant & 1) != 0 ? cosine_series(r.x) : sine_series(r.x);
  return (r.quadrant & 2) != 0 ? -value : value;
}

double cosine(double x) {
  const Reduced r = reduce(x);
  const double value = (r.quadrant & 1) != 0 ? sine_series(r.x) : cosine_series(r.x);
  return r.quadrant == 1 || r.quadrant == 2 ? -value : value;
}

double arc_tangent(double y, double x) {
  const double ax = x < 0.0 ? -x : x;
  const double ay = y < 0.0 ? -y : y;
  if (ax == 0.0 && ay == 0.0) return 0.0;
  double angle = ay <= ax ? arc_tangent_unit(ay / ax) : kPi / 2.0 - arc_tangent_unit(ax / ay);
  if (x < 0.0) angle = kPi - angle;
  return y < 0.0 ? -angle : angle;
}

double arc_cosine(double x) {
  if (x >= 1.0) return 0.0;
  if (x <= -1.0) return kPi;
  return arc_tangent(std::sqrt((1.0 - x) * (1.0 + x)), x);
}

}  // namespace nms::runtime
