#include "merge.h"

#include "coarticulation.h"

#include <algorithm>
#include <random>

#include <gtest/gtest.h>

namespace {

using namespace nms;
using namespace nms::compiler;

constexpr std::int64_t kMs = 1'000'000;
/// Two operands of a product are each fitted, and the product of those once more.
constexpr double kTolerance = 4 * kFitTolerance;

Channels one_channel(program::MergeOperator op, bool axis) {
  Channels c;
  TrackInfo track;
  track.name = "track";
  track.merge = op;
  c.tracks.push_back(track);
  ChannelInfo info;
  info.name = "channel";
  info.kind = axis ? program::ChannelKind::axis : program::ChannelKind::action_unit;
  c.channels.push_back(info);
  return c;
}

struct Shape {
  std::int64_t start, onset, release, end;
  double value;
  Layer layer;
  bool stated;
};

Contribution contribution(const Shape& s, double more = 0.0) {
  Contribution c;
  const auto trapezoid = [&](double value) {
    Curve curve;
    ease_to(curve, s.start * kMs, 0.0, Easing::smooth, 0);
    ease_to(curve, s.onset * kMs, value, Easing::smooth, 0);
    ease_to(curve, s.release * kMs, value, Easing::smooth, 0);
    ease_to(curve, s.end * kMs, 0.0, Easing::smooth, 0);
    return curve;
  };
  c.curve = trapezoid(s.value + more);
  c.envelope = trapezoid(1.0);
  c.layer = s.layer;
  c.stated = s.stated;
  c.start_ns = s.start * kMs;
  c.end_ns = s.end * kMs;
  return c;
}

/// The same as a pose, whose phases are known.
Contribution pose(const Shape& s, double more = 0.0) {
  Contribution c = contribution(s, more);
  c.pose = true;
  c.apex_ns = s.onset * kMs;
  c.release_ns = s.release * kMs;
  return c;
}

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  int below(int n) { return static_cast<int>(engine_() % static_cast<std::uint64_t>(n)); }
  double share() { return static_cast<double>(engine_() >> 11U) / 9007199254740992.0; }
  Shape shape(bool axis, bool with_stated) {
    Shape s{};
    s.start = below(3000);
    s.onset = s.start + below(300);
    s.release = s.onset + 1 + below(1500);
    s.end = s.release + below(300);
    s.value = axis ? 2.0 * share() - 1.0 : share();
    s.layer = static_cast<Layer>(below(kLayerCount));
    s.stated = with_stated && below(4) == 0;
    return s;
  }

 private:
  std::mt19937_64 engine_;
};

Curve merged(const std::vector<Contribution>& all, const Channels& channels) {
  ClipDraft clip;
  clip.contributions = all;
  const auto curves = merge(clip, channels);
  EXPECT_EQ(curves.size(), 1U);
  return curves.front().curve;
}

struct Case {
  program::MergeOperator op;
  bool axis;
};
constexpr Case kCases[] = {{program::MergeOperator::strongest, false},
                           {program::MergeOperator::sum, false},
                           {program::MergeOperator::sum, true},
                           {program::MergeOperator::latest, false},
                           {program::MergeOperator::latest, true}};

TEST(Merge, stays_within_the_range) {
  Random random(1);
  for (const Case& k : kCases) {
    const Channels channels = one_channel(k.op, k.axis);
    for (int i = 0; i < 60; ++i) {
      std::vector<Contribution> all;
      for (int n = 1 + random.below(8); n > 0; --n) all.push_back(contribution(random.shape(k.axis, true)));
      const Curve c = merged(all, channels);
      for (std::size_t j = 1; j < c.knots.size(); ++j) {
        ASSERT_LE(c.knots[j - 1].time_ns, c.knots[j].time_ns);
        if (j >= 2) {
          ASSERT_LT(c.knots[j - 2].time_ns, c.knots[j].time_ns);
        }
      }
      for (std::int64_t t = 0; t < 5500; t += 7) {
        ASSERT_GE(c.value(t * kMs), (k.axis ? -1.0 : 0.0) - kFitTolerance);
        ASSERT_LE(c.value(t * kMs), 1.0 + kFitTolerance);
      }
    }
  }
}

