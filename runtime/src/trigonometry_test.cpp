#include <nms/runtime/trigonometry.h>

#include <cmath>
#include <cstdint>
#include <cstring>

#include <gtest/gtest.h>

namespace nms::runtime {
namespace {

// FNV-1a over the bits of the outputs.
class Bits {
 public:
  void add(double value) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &value, sizeof bits);
    for (int i = 0; i < 8; ++i) hash_ = (hash_ ^ ((bits >> (8 * i)) & 0xFFU)) * 0x100000001B3U;
  }
  [[nodiscard]] std::uint64_t hash() const { return hash_; }

 private:
  std::uint64_t hash_ = 0xCBF29CE484222325U;
};

TEST(Trigonometry, AgreesWithTheCLibrary) {
  double worst = 0.0;
  for (int i = -400000; i <= 400000; ++i) {
    const double x = i * 0.0025;
    worst = std::max(worst, std::abs(sine(x) - std::sin(x)));
    worst = std::max(worst, std::abs(cosine(x) - std::cos(x)));
  }
  for (int i = -20000; i <= 20000; ++i) {
    const double x = i * 0.0013;
    worst = std::max(worst, std::abs(arc_tangent(x, 1.0) - std::atan2(x, 1.0)));
    worst = std::max(worst, std::abs(arc_tangent(1.0, x) - std::atan2(1.0, x)));
    worst = std::max(worst, std::abs(arc_tangent(-1.0, x) - std::atan2(-1.0, x)));
    const double c = i / 20000.0;
    worst = std::max(worst, std::abs(arc_cosine(c) - std::acos(c)));
  }
  EXPECT_LE(worst, 1e-12);
  RecordProperty("worst_e18", static_cast<int>(worst * 1e18));
}

TEST(Trigonometry, ExactWhereItMatters) {
  EXPECT_EQ(sine(0.0), 0.0);
  EXPECT_EQ(cosine(0.0), 1.0);
  EXPECT_EQ(sine(kPi / 2.0), 1.0);
  EXPECT_EQ(arc_tangent(0.0, 1.0), 0.0);
  EXPECT_EQ(arc_tangent(0.0, 0.0), 0.0);
  EXPECT_EQ(arc_cosine(1.0), 0.0);
  EXPECT_EQ(arc_cosine(2.0), 0.0);
  for (int i = 0; i < 1000; ++i) {
    const double x = i * 0.0317;
    EXPECT_EQ(sine(-x), -sine(x));  // left mirrors right, to the bit
    EXPECT_EQ(cosine(-x), cosine(x));
  }
}

TEST(Trigonometry, GivesTheSameBitsEverywhere) {
  Bits bits;
  for (int i = -5000; i <= 5000; ++i) {
    const double x = i * 0.0078125;  // exact, so that no other rounding enters
    bits.add(sine(x));
    bits.add(cosine(x));
    bits.add(arc_tangent(x, 1.5));
    bits.add(arc_cosine(i / 8192.0));
  }
  EXPECT_EQ(bits.hash(), 65619510549733459U);
}

}  // namespace
}  // namespace nms::runtime
