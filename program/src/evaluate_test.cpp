#include <nms/program/evaluate.h>

#include <algorithm>
#include <cstring>
#include <limits>

#include <gtest/gtest.h>

#include <nms/program/play.h>
#include <nms/program/text.h>

#include "test_programs.h"

namespace nms::program {
namespace {

constexpr std::int64_t kMillisecond = 1'000'000;

Image load_text(std::string_view text) { return Image::from(from_text(text, "test").value()).value(); }

/// One clip "c" with one curve over the only channel "x".
Image one_curve(std::string_view knots, std::string_view kind = "action_unit") {
  return load_text("nms program 1\nchannels\n  x " + std::string(kind) +
                   "\nclip c expression 0s..9s hash 0000000000000000\n  curve x\n" + std::string(knots));
}

float value_at(const Image& image, std::int64_t time_ns) {
  float value = -9.0F;
  evaluate(image.program(), image.program().clips[0], time_ns, {&value, 1});
  return value;
}

std::uint32_t bits(float value) {
  std::uint32_t result = 0;
  std::memcpy(&result, &value, sizeof(result));
  return result;
}

TEST(evaluate, the_smile_is_in_its_poses_exactly_at_the_ends_of_their_shares) {
  const Image image = Image::from(small_draft()).value();
  const Program& program = image.program();
  const Clip* smile = program.find_clip("smile");
  ASSERT_NE(smile, nullptr);
  std::vector<float> values(program.channels.size(), 0.5F);
  const auto at = [&](std::int64_t time_ns) {
    evaluate(program, *smile, time_ns, values);
    return values[1];
  };
  EXPECT_EQ(at(0), 0.0F);
  EXPECT_EQ(at(234 * kMillisecond), 0.6F);
  EXPECT_EQ(at(2106 * kMillisecond), 0.8F);
  EXPECT_EQ(at(2340 * kMillisecond), 0.4F);
  EXPECT_EQ(values[1], values[2]);
  EXPECT_EQ(values[0], 0.5F) << "a channel that the clip does not speak of is left alone";
}

TEST(evaluate, holds_the_first_value_before_and_the_last_value_after) {
  const Image image = one_curve("    1s 0.25 smooth\n    2s 0.75 smooth\n");
  EXPECT_EQ(value_at(image, std::numeric_limits<std::int64_t>::min()), 0.25F);
  EXPECT_EQ(value_at(image, 0), 0.25F);
  EXPECT_EQ(value_at(image, 3000 * kMillisecond), 0.75F);
  EXPECT_EQ(value_at(image, std::numeric_limits<std::int64_t>::max()), 0.75F);
}

/// Half a unit in the last place of a float in [0.5, 1), and a little for the sum in double.
constexpr double kRounding = 0.5 / 16777216.0 + 1e-14;

TEST(evaluate, agrees_with_closed_forms_to_the_rounding_of_a_float) {
  const Image linear = one_curve("    0s 0.1 linear\n    1s 0.9 hold\n");
  const Image smooth = one_curve("    0s 0.1 smooth\n    1s 0.9 hold\n");
  const Image cubic = one_curve("    0s 0.1 cubic(0.7, 0.2)\n    1s 0.9 hold\n");
  for (int i = 0; i <= 1000; ++i) {
    const double u = i / 1000.0;
    const double w = 1.0 - u;
    const double v0 = 0.1F;
    const double v1 = 0.9F;
    const double rise = v1 - v0;
    EXPECT_NEAR(value_at(linear, i * kMillisecond), v0 + rise * u, kRounding);
    EXPECT_NEAR(value_at(smooth, i * kMillisecond), v0 + rise * (3 * u * u - 2 * u * u * u), kRounding);
    EXPECT_NEAR(value_at(cubic, i * kMillisecond),
                w * w * w * v0 + 3 * w * w * u * double{0.7F} + 3 * w * u * u * double{0.2F} + u * u * u * v1,
                kRounding);
  }
}

TEST(evaluate, smooth_and_linear_are_their_own_cubics) {
  const Image smooth = one_curve("    0s 0.25 smooth\n    1s 0.75 hold\n");
  const Image smooth_cubic = one_curve("    0s 0.25 cubic(0.25, 0.75)\n    1s 0.75 hold\n");
  const Image linear = one_curve("    0s 0 linear\n    1s 0.75 hold\n");
  const Image linear_cubic = one_curve("    0s 0 cubic(0.25, 0.5)\n    1s 0.75 hold\n");
  for (int i = 0; i <= 1000; ++i) {
    EXPECT_NEAR(value_at(smooth, i * kMillisecond), value_at(smooth_cubic, i * kMillisecond), kRounding);
    EXPECT_NEAR(value_at(linear, i * kMillisecond), value_at(linear_cubic, i * kMillisecond), kRounding);
  }
}

TEST(evaluate, a_step_and_a_jump_take_the_second_value_at_their_time) {
  const Image step = one_curve("    0s 0.2 hold\n    1s 0.7 hold\n");
  EXPECT_EQ(value_at(step, 1000 * kMillisecond - 1), 0.2F);
  EXPECT_EQ(value_at(step, 1000 * kMillisecond), 0.7F);
  const Image jump = one_curve("    0s 0 linear\n    1s 0.5 linear\n    1s 0.75 linear\n    2s 1 hold\n");
  EXPECT_NEAR(value_at(jump, 1000 * kMillisecond - 1), 0.5, 1e-7);
  EXPECT_EQ(value_at(jump, 1000 * kMillisecond), 0.75F);
}

TEST(evaluate, clamps_to_the_channels_range) {
  const Image unit = one_curve("    0s 0 cubic(-1, -1)\n    1s 1 cubic(2, 2)\n    2s 1 hold\n");
  EXPECT_EQ(value_at(unit, 300 * kMillisecond), 0.0F);
  EXPECT_EQ(value_at(unit, 1500 * kMillisecond), 1.0F);
  const Image axis =
      one_curve("    0s 0 cubic(-3, -3)\n    1s 0 cubic(3, 3)\n    2s 0 hold\n", "axis positive a negative b");
  EXPECT_EQ(value_at(axis, 500 * kMillisecond), -1.0F);
  EXPECT_EQ(value_at(axis, 1500 * kMillisecond), 1.0F);
}

TEST(evaluate, random_programs_are_exact_at_knots_and_in_range) {
  std::mt19937 random(1);
  for (int i = 0; i < 200; ++i) {
    const Image image = Image::from(random_draft(random)).value();
    const Program& program = image.program();
    std::vector<float> values(program.channels.size());
    for (const Clip& clip : program.clips) {
      for (const Curve& curve : program.curves.subspan(clip.first_curve, clip.curve_count)) {
        const auto knots = program.knots.subspan(curve.first_knot, curve.knot_count);
        const auto channel = static_cast<std::size_t>(curve.channel);
        const float lowest = program.channels[channel].kind == ChannelKind::axis ? -1.0F : 0.0F;
        for (std::size_t k = 0; k < knots.size(); ++k) {
          const bool is_first_of_jump = k + 1 < knots.size() && knots[k + 1].time_ns() == knots[k].time_ns();
          evaluate(program, clip, knots[k].time_ns(), values);
          ASSERT_EQ(bits(values[channel]), bits(knots[is_first_of_jump ? k + 1 : k].value));
          evaluate(program, clip, knots[k].time_ns() + random() % 40'000'000, values);
          ASSERT_TRUE(values[channel] >= lowest && values[channel] <= 1.0F);
        }
      }
    }
  }
}

TEST(evaluate, has_the_same_bits_on_every_machine) {
  std::uint64_t hash = 14695981039346656037U;  // FNV-1a
  std::mt19937 random(6);
  for (int i = 0; i < 20; ++i) {
    const Image image = Image::from(random_draft(random)).value();
    const Program& program = image.program();
    std::vector<float> values(program.channels.size());
    for (const Clip& clip : program.clips) {
      for (std::int64_t time_ns = -1'000'000'000; time_ns < 1'000'000'000; time_ns += 1'234'567) {
        evaluate(program, clip, time_ns, values);
        for (const float value : values) {
          hash = (hash ^ bits(value)) * 1099511628211U;
        }
      }
    }
  }
  EXPECT_EQ(hash, 8745815043554520487U);
}

TEST(player, gives_the_same_bits_as_evaluate_whatever_the_order_of_times) {
  std::mt19937 random(2);
  for (int i = 0; i < 300; ++i) {
    const Image image = Image::from(random_draft(random)).value();
    const Program& program = image.program();
    for (const Clip& clip : program.clips) {
      Player player(program, clip);
      const BoundClip bound(program, clip);
      std::vector<float> bound_values(program.channels.size(), 0.125F);
      std::vector<float> played(program.channels.size(), 0.125F);
      std::vector<float> sought(program.channels.size(), 0.125F);
      std::int64_t time_ns = -1'500'000'000;
      for (int step = 0; step < 200; ++step) {
        switch (random() % 8) {
          case 0:  // anywhere
            time_ns = static_cast<std::int64_t>(random() % 300) * 10'000'000 - 1'200'000'000;
            break;
          case 1:  // back a little
            time_ns -= random() % 30'000'000;
            break;
          case 2:  // stand still
            break;
          case 3:  // to the next time that knots lie on
            time_ns = (time_ns / 10'000'000 + 1) * 10'000'000;
            break;
          default:
            time_ns += random() % 40'000'000;
        }
        player.advance(time_ns, played);
        bound.evaluate(time_ns, bound_values);
        evaluate(program, clip, time_ns, sought);
        for (std::size_t c = 0; c < played.size(); ++c) {
          ASSERT_EQ(bits(played[c]), bits(sought[c])) << "channel " << c << " at " << time_ns;
          ASSERT_EQ(bits(bound_values[c]), bits(sought[c])) << "channel " << c << " at " << time_ns;
        }
      }
    }
  }
}

TEST(cross_fade, is_exact_at_both_ends_and_stays_between_them) {
  std::mt19937 random(3);
  std::vector<float> from(64);
  std::vector<float> to(64);
  std::vector<float> out(64);
  for (std::size_t i = 0; i < from.size(); ++i) {
    from[i] = static_cast<float>(random()) / 4294967296.0F * 2.0F - 1.0F;
    to[i] = i % 8 == 0 ? from[i] : static_cast<float>(random()) / 4294967296.0F * 2.0F - 1.0F;
  }
  std::vector<float> last = from;
  for (int step = -10; step <= 1010; ++step) {
    cross_fade(from, to, static_cast<float>(step) / 1000.0F, out);
    for (std::size_t i = 0; i < out.size(); ++i) {
      ASSERT_GE(out[i], std::min(from[i], to[i]));
      ASSERT_LE(out[i], std::max(from[i], to[i]));
      ASSERT_GE((out[i] - last[i]) * (to[i] - from[i]), -1e-6F) << "it never turns back";
    }
    last = out;
  }
  EXPECT_EQ(out, to);
  cross_fade(from, to, 0.0F, out);
  EXPECT_EQ(out, from);
  cross_fade(from, to, std::numeric_limits<float>::quiet_NaN(), out);
  EXPECT_EQ(out, from);
  cross_fade(from, to, 0.5F, from);  // onto itself
  EXPECT_NEAR(from[1], (last[1] + out[1]) / 2, 1e-6);
}

}  // namespace
}  // namespace nms::program