TEST(Merge, more_of_a_cause_is_never_less_of_its_effect) {
  Random random(2);
  for (const Case& k : kCases) {
    const Channels channels = one_channel(k.op, k.axis);
    for (int i = 0; i < 60; ++i) {
      std::vector<Shape> shapes;
      for (int n = 1 + random.below(6); n > 0; --n) shapes.push_back(random.shape(k.axis, true));
      const int raised = random.below(static_cast<int>(shapes.size()));
      std::vector<Contribution> before, after;
      for (int n = 0; n < static_cast<int>(shapes.size()); ++n) {
        before.push_back(contribution(shapes[n]));
        after.push_back(contribution(shapes[n], n == raised ? 0.3 : 0.0));
      }
      const Curve a = merged(before, channels), b = merged(after, channels);
      for (std::int64_t t = 0; t < 5500; t += 7)
        ASSERT_GE(b.value(t * kMs), a.value(t * kMs) - kTolerance)
            << "operator " << static_cast<int>(k.op) << " at " << t;
    }
  }
}

TEST(Merge, the_order_of_declaration_does_not_matter) {
  Random random(3);
  for (const Case& k : kCases) {
    const Channels channels = one_channel(k.op, k.axis);
    for (int i = 0; i < 60; ++i) {
      std::vector<Contribution> all;
      for (int n = 2 + random.below(6); n > 0; --n) {
        all.push_back(contribution(random.shape(k.axis, true)));
        all.back().start_ns += n;  // two that start at once go by their order, under `latest`
      }
      const Curve a = merged(all, channels);
      std::reverse(all.begin(), all.end());
      const Curve b = merged(all, channels);
      for (std::int64_t t = 0; t < 5500; t += 7) ASSERT_NEAR(a.value(t * kMs), b.value(t * kMs), kTolerance) << t;
    }
  }
}

TEST(Merge, strongest_is_the_maximum_of_a_layer) {
  Random random(4);
  const Channels channels = one_channel(program::MergeOperator::strongest, false);
  for (int i = 0; i < 60; ++i) {
    std::vector<Contribution> all;
    for (int n = 1 + random.below(9); n > 0; --n) {
      Shape s = random.shape(false, false);
      s.layer = Layer::lexical;
      all.push_back(contribution(s));
    }
    const Curve c = merged(all, channels);
    for (std::int64_t t = 0; t < 5500; t += 7) {
      double want = 0.0;
      for (const Contribution& one : all) want = std::max(want, one.curve.value(t * kMs));
      ASSERT_NEAR(c.value(t * kMs), want, 1e-6) << t;
    }
  }
}

TEST(Merge, layers_of_a_unit_never_pass_the_top) {
  Random random(5);
  const Channels channels = one_channel(program::MergeOperator::strongest, false);
  for (int i = 0; i < 60; ++i) {
    std::vector<Contribution> all;
    for (int layer = 0; layer < kLayerCount; ++layer) {
      Shape s = random.shape(false, false);
      s.layer = static_cast<Layer>(layer);
      all.push_back(contribution(s));
    }
    const Curve c = merged(all, channels);
    for (std::int64_t t = 0; t < 5500; t += 7) {
      double rest = 1.0;
      double said = 0.0;  // the ambient layer is left what language does not claim
      for (const Contribution& one : all)
        if (linguistic(one.layer)) said = std::max(said, one.envelope.value(t * kMs));
      for (const Contribution& one : all)
        rest *= 1.0 - one.curve.value(t * kMs) * (one.layer == Layer::ambient ? 1.0 - said : 1.0);
      ASSERT_NEAR(c.value(t * kMs), 1.0 - rest, kTolerance) << t;
    }
  }
}

