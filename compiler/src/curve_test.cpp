#include "curve.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace {

using namespace nms::compiler;

constexpr std::int64_t kEnd = 3'000'000'000;
/// Sums of doubles near 1, a few dozen operations deep.
constexpr double kRounding = 1e-9;

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double real(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_() >> 11U) / 9007199254740992.0;
  }
  std::int64_t time() { return static_cast<std::int64_t>(real(0.0, 1.0) * static_cast<double>(kEnd)); }
  int below(int n) { return static_cast<int>(engine_() % static_cast<std::uint64_t>(n)); }

 private:
  std::mt19937_64 engine_;  // its sequence is fixed by the standard; the distributions are not
};

/// The damped spring of the table in curve.cpp, by the library's own functions.
double spring(double u) {
  const double d = 3.0 * 3.14159265358979323846;
  const auto x = [d](double v) { return 1.0 - std::exp(-0.75 * d * v) * (std::cos(d * v) + 0.75 * std::sin(d * v)); };
  return x(u) / x(1.0);
}

/// A curve with every easing, with jumps, and with cubics that leave the range of their ends.
Curve random_curve(Random& random, double low, double high) {
  std::vector<std::int64_t> times;
  for (int i = 1 + random.below(7); i > 0; --i) times.push_back(random.time());
  std::sort(times.begin(), times.end());
  if (times.size() > 2 && random.below(2) == 0) times[1] = times[0];
  if (times.size() > 4 && random.below(2) == 0) times[4] = times[3] + 1;
  std::sort(times.begin(), times.end());
  Curve c;
  for (const std::int64_t t : times) {
    const double value = random.below(4) == 0 && !c.empty() ? c.knots.back().value : random.real(low, high);
    ease_to(c, t, value, static_cast<Easing>(random.below(5)), 7);
  }
  return c;
}

std::vector<std::int64_t> samples(std::initializer_list<const Curve*> curves) {
  std::vector<std::int64_t> times{-1, 0, kEnd, kEnd + 1};
  for (std::int64_t i = 0; i <= 400; ++i) times.push_back(i * (kEnd / 400));
  for (const Curve* c : curves)
    for (const CurveKnot& k : c->knots)
      for (const std::int64_t d : {-1, 0, 1}) times.push_back(k.time_ns + d);
  return times;
}

void expect_well_formed(const Curve& c) {
  for (std::size_t i = 1; i < c.knots.size(); ++i) {
    ASSERT_LE(c.knots[i - 1].time_ns, c.knots[i].time_ns) << "knots in order";
    if (i >= 2) {
      ASSERT_LT(c.knots[i - 2].time_ns, c.knots[i].time_ns) << "two at one time at most";
    }
  }
}

/// `result` is `rule` of the two, everywhere but within a nanosecond of a crossing, where a step of one nanosecond of
/// the steepest curve may stand.
template <typename Rule>
void expect_pointwise(const Curve& result, const Curve& a, const Curve& b, double tolerance, Rule rule) {
  expect_well_formed(result);
  for (const std::int64_t t : samples({&result, &a, &b})) {
    const double want = rule(t);
    const double before = rule(t - 1), after = rule(t + 1);
    const double slack = tolerance + std::max({want, before, after}) - std::min({want, before, after});
    // A jump's own time belongs to its far side, for operands and result alike.
    ASSERT_NEAR(result.value(t), want, slack) << "at " << t;
  }
}

TEST(Curve, easings_end_exactly_where_they_should) {
  Random random(1);
  for (int i = 0; i < 200; ++i) {
    Curve c;
    const double v0 = random.real(-1, 1), v1 = random.real(-1, 1);
    const std::int64_t t0 = random.time(), t1 = t0 + 1 + random.time();
    const auto easing = static_cast<Easing>(i % 4);
    ease_to(c, t0, v0, easing, 0);
    ease_to(c, t1, v1, easing, 0);
    EXPECT_EQ(c.value(t0 - 1), v0);
    EXPECT_EQ(c.value(t0), v0);
    EXPECT_EQ(c.value(t1), v1);
    EXPECT_EQ(c.value(t1 + 1), v1);
    EXPECT_EQ(c.knots.back().time_ns, t1);
    if (easing == Easing::step && t1 - t0 > 1) {
      EXPECT_NEAR(c.value(t1 - 1), v0, kRounding);
    }
    const double half = c.value(t0 + (t1 - t0) / 2);
    if (easing != Easing::step && t1 - t0 > 1000) {
      EXPECT_NEAR(half, (v0 + v1) / 2, 1e-2);
    }
    expect_well_formed(c);
  }
}

