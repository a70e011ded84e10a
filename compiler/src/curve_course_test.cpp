#include "curve_course.h"

#include <gtest/gtest.h>

namespace nms::compiler {
namespace {

constexpr double kAll = 1e9;

Curve hill() {
  // 0 -> 0 with inner values 1: 3u(1-u), whose top is 0.75 at the middle and at no knot.
  return {{{0, 0.0, 1.0, 1.0, 0}, {1000, 0.0, 0.0, 0.0, 0}}};
}

TEST(CurveCourse, extrema_between_knots_count) {
  const Verdict v = stays(hill(), 0, 1000, {-kAll, 0.7, false});
  EXPECT_FALSE(v.holds);
  EXPECT_NEAR(v.first.value, 0.7, 1e-6);
  EXPECT_NEAR(static_cast<double>(v.first.time_ns), 371, 1);  // 3u(1-u) = 0.7
  EXPECT_EQ(v.worst.time_ns, 500);
  EXPECT_NEAR(v.worst.value, 0.75, 1e-12);
  EXPECT_TRUE(stays(hill(), 0, 1000, {0.0, 0.7500001, false}).holds);
}

TEST(CurveCourse, only_the_span_counts) {
  EXPECT_TRUE(stays(hill(), 0, 300, {-kAll, 0.7, false}).holds);
  EXPECT_TRUE(stays(hill(), 700, 5000, {-kAll, 0.7, false}).holds);
  EXPECT_FALSE(stays(hill(), 450, 550, {-kAll, 0.7, false}).holds);
  EXPECT_FALSE(stays(hill(), 500, 500, {-kAll, 0.7, false}).holds);
  EXPECT_TRUE(stays(hill(), 0, 0, {0.0, 0.0, false}).holds);
  EXPECT_TRUE(stays(hill(), -900, -1, {0.0, 0.0, false}).holds) << "before the first knot its value holds";
  EXPECT_TRUE(stays(hill(), 2000, 3000, {0.0, 0.0, false}).holds);
}

TEST(CurveCourse, what_is_forbidden_is_found_where_it_is_entered) {
  const Verdict below = stays(hill(), 0, 1000, {0.5, 0.6, true});
  EXPECT_FALSE(below.holds);
  EXPECT_NEAR(below.first.value, 0.5, 1e-6);
  const Verdict above = stays(hill(), 500, 1000, {0.5, 0.6, true});
  EXPECT_FALSE(above.holds);
  EXPECT_NEAR(above.first.value, 0.6, 1e-6);
  EXPECT_TRUE(stays(hill(), 0, 1000, {0.8, kAll, true}).holds);
}

TEST(CurveCourse, a_jump_is_seen_from_both_sides) {
  const Curve step{
      {{0, 0.2, 0.2, 0.2, 0}, {1000, 0.2, 0.2, 0.2, 0}, {1000, 0.9, 0.9, 0.9, 0}, {2000, 0.9, 0.9, 0.9, 0}}};
  EXPECT_TRUE(stays(step, 1000, 2000, {0.9, kAll, false}).holds) << "the value at a jump is the later one";
  EXPECT_FALSE(stays(step, 999, 2000, {0.9, kAll, false}).holds);
  EXPECT_FALSE(stays(step, 0, 1000, {0.0, 0.5, false}).holds);
  EXPECT_TRUE(stays(step, 0, 999, {0.0, 0.5, false}).holds);
  EXPECT_TRUE(rises(step, 0, 2000, 1e-3).holds);
}

TEST(CurveCourse, rising_ends_higher_and_never_goes_back) {
  EXPECT_TRUE(rises(hill(), 0, 500, 1e-3).holds);
  EXPECT_FALSE(rises(hill(), 0, 1000, 1e-3).holds);
  const Verdict v = rises(hill(), 0, 800, 1e-3);
  EXPECT_FALSE(v.holds);
  EXPECT_EQ(v.before.time_ns, 500);
  EXPECT_NEAR(v.first.value, 0.749, 1e-6);
  EXPECT_EQ(v.worst.time_ns, 800);
  const Curve flat{{{0, 0.5, 0.5, 0.5, 0}}};
  EXPECT_FALSE(rises(flat, 0, 1000, 1e-3).holds);
  const Curve dip{
      {{0, 0.0, 0.1, 0.3, 0}, {1000, 0.4, 0.3992, 0.3992, 0}, {2000, 0.4, 0.5, 0.6, 0}, {3000, 0.7, 0.7, 0.7, 0}}};
  EXPECT_TRUE(rises(dip, 0, 3000, 1e-3).holds) << "less than the slack is no fall";
  EXPECT_FALSE(rises(dip, 0, 3000, 1e-4).holds);
}

TEST(CurveCourse, rising_sees_a_fall_at_a_jump) {
  const Curve saw{
      {{0, 0.0, 0.3, 0.6, 0}, {1000, 0.9, 0.9, 0.9, 0}, {1000, 0.1, 0.5, 0.8, 0}, {2000, 1.0, 1.0, 1.0, 0}}};
  const Verdict v = rises(saw, 0, 2000, 1e-3);
  EXPECT_FALSE(v.holds);
  EXPECT_EQ(v.first.time_ns, 1000);
  EXPECT_NEAR(v.before.value, 0.9, 1e-12);
}

}  // namespace
}  // namespace nms::compiler