TEST(Merge, the_later_to_start_takes_the_place_of_the_earlier) {
  const Channels channels = one_channel(program::MergeOperator::latest, true);
  const Curve c = merged({contribution({500, 600, 1000, 1100, -0.5, Layer::lexical, false}),
                          contribution({0, 100, 2000, 2100, 0.8, Layer::lexical, false})},
                         channels);
  EXPECT_NEAR(c.value(400 * kMs), 0.8, 1e-12);
  EXPECT_NEAR(c.value(800 * kMs), -0.5, 1e-12);
  EXPECT_NEAR(c.value(1500 * kMs), 0.8, 1e-12);
  EXPECT_NEAR(c.value(2100 * kMs), 0.0, 1e-12);
}

TEST(Merge, a_motion_within_another_of_its_name_is_left_out) {
  const Channels channels = one_channel(program::MergeOperator::sum, true);
  const auto named = [](Shape s, std::string_view motion) {
    Contribution c = contribution(s);
    c.motion = motion;
    return c;
  };
  const Shape outer{0, 100, 900, 1000, 0.4, Layer::syntactic, false};
  const Shape inner{200, 300, 700, 800, 0.3, Layer::lexical, false};
  const Shape across{900, 950, 1100, 1200, 0.3, Layer::lexical, false};
  EXPECT_NEAR(merged({named(inner, "shake"), named(outer, "shake")}, channels).value(500 * kMs), 0.4, 1e-12);
  EXPECT_NEAR(merged({named(inner, "nod"), named(outer, "shake")}, channels).value(500 * kMs), 0.7, 1e-12);
  EXPECT_NEAR(merged({named(outer, "shake"), named(outer, "shake")}, channels).value(500 * kMs), 0.4, 1e-12);
  EXPECT_NEAR(merged({named(across, "shake"), named(outer, "shake")}, channels).value(1000 * kMs), 0.3, 1e-12);
}

/// Poses that follow one another closely: the next begins about where the one before goes.
std::vector<Shape> train(Random& random, bool axis) {
  std::vector<Shape> shapes;
  std::int64_t at = 0;
  const Layer layer = static_cast<Layer>(random.below(kLayerCount));
  for (int n = 2 + random.below(5); n > 0; --n) {
    Shape s = random.shape(axis, false);
    s.start = at;
    s.onset = s.start + random.below(300);
    s.release = s.onset + 1 + random.below(300);
    s.end = s.release + random.below(300);
    s.layer = layer;
    at = s.onset + random.below(static_cast<int>(s.end - s.onset) + 200);
    shapes.push_back(s);
  }
  return shapes;
}

TEST(Coarticulation, poses_in_a_train_stay_in_range_and_more_is_never_less) {
  Random random(6);
  for (const Case& k : kCases) {
    const Channels channels = one_channel(k.op, k.axis);
    for (int i = 0; i < 200; ++i) {
      const std::vector<Shape> shapes = train(random, k.axis);
      const int raised = random.below(static_cast<int>(shapes.size()));
      std::vector<Contribution> before, after;
      for (int n = 0; n < static_cast<int>(shapes.size()); ++n) {
        before.push_back(pose(shapes[n]));
        after.push_back(pose(shapes[n], n == raised ? 0.3 : 0.0));
      }
      const Curve a = merged(before, channels), b = merged(after, channels);
      for (std::int64_t t = 0; t < 5500; t += 7) {
        ASSERT_GE(a.value(t * kMs), (k.axis ? -1.0 : 0.0) - kFitTolerance);
        ASSERT_LE(a.value(t * kMs), 1.0 + kFitTolerance);
        ASSERT_GE(b.value(t * kMs), a.value(t * kMs) - kTolerance)
            << "operator " << static_cast<int>(k.op) << " axis " << k.axis << " at " << t;
      }
    }
  }
}

