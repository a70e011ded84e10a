// Brackets round a sum mean nothing, and send it round the short ways of plain_movement.cpp: with them and without, the
// same is reported and the same is played.
#include <algorithm>
#include <memory>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <nms/compiler/compile.h>

#include "embedded_library.h"

namespace {

using namespace nms;

/// Definitions that are plain, nearly plain and wrong, each on lines of its own; with brackets round sums, or without.
class Definitions {
 public:
  Definitions(std::uint32_t seed, bool brackets) : random_(seed), brackets_(brackets) {}

  std::string next() {
    std::string out;
    for (int i = 4 + below(30); i >= 0; --i) out += below(5) < 3 ? pose() : expression();
    return out;
  }

 private:
  int below(int n) { return static_cast<int>(random_() % static_cast<std::uint32_t>(n)); }
  std::string bracketed(const std::string& sum) const { return brackets_ ? "(" + sum + ")" : sum; }

  /// Lids that hide and are hidden, a blink that may not last, axes of both signs, mouths; seldom none at all.
  std::string unit() {
    static constexpr int kUnits[] = {1, 2, 4, 5, 5, 12, 25, 26, 43, 45, 51, 52, 53, 54, 61, 62};
    const int number = below(200) == 0 ? 998 : kUnits[below(16)];
    static const std::string kEnds[] = {"L", "R", "C", "LB"};
    return fmt::format("AU{}{}", number, below(30) == 0 ? kEnds[below(4)] : "");
  }
  std::string name() { return fmt::format("p{}", below(below(60) == 0 ? 40 : std::max(poses_, 1))); }
  std::string pose() {
    std::string sum;
    for (int i = below(4); i >= 0; --i) {
      const int percent = below(25) == 0 ? 130 : below(101);
      sum += fmt::format("{}% {}{}", percent, unit(), i == 0 ? "" : below(20) == 0 ? " - " : " + ");
    }
    const std::string params = below(25) == 0 ? "(k = 50%)" : "";
    const std::string named = below(20) == 0 ? name() + " + " : "";
    const std::string own = below(60) == 0 ? name() : fmt::format("p{}", poses_++);
    return fmt::format("pose {}{} = {}\n", own, params, bracketed(named + sum));
  }
  std::string expression() {
    std::string out =
        fmt::format("expression e{} {}.{}s {{\n", below(60) == 0 ? 0 : expressions_++, below(2), 1 + below(9));
    int left = below(40) != 0 ? 100 : below(2) == 0 ? 90 : 110;
    for (int i = below(3); i >= 0; --i) {
      const int share = i == 0 ? left : below(left + 1);
      left -= share;
      const std::string pose = below(60) == 0 ? "e1" : below(30) == 0 ? "smile" : name();
      out += fmt::format("  {}%: {}\n", share, bracketed(pose));
    }
    return out + "}\n";
  }

  std::mt19937 random_;
  bool brackets_;
  int poses_ = 0;
  int expressions_ = 0;
};

/// What is said where: by kind and line, since columns move.
using Said = std::vector<std::tuple<std::uint32_t, std::string_view>>;

Said sorted(const lang::Diagnostics& diagnostics) {
  Said said;
  for (const lang::Diagnostic& d : diagnostics.all())
    said.emplace_back(d.source ? d.source->position(d.range.begin).line : 0, d.kind);
  std::sort(said.begin(), said.end());
  return said;
}

Said checked(const std::string& text) {
  EmbeddedLibrary library;
  lang::Diagnostics diagnostics;
  compiler::check({std::make_shared<const lang::Source>("test.nms", text)}, library, diagnostics);
  return sorted(diagnostics);
}

struct Compiled {
  Said said;
  std::vector<program::Knot> knots;
  std::size_t clips = 0;
};
Compiled compiled(const std::string& text) {
  EmbeddedLibrary library;
  lang::Diagnostics diagnostics;
  auto draft = compiler::compile({std::make_shared<const lang::Source>("test.nms", text)}, library, diagnostics);
  Compiled out{sorted(diagnostics), {}, 0};
  if (draft) {
    out.knots = std::move(draft->knots);
    out.clips = draft->clips.size();
  }
  return out;
}

TEST(PlainMovement, the_short_way_comes_to_the_same) {
  int silent = 0;
  int played = 0;
  for (std::uint32_t seed = 0; seed < 400; ++seed) {
    const std::string text = Definitions(seed, false).next();
    const std::string bracketed = Definitions(seed, true).next();
    const Said said = checked(text);
    ASSERT_EQ(said, checked(bracketed)) << text;
    const Compiled program = compiled(text);
    const Compiled other = compiled(bracketed);
    ASSERT_EQ(said, program.said) << text;
    ASSERT_EQ(said, other.said) << text;
    ASSERT_EQ(program.clips, other.clips) << text;
    ASSERT_EQ(program.knots.size(), other.knots.size()) << text;
    const auto bytes = [](const Compiled& c) {
      return std::string(reinterpret_cast<const char*>(c.knots.data()), c.knots.size() * sizeof(program::Knot));
    };
    ASSERT_TRUE(bytes(program) == bytes(other)) << text;
    silent += said.empty() ? 1 : 0;
    played += program.knots.empty() ? 0 : 1;
  }
  // A third of the point is lost if hardly any of them is right.
  EXPECT_GT(played, 20) << silent << " of 400 had nothing to report";
}

}  // namespace
