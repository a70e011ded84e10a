// What the library's ambient promises, over many clips and seeds: how often it blinks, that a blink keeps away from
// lids that language moves and from where the gaze moves, that what language does is the same with it and without, that
// nothing leaves its range, and that the same seed gives the same bytes.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <nms/compiler/compile.h>
#include <nms/program/play.h>
#include <nms/program/program.h>
#include <nms/stdlib/embedded.h>

namespace {

using namespace nms;

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kStep = 5 * kMs;
constexpr std::int64_t kLidGuard = 300 * kMs;
constexpr std::int64_t kGazeGuard = 100 * kMs;

class Library : public lang::SourceProvider {
 public:
  std::shared_ptr<const lang::Source> find(std::string_view name, std::string_view) override {
    for (const auto& file : stdlib::embedded_files())
      if (file.path == name) return std::make_shared<const lang::Source>(std::string(name), std::string(file.text));
    return nullptr;
  }
};

program::Image compiled(const std::string& text) {
  Library library;
  lang::Diagnostics diagnostics;
  const auto draft = compiler::compile({std::make_shared<const lang::Source>("test.nms", text)}, library, diagnostics);
  for (const auto& d : diagnostics.all())
    if (d.severity == lang::Severity::error) ADD_FAILURE() << d.kind << ": " << d.message << "\n" << text;
  return std::move(program::Image::from(draft.value()).value());
}

std::uint32_t channel(const program::Program& p, std::string_view name) {
  for (std::uint32_t i = 0; i < p.channels.size(); ++i)
    if (p.string(p.channels[i].name) == name) return i;
  ADD_FAILURE() << "no channel " << name;
  return 0;
}

bool on_track(const program::Program& p, std::uint32_t c, std::string_view track) {
  return p.string(p.tracks[p.channels[c].track].name) == track;
}

/// All channels of the only clip, every 5 ms.
std::vector<std::vector<float>> sampled(const program::Program& p, std::int64_t end_ns) {
  std::vector<std::vector<float>> out;
  program::Player player(p, p.clips[0]);
  for (std::int64_t t = 0; t <= end_ns; t += kStep) {
    std::vector<float>& values = out.emplace_back(p.channels.size(), 0.0F);
    player.advance(t, values);
  }
  return out;
}

struct Blink {
  std::int64_t start_ns = 0;
  std::int64_t end_ns = 0;
  float size = 0.0F;
  bool operator<(const Blink& o) const { return start_ns < o.start_ns; }
};

/// Blinks of a clip in which nothing else closes the eyes: a library's blink lasts 330 ms.
std::vector<Blink> blinks_of(const program::Program& p) {
  std::vector<Blink> out;
  for (const program::Curve& curve : p.curves) {
    if (p.string(p.channels[static_cast<std::uint32_t>(curve.channel)].name) != "AU45L") continue;
    for (std::uint32_t k = 0; k + 1 < curve.knot_count; ++k) {
      const program::Knot& from = p.knots[curve.first_knot + k];
      const program::Knot& to = p.knots[curve.first_knot + k + 1];
      if (from.value == 0.0F && to.value > 0.0F) out.push_back({from.time_ns(), from.time_ns() + 330 * kMs, to.value});
    }
  }
  return out;
}

TEST(Ambient, blinks_fifteen_times_a_minute_evenly_enough) {
  std::size_t all = 0;
  std::int64_t shortest = 6000 * kMs;
  std::int64_t longest = 0;
  for (int seed = 0; seed < 40; ++seed) {
    const auto image = compiled(fmt::format("timeline t 300s {{ ambient alive(seed = {}) }}", seed));
    const auto blinks = blinks_of(image.program());
    all += blinks.size();
    ASSERT_GE(blinks.size(), 300U / 6);
    ASSERT_LE(blinks.size(), 300U / 2);
    EXPECT_LT(blinks.front().start_ns, 4000 * kMs);
    for (std::size_t i = 0; i < blinks.size(); ++i) {
      EXPECT_GE(blinks[i].size, 0.6F);
      EXPECT_LE(blinks[i].size, 1.0F);
      if (i == 0) continue;
      const std::int64_t interval = blinks[i].start_ns - blinks[i - 1].start_ns;
      shortest = std::min(shortest, interval);
      longest = std::max(longest, interval);
    }
  }
  EXPECT_GE(shortest, 2000 * kMs);
  EXPECT_LT(shortest, 2100 * kMs);
  EXPECT_GT(longest, 5900 * kMs);
  EXPECT_LE(longest, 6000 * kMs);
  const double a_minute = static_cast<double>(all) / (40.0 * 5.0);
  EXPECT_GT(a_minute, 14.0);
  EXPECT_LT(a_minute, 16.0);
}

TEST(Ambient, breathes_a_little_and_within_its_rate) {
  const auto image = compiled("timeline t 300s { ambient alive }");
  const program::Program& p = image.program();
  const std::uint32_t torso = channel(p, "torso_pitch");
  std::vector<std::int64_t> in;  // where the torso is farthest back
  for (const program::Curve& curve : p.curves) {
    if (static_cast<std::uint32_t>(curve.channel) != torso) continue;
    for (std::uint32_t k = 0; k < curve.knot_count; ++k) {
      const program::Knot& knot = p.knots[curve.first_knot + k];
      EXPECT_GE(knot.value, -0.03F);
      EXPECT_LE(knot.value, 0.0F);
      if (knot.value < -0.02F) in.push_back(knot.time_ns());
    }
  }
  EXPECT_EQ(in.size(), 75U);
  for (std::size_t i = 1; i < in.size(); ++i) {
    EXPECT_GE(in[i] - in[i - 1], 3400 * kMs);
    EXPECT_LE(in[i] - in[i - 1], 4600 * kMs);
  }
}

/// What language does in one clip: lids, gaze, torso, shoulders, a brow that has nothing to do with it.
struct Speech {
  std::string text;
  struct Use {
    std::int64_t start_ns, end_ns;
  };
  std::vector<Use> lids;  ///< from where they begin to move to where they are at rest, no earlier and no later
};

Speech speech(std::mt19937& random, int seconds) {
  static constexpr const char* kLids[] = {"60% AU5", "squint", "80% AU7", "AU43", "left(AU46)", "0% AU45", "40% AU44"};
  static constexpr const char* kOther[] = {"gaze_left", "gaze_right(30deg)", "gaze_up", "lean_back(12deg)",
                                           "AU82",      "lean_left",         "60% AU4"};
  Speech out;
  const auto below = [&](std::uint32_t n) { return static_cast<std::int64_t>(random() % n); };
  for (int i = 0; i < 4; ++i) {
    const std::int64_t start = 500 + below(static_cast<std::uint32_t>(seconds) * 1000 - 2500);
    const std::int64_t end = start + 150 + below(900);
    const bool lids = i < 2;
    out.text += fmt::format("  {} over {}ms..{}ms {{ onset 100ms  offset 120ms }}\n",
                            lids ? kLids[below(std::size(kLids))] : kOther[below(std::size(kOther))], start, end);
    if (lids) out.lids.push_back({start * kMs, (end + 120) * kMs});
  }
  if (below(2) == 0) {
    const std::int64_t at = 500 + below(static_cast<std::uint32_t>(seconds) * 1000 - 2500);
    out.text += fmt::format("  blink at {}ms\n", at);
    out.lids.push_back({at * kMs, (at + 330) * kMs});
  }
  return out;
}

TEST(Ambient, keeps_away_from_language_and_leaves_it_as_it_is) {
  std::mt19937 random(20050419);
  constexpr int kSeconds = 12;
  std::size_t kept = 0;
  std::size_t left_out = 0;
  for (int round = 0; round < 60; ++round) {
    const Speech said = speech(random, kSeconds);
    SCOPED_TRACE(said.text);
    const auto clip = [&](const std::string& body) {
      return compiled(fmt::format("timeline t {}s {{\n{}}}\n", kSeconds, body));
    };
    const std::string ambient = fmt::format("  ambient alive(seed = {}, blinks = 1s)\n", round);
    const auto silent_image = clip(ambient);
    const auto plain_image = clip(said.text);
    const auto image = clip(said.text + ambient);
    const program::Program& p = image.program();
    const auto with = sampled(p, kSeconds * 1000 * kMs);
    const auto without = sampled(plain_image.program(), kSeconds * 1000 * kMs);
    ASSERT_EQ(with.size(), without.size());
    const std::uint32_t closed = channel(p, "AU45L");

    // Where each lid blinks by itself, and where the gaze moves.
    std::vector<std::int64_t> ambient_at;
    std::vector<std::int64_t> gaze_at;
    for (std::size_t i = 0; i < with.size(); ++i) {
      const std::int64_t t = static_cast<std::int64_t>(i) * kStep;
      if (with[i][closed] != without[i][closed]) ambient_at.push_back(t);
      for (std::uint32_t c = 0; c < p.channels.size(); ++c) {
        const float low = p.channels[c].kind == program::ChannelKind::axis ? -1.0F : 0.0F;
        ASSERT_GE(with[i][c], low);
        ASSERT_LE(with[i][c], 1.0F);
        if (on_track(p, c, "gaze") && i > 0 && without[i][c] != without[i - 1][c]) gaze_at.push_back(t);
        // No channel but those of blinks and breath is ever touched.
        if (!on_track(p, c, "torso") && !on_track(p, c, "shoulders") && p.channels[c].au != 45) {
          ASSERT_EQ(with[i][c], without[i][c]) << p.string(p.channels[c].name) << " at " << t;
        }
      }
    }
    for (const std::int64_t t : ambient_at) {
      for (const Speech::Use& use : said.lids)
        ASSERT_TRUE(t < use.start_ns - kLidGuard || t > use.end_ns + kLidGuard) << "lids are used at " << t;
      const auto next = std::lower_bound(gaze_at.begin(), gaze_at.end(), t - kGazeGuard + 2 * kStep);
      ASSERT_TRUE(next == gaze_at.end() || *next > t + kGazeGuard - 2 * kStep) << "the gaze moves at " << *next;
    }

    // What is left of them are blinks of the silent face, unmoved: language leaves some out and shifts none.
    const auto silent = blinks_of(silent_image.program());
    for (const Blink& b : silent) {
      const auto middle = static_cast<std::size_t>((b.start_ns + 110 * kMs) / kStep);
      if (with[middle][closed] != without[middle][closed])
        ++kept;
      else
        ++left_out;
    }
    std::size_t runs = 0;
    for (std::size_t i = 0; i < ambient_at.size(); ++i) runs += i == 0 || ambient_at[i] - ambient_at[i - 1] > kStep;
    for (std::size_t i = 0; i < ambient_at.size(); ++i)
      EXPECT_TRUE(std::any_of(silent.begin(), silent.end(),
                              [&](const Blink& b) { return ambient_at[i] >= b.start_ns && ambient_at[i] <= b.end_ns; }))
          << "not one of the silent face's at " << ambient_at[i];
    EXPECT_LE(runs, silent.size());
  }
  EXPECT_GT(kept, 100U);      // it does blink
  EXPECT_GT(left_out, 100U);  // and gives way
}

TEST(Ambient, breath_is_gone_where_the_torso_speaks_and_smaller_on_the_way) {
  const std::string lean = "  lean_forward(9deg) over 4s..9s { onset 1s  offset 1s }\n";
  const auto plain_image = compiled("timeline t 16s {\n" + lean + "}");
  const auto image = compiled("timeline t 16s {\n" + lean + "  ambient alive\n}");
  const auto silent_image = compiled("timeline t 16s { ambient alive }");
  const std::uint32_t torso = channel(image.program(), "torso_pitch");
  const auto with = sampled(image.program(), 16'000 * kMs);
  const auto without = sampled(plain_image.program(), 16'000 * kMs);
  const auto silent = sampled(silent_image.program(), 16'000 * kMs);
  for (std::size_t i = 0; i < with.size(); ++i) {
    const std::int64_t t = static_cast<std::int64_t>(i) * kStep;
    const float breath = with[i][torso] - without[i][torso];
    if (t >= 5000 * kMs && t <= 9000 * kMs) {
      EXPECT_EQ(with[i][torso], without[i][torso]) << t;
    } else if (t <= 4000 * kMs || t >= 10'000 * kMs) {
      EXPECT_NEAR(breath, silent[i][torso], 1e-6F) << t;
    } else {
      EXPECT_LE(std::abs(breath), std::abs(silent[i][torso]) + 0.001F) << t;
    }
  }
  EXPECT_LT(silent[300][torso], -0.02F);  // there is one to be gone
}

TEST(Ambient, affect_is_not_in_its_way) {
  const std::string text =
      "lexicon l \"L\" {{ entry wary : affect {{ 50% AU7 + 30% AU5 }} }}\n"
      "utterance t in l {{ signs {{ wary[ A@0s..20s ] }} {} }}\n";
  const auto image = compiled(fmt::format(fmt::runtime(text), "ambient alive"));
  const auto plain = compiled(fmt::format(fmt::runtime(text), ""));
  EXPECT_GE(blinks_of(image.program()).size(), 3U);
  EXPECT_TRUE(blinks_of(plain.program()).empty()) << "nothing happens by itself";
}

TEST(Ambient, same_seed_same_bytes_another_seed_other_times) {
  const auto bytes = [](const std::string& text) {
    const auto image = compiled(text);
    const auto b = image.bytes();
    return std::string(reinterpret_cast<const char*>(b.data()), b.size());
  };
  EXPECT_EQ(bytes("timeline t 30s { ambient alive(seed = 7) }"), bytes("timeline t 30s { ambient alive(seed = 7) }"));
  std::set<std::int64_t> first;
  for (int seed = 0; seed < 50; ++seed)
    first.insert(blinks_of(compiled(fmt::format("timeline t 30s {{ ambient alive(seed = {}) }}", seed)).program())
                     .front()
                     .start_ns);
  for (const char* name : {"a", "b", "c"})
    first.insert(
        blinks_of(compiled(fmt::format("timeline {} 30s {{ ambient alive }}", name)).program()).front().start_ns);
  EXPECT_EQ(first.size(), 53U);
}

}  // namespace