TEST(Coarticulation, the_strongest_is_never_undercut) {
  Random random(7);
  const Channels channels = one_channel(program::MergeOperator::strongest, false);
  for (int i = 0; i < 300; ++i) {
    std::vector<Contribution> poses;
    for (const Shape& s : train(random, false)) poses.push_back(pose(s));
    const Curve c = merged(poses, channels);
    for (std::int64_t t = 0; t < 5500; t += 7) {
      double strongest = 0.0;
      for (const Contribution& one : poses) strongest = std::max(strongest, one.curve.value(t * kMs));
      ASSERT_GE(c.value(t * kMs), strongest - 1e-6) << t;
    }
  }
}

TEST(Coarticulation, an_offset_into_an_onset_is_one_cubic_from_apex_to_apex) {
  for (const Case& k : kCases) {
    const Channels channels = one_channel(k.op, k.axis);
    const double second = k.axis ? -0.4 : 0.4;
    const Curve c = merged({pose({0, 100, 500, 700, 0.8, Layer::lexical, false}),
                            pose({600, 750, 1000, 1100, second, Layer::lexical, false})},
                           channels);
    Curve way;
    ease_to(way, 500 * kMs, 0.8, Easing::smooth, 0);
    ease_to(way, 750 * kMs, second, Easing::smooth, 0);
    for (std::int64_t t = 500; t <= 750; t += 5) ASSERT_NEAR(c.value(t * kMs), way.value(t * kMs), 1e-12) << t;
    for (const CurveKnot& knot : c.knots) EXPECT_FALSE(knot.time_ns > 500 * kMs && knot.time_ns < 750 * kMs);
  }
}

TEST(Coarticulation, a_value_is_held_through_if_it_is_away_for_less_than_measured) {
  for (const Case& k : kCases) {
    const Channels channels = one_channel(k.op, k.axis);
    const auto between = [&](std::int64_t away) {
      return merged({pose({0, 50, 500, 550, 0.6, Layer::lexical, false}),
                     pose({500 + away - 50, 500 + away, 1500, 1600, 0.6, Layer::lexical, false})},
                    channels)
          .value((500 + away / 2) * kMs);
    };
    EXPECT_EQ(kHeldThroughNs, 250 * kMs);
    EXPECT_NEAR(between(240), 0.6, 1e-12);
    EXPECT_NEAR(between(260), 0.0, 1e-12);
  }
}

TEST(Coarticulation, poses_of_two_layers_are_not_joined) {
  const Channels channels = one_channel(program::MergeOperator::strongest, false);
  const Curve c = merged(
      {pose({0, 50, 500, 550, 0.6, Layer::lexical, false}), pose({600, 650, 1500, 1600, 0.6, Layer::syntactic, false})},
      channels);
  EXPECT_NEAR(c.value(575 * kMs), 0.0, 1e-12);
}