TEST(Curve, easings_are_monotone) {
  for (const Easing easing : {Easing::smooth, Easing::linear, Easing::cosine, Easing::step}) {
    Curve c;
    ease_to(c, 0, 0.1, easing, 0);
    ease_to(c, kEnd, 0.9, easing, 0);
    double last = 0.0;
    for (std::int64_t t = 0; t <= kEnd; t += kEnd / 1000) {
      EXPECT_GE(c.value(t), last - kRounding);
      last = c.value(t);
    }
  }
}

TEST(Curve, sums_are_exact) {
  Random random(2);
  for (int i = 0; i < 500; ++i) {
    const Curve a = random_curve(random, -1, 1), b = random_curve(random, -1, 1);
    expect_pointwise(add(a, b), a, b, kRounding, [&](std::int64_t t) { return a.value(t) + b.value(t); });
  }
}

TEST(Curve, maxima_are_exact) {
  Random random(3);
  for (int i = 0; i < 500; ++i) {
    const Curve a = random_curve(random, -1, 1), b = random_curve(random, -1, 1);
    // Where two curves cross between two nanoseconds the knot stands on one of them; 1e-6 is what a full-scale
    // movement within a millisecond comes to in a nanosecond.
    expect_pointwise(maximum(a, b), a, b, 1e-6, [&](std::int64_t t) { return std::max(a.value(t), b.value(t)); });
  }
}

TEST(Curve, cut_offs_are_exact) {
  Random random(4);
  for (int i = 0; i < 500; ++i) {
    const Curve a = random_curve(random, -2, 2);
    expect_pointwise(clamped(a, -1, 1), a, a, 1e-6, [&](std::int64_t t) { return std::clamp(a.value(t), -1.0, 1.0); });
    expect_pointwise(clamped(a, 0, 1), a, a, 1e-6, [&](std::int64_t t) { return std::clamp(a.value(t), 0.0, 1.0); });
  }
}

TEST(Curve, products_are_within_their_bound) {
  Random random(5);
  for (int i = 0; i < 500; ++i) {
    const Curve a = random_curve(random, 0, 1), b = random_curve(random, 0, 1), w = random_curve(random, 0, 1);
    // The fit is measured at five places of each piece; between them it may be a little farther off.
    constexpr double kBound = 1.5 * kFitTolerance;
    expect_pointwise(either(a, b), a, b, kBound, [&](std::int64_t t) {
      const double p = a.value(t), q = b.value(t);
      return p + q - p * q;
    });
    expect_pointwise(replaced(a, b, w), a, b, kBound,
                     [&](std::int64_t t) { return a.value(t) * (1.0 - w.value(t)) + b.value(t); });
  }
}

TEST(Curve, what_merges_stays_within_the_range) {
  Random random(6);
  for (int i = 0; i < 300; ++i) {
    // Layers are held within the range before they meet; a spring alone may leave it.
    const Curve a = clamped(random_curve(random, 0, 1), 0, 1), b = clamped(random_curve(random, 0, 1), 0, 1);
    for (const Curve& c : {maximum(a, b), clamped(add(a, b), 0, 1), either(a, b)})
      for (const std::int64_t t : samples({&c})) {
        ASSERT_GE(c.value(t), -kFitTolerance);
        ASSERT_LE(c.value(t), 1.0 + kFitTolerance);
      }
  }
}

