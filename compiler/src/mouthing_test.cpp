#include "mouthing.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "phones.h"

namespace nms::compiler {
namespace {

std::string visemes(std::string_view text) {
  UnreadPhone unread;
  const auto phones = read_phones(text, unread);
  if (!phones) return "unread at " + std::to_string(unread.at);
  std::string out;
  for (const Phone& p : *phones) {
    if (!out.empty()) out += ' ';
    out += p.viseme;
  }
  return out;
}

TEST(Phones, ReadTheSameWordInThreeAlphabets) {
  EXPECT_EQ(visemes("bUk"), "p u k");
  EXPECT_EQ(visemes("ˈbʊk"), "p u k");
  EXPECT_EQ(visemes("B UH1 K"), "p u k");
  EXPECT_EQ(visemes("\"tSi:z"), "sh i s");
  EXPECT_EQ(visemes("tʃiːz"), "sh i s");
  EXPECT_EQ(visemes("CH IY1 Z"), "sh i s");
}

TEST(Phones, ReadWhatSigmlWrites) {
  EXPECT_EQ(visemes("tvInt@x"), "t f i t t schwa k");
  EXPECT_EQ(visemes("t_SY:s"), "sh y s");
}

TEST(Phones, LongestSymbolFirst) {
  EXPECT_EQ(visemes("tS"), "sh");
  EXPECT_EQ(visemes("t.S"), "t sh");
  EXPECT_EQ(visemes("r\\"), "r");
}

TEST(Phones, OneLetterCapitalsAreSampa) {
  EXPECT_EQ(visemes("S I T"), "sh i th");
  EXPECT_EQ(visemes("S IH T"), "s i t");
}

TEST(Phones, LengthMarksLengthen) {
  UnreadPhone unread;
  const auto brief = read_phones("i", unread), drawn = read_phones("iː", unread);
  ASSERT_TRUE(brief && drawn);
  EXPECT_EQ(drawn->front().duration_ns, brief->front().duration_ns * 3 / 2);
}

TEST(Phones, SayWhereTheyEnd) {
  EXPECT_EQ(visemes(""), "unread at 0");
  EXPECT_EQ(visemes("bU§k"), "unread at 2");
  EXPECT_EQ(visemes(":"), "unread at 0");
  UnreadPhone unread;
  EXPECT_FALSE(read_phones("a§", unread));
  EXPECT_EQ(unread.length, 2U);  // a whole character
}

constexpr std::int64_t kMs = 1'000'000;

double value(const Step& step, std::uint32_t channel) {
  for (const Amount& a : step.pose)
    if (a.channel == channel) return a.value;
  return -1.0;
}

TEST(Visemes, StayWithinWhatIsWanted) {
  const std::vector<Viseme> word = {{{{0, 0.8}}, 1.0, 60 * kMs, 80 * kMs},
                                    {{{0, 0.2}, {1, 1.0}}, 0.4, 90 * kMs, 120 * kMs},
                                    {{{1, 0.0}}, 0.9, 50 * kMs, 80 * kMs}};
  for (const Step& step : blend_visemes(word))
    for (const Amount& a : step.pose) {
      EXPECT_GE(a.value, 0.0);
      EXPECT_LE(a.value, a.channel == 0 ? 0.8 : 1.0);
    }
}

TEST(Visemes, ReachTheirMiddlesAndEndsInTime) {
  const auto steps = blend_visemes({{{{0, 1.0}}, 1.0, 60 * kMs, 80 * kMs}, {{{0, 0.0}}, 1.0, 60 * kMs, 121 * kMs}});
  ASSERT_EQ(steps.size(), 4U);
  std::int64_t end = 0;
  for (const Step& s : steps) end += s.own_ns;
  EXPECT_EQ(steps[0].own_ns, 40 * kMs);
  EXPECT_EQ(end, 201 * kMs);
}

// Cohen & Massaro 1993: equal dominance meets half way, a stronger one gets more; e^-1 after one reach.
TEST(Visemes, AreWeighedByDominance) {
  const auto even = blend_visemes({{{{0, 1.0}}, 1.0, 80 * kMs, 80 * kMs}, {{{0, 0.0}}, 1.0, 80 * kMs, 80 * kMs}});
  EXPECT_NEAR(value(even[1], 0), 0.5, 1e-12);                                // between them
  EXPECT_NEAR(value(even[0], 0), 1.0 / (1.0 + 0.36787944117144233), 1e-12);  // at the first one's middle
  const auto strong = blend_visemes({{{{0, 1.0}}, 3.0, 80 * kMs, 80 * kMs}, {{{0, 0.0}}, 1.0, 80 * kMs, 80 * kMs}});
  EXPECT_NEAR(value(strong[1], 0), 0.75, 1e-12);
}

TEST(Visemes, RoundTheConsonantsBeforeThem) {
  // "t" states the tongue alone; two thirds of the vowel's rounding are there while it is spoken.
  const Viseme t{{{1, 1.0}}, 0.6, 60 * kMs, 80 * kMs};
  const Viseme u{{{0, 0.6}}, 1.0, 120 * kMs, 120 * kMs};
  const auto steps = blend_visemes({t, u});
  EXPECT_GE(value(steps[0], 0), 0.4);
  EXPECT_GE(value(steps[2], 0), 0.57);
}

}  // namespace
}  // namespace nms::compiler