TEST(Merge, many_contributions_take_no_more_than_n_log_n) {
  for (const Case& k : kCases) {
    const Channels channels = one_channel(k.op, k.axis);
    std::vector<Contribution> all;
    for (std::int64_t i = 0; i < 20'000; ++i)
      all.push_back(contribution({i * 30, i * 30 + 10, i * 30 + 20, i * 30 + 30, 0.5, Layer::lexical, false}));
    std::vector<Contribution> poses;
    for (std::int64_t i = 0; i < 20'000; ++i)
      poses.push_back(pose({i * 30, i * 30 + 10, i * 30 + 20, i * 30 + 30, 0.5, Layer::lexical, false}));
    EXPECT_NEAR(merged(poses, channels).value(10'000 * 30 * kMs), 0.5, 1e-12);
    const Curve c = merged(all, channels);  // a quadratic merge takes minutes: the test's time limit is the check
    EXPECT_NEAR(c.value(19'999 * 30 * kMs + 15 * kMs), 0.5, 1e-12);
    EXPECT_NEAR(c.value(10'000 * 30 * kMs), 0.0, 1e-12);
  }
}

/// What an observer is told, checked as it comes.
class Listener : public MergeObserver {
 public:
  Listener(const ChannelInfo& channel, std::int64_t time_ns) : channel_(channel), time_ns_(time_ns) {}

  void channel(std::uint32_t, const std::vector<const Contribution*>& all) override { heard = all.size(); }
  void repeated(const Contribution&) override { ++left_out; }
  void let_go(const Contribution& held, const Contribution& going, const Contribution& by) override {
    EXPECT_TRUE(held.held && !going.held);
    EXPECT_GE(by.end_ns, held.release_ns);
  }
  void joined(const Contribution& pose, const Contribution& joint) override {
    EXPECT_TRUE(pose.pose && joint.pose);
    ++parts;
  }
  void group(const std::vector<const Contribution*>& of, bool stated, program::MergeOperator op, bool sum,
             const Curve& merged) override {
    EXPECT_FALSE(of.empty());
    for (const Contribution* c : of) EXPECT_EQ(c->stated, stated);
    EXPECT_EQ(sum, op != program::MergeOperator::latest && (op == program::MergeOperator::sum || channel_.is_axis()));
    value = merged.value(time_ns_);
    (stated ? stated_value : layer_value) = value;
  }
  void scaled(Layer layer, const Curve& taken, const Curve& merged) override {
    EXPECT_EQ(layer, Layer::ambient) << "one channel has nobody else to cede to";
    EXPECT_NEAR(merged.value(time_ns_), layer_value * (1.0 - taken.value(time_ns_)), kTolerance);
    value = layer_value = merged.value(time_ns_);
    ++yielded;
  }
  void hidden(const Curve&, const Curve&) override { ADD_FAILURE() << "one channel is hidden by nothing"; }
  void layers(Layer, const Curve* envelope, const Curve& merged) override {
    EXPECT_EQ(envelope, nullptr);
    below_ = channel_.is_axis() ? below_ + layer_value : 1.0 - (1.0 - below_) * (1.0 - layer_value);
    value = merged.value(time_ns_);
    EXPECT_NEAR(value, below_, kTolerance);
  }
  void replaced(const Curve& envelope, const Curve& merged) override {
    value = merged.value(time_ns_);
    EXPECT_NEAR(value, below_ * (1.0 - envelope.value(time_ns_)) + stated_value, kTolerance);
    ++replacements;
  }

  std::size_t heard = 0, left_out = 0, parts = 0, replacements = 0, yielded = 0;
  double layer_value = 0.0, stated_value = 0.0, value = 0.0;

 private:
  const ChannelInfo& channel_;
  std::int64_t time_ns_;
  double below_ = 0.0;
};

TEST(MergeObserver, hears_the_steps_that_lead_to_the_value_and_changes_nothing) {
  Random random(11);
  std::size_t parts = 0, replacements = 0, yielded = 0;
  for (int round = 0; round < 300; ++round)
    for (const Case& k : kCases) {
      const Channels channels = one_channel(k.op, k.axis);
      ClipDraft clip;
      for (int i = random.below(6); i >= 0; --i) {
        const Shape s = random.shape(k.axis, true);
        clip.contributions.push_back(random.below(2) == 0 ? pose(s) : contribution(s));
      }
      const std::int64_t time = random.below(5000) * kMs;
      Listener listener(channels.channels[0], time);
      const Curve with = merge(clip, channels, &listener).front().curve;
      const Curve without = merge(clip, channels).front().curve;
      ASSERT_EQ(with.knots.size(), without.knots.size());
      for (std::size_t i = 0; i < with.knots.size(); ++i) {
        EXPECT_EQ(with.knots[i].time_ns, without.knots[i].time_ns);
        EXPECT_EQ(with.knots[i].value, without.knots[i].value);
      }
      EXPECT_EQ(listener.heard, clip.contributions.size());
      const double held = std::min(1.0, std::max(channels.channels[0].low(), listener.value));
      EXPECT_NEAR(with.value(time), held, kTolerance);
      parts += listener.parts;
      replacements += listener.replacements;
      yielded += listener.yielded;
    }
  EXPECT_GT(parts, 10U);
  EXPECT_GT(replacements, 100U);
  EXPECT_GT(yielded, 100U);
}

}  // namespace