TEST(Curve, a_part_of_a_curve_has_its_values) {
  Curve c;
  ease_to(c, 0, 0.2, Easing::smooth, 0);
  ease_to(c, 100, 0.9, Easing::smooth, 1);
  ease_to(c, 250, 0.1, Easing::linear, 2);
  for (const std::int64_t cut : {0, 1, 40, 100, 249, 250}) {
    const Curve first = until(c, cut);
    const Curve rest = since(c, cut);
    EXPECT_EQ(first.knots.back().time_ns, cut);
    EXPECT_EQ(rest.knots.front().time_ns, cut);
    for (std::int64_t t = 0; t <= 250; t += 10) {
      EXPECT_NEAR(first.value(t), c.value(std::min(t, cut)), 1e-12) << cut << " " << t;
      EXPECT_NEAR(rest.value(t), c.value(std::max(t, cut)), 1e-12) << cut << " " << t;
    }
  }
  EXPECT_EQ(since(c, -5).knots.size(), c.knots.size());
  EXPECT_EQ(since(c, 300).value(0), 0.1);
  EXPECT_TRUE(until(c, -5).empty());
}

TEST(Curve, operands_may_be_exchanged) {
  Random random(7);
  for (int i = 0; i < 300; ++i) {
    const Curve a = random_curve(random, 0, 1), b = random_curve(random, 0, 1);
    const Curve pairs[3][2] = {{add(a, b), add(b, a)}, {maximum(a, b), maximum(b, a)}, {either(a, b), either(b, a)}};
    for (const auto& p : pairs)
      for (const std::int64_t t : samples({&a, &b})) ASSERT_NEAR(p[0].value(t), p[1].value(t), 1e-6) << t;
  }
}

TEST(Curve, simplifying_changes_no_value) {
  Random random(8);
  for (int i = 0; i < 500; ++i) {
    const Curve a = random_curve(random, 0, 1), b = random_curve(random, 0, 1);
    const Curve before = i % 2 == 0 ? maximum(a, b) : clamped(add(a, b), 0, 0.7);
    Curve after = before;
    simplify(after);
    EXPECT_LE(after.knots.size(), before.knots.size());
    expect_well_formed(after);
    for (const std::int64_t t : samples({&before})) ASSERT_NEAR(after.value(t), before.value(t), kRounding) << t;
  }
}

TEST(Curve, a_curve_without_knots_is_nothing_to_every_operator) {
  Random random(9);
  const Curve a = random_curve(random, 0, 1);
  for (const Curve& c : {add(a, {}), add({}, a), maximum(a, {}), maximum({}, a), either(a, {}), either({}, a)})
    for (const std::int64_t t : samples({&a})) ASSERT_EQ(c.value(t), a.value(t));
  EXPECT_TRUE(clamped({}, 0, 1).empty());
}

TEST(Easing, a_spring_swings_past_its_end_once_and_rests_at_it_exactly) {
  for (const double from : {0.0, 0.7})
    for (const double to : {0.0, 0.3, 1.0}) {
      Curve c;
      ease_to(c, 1000, from, Easing::spring, 7);
      ease_to(c, kEnd, to, Easing::spring, 7);
      EXPECT_EQ(c.knots.front().time_ns, 1000);
      EXPECT_EQ(c.knots.back().time_ns, kEnd);
      EXPECT_EQ(c.knots.back().value, to);
      EXPECT_EQ(c.knots[c.knots.size() - 2].b2, to) << "at rest";
      double farthest = 0.0;
      for (int i = 0; i <= 3000; ++i) {
        const double u = i / 3000.0;
        const double got = c.value(1000 + static_cast<std::int64_t>(u * static_cast<double>(kEnd - 1000)));
        EXPECT_NEAR(got, from + (to - from) * spring(u), 2.5e-4) << u;
        if (to != from) farthest = std::max(farthest, (got - from) / (to - from));
      }
      if (to != from) {
        EXPECT_NEAR(farthest, 1.0938, 1e-4);
      }
    }
}

TEST(Easing, a_spring_of_few_nanoseconds_is_in_order) {
  for (std::int64_t length = 1; length < 60; ++length) {
    Curve c;
    ease_to(c, 0, 0.0, Easing::spring, 7);
    ease_to(c, length, 1.0, Easing::spring, 7);
    expect_well_formed(c);
    EXPECT_EQ(c.knots.back().time_ns, length);
    EXPECT_EQ(c.knots.back().value, 1.0);
  }
}

}  // namespace
