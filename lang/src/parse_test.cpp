// What files of words cannot show: limits, hostile input, soundness of the tree.
#include <nms/lang/parse.h>

#include <gtest/gtest.h>
#include <nms/lang/diagnostic_kinds.h>

namespace nms::lang {
namespace {

struct Parsed {
  std::shared_ptr<const Tree> tree;
  Diagnostics diagnostics;
};
Parsed parsed(std::string text) {
  Parsed p;
  p.tree = parse(std::make_shared<Source>("a.nms", std::move(text)), p.diagnostics);
  return p;
}
std::string repeated(std::string_view text, int times) {
  std::string out;
  for (int i = 0; i < times; ++i) out += text;
  return out;
}

TEST(Parse, hostile_repetitions_end) {
  // Linear: a test that took the square of any of these would not come back.
  for (std::string_view piece :
       {"(",        ")",    "{",          "}",        "[",   "]",   "\"", "`",   "//",    "a(",           "a{",
        "pose a=(", "((2*", "lexicon a{", "entry a{", ";",   "\n",  "a[", "a( ", "else ", "over a else ", "..",
        "+-",       "\xff", "1",          "AU1+",     "use", "x\n", "}\n"}) {
    parsed(repeated(piece, 100'000));
    parsed("utterance u { signs { " + repeated(piece, 100'000));
    parsed("lexicon l { entry e { a " + repeated(piece, 100'000));
    parsed("pose p = " + repeated(piece, 100'000));
  }
}

TEST(Parse, a_file_too_large_is_refused) {
  const Parsed p = parsed(std::string(kMaxFileBytes + 1, ' '));
  ASSERT_EQ(p.diagnostics.error_count(), 1U);
  EXPECT_EQ(p.diagnostics.all()[0].kind, FileTooLarge::kKind);
  EXPECT_EQ(p.tree->nodes().size(), 1U);
}

TEST(Parse, the_deepest_nesting_is_accepted) {
  EXPECT_EQ(
      parsed("pose a = " + repeated("(", kMaxNesting) + "AU1" + repeated(")", kMaxNesting)).diagnostics.error_count(),
      0U);
  const Parsed p = parsed("pose a = " + repeated("(", kMaxNesting + 1) + "AU1" + repeated(")", kMaxNesting + 1));
  ASSERT_EQ(p.diagnostics.error_count(), 1U);
  EXPECT_EQ(p.diagnostics.all()[0].kind, NestingTooDeep::kKind);
}

TEST(Parse, statements_after_a_fault_are_whole) {
  const Parsed p = parsed("timeline t 1s {\n  a at\n  b at 0.2s\n}\npose q = AU1\n");
  EXPECT_EQ(p.diagnostics.error_count(), 1U);
  const NodeRef timeline = p.tree->root().at(0);
  EXPECT_FALSE(timeline.has(kFlagError));
  EXPECT_TRUE(timeline.child(NodeKind::placement).has(kFlagError));
  const NodeRef pose = p.tree->root().child(NodeKind::pose);
  ASSERT_TRUE(pose.exists());
  EXPECT_FALSE(pose.has(kFlagError));
}

TEST(Parse, more_errors_than_kept_are_counted) {
  const Parsed p = parsed(repeated("gadget\n", 5000));
  EXPECT_EQ(p.diagnostics.error_count(), 5000U);
  EXPECT_EQ(p.diagnostics.all().size(), Diagnostics::kMaxKept);
}

TEST(Parse, a_group_before_a_star_becomes_a_factor) {
  const Parsed p = parsed("pose a = ((1 + k) * 2 + j) * P + Q");
  EXPECT_EQ(p.diagnostics.error_count(), 0U);
  const NodeRef sum = p.tree->root().at(0).child(NodeKind::sum);
  const NodeRef factor = sum.at(0).at(0);
  EXPECT_EQ(factor.kind(), NodeKind::factor);
  EXPECT_EQ(factor.at(0).kind(), NodeKind::group);
  EXPECT_EQ(factor.at(0).at(0).at(0).at(0).kind(), NodeKind::factor);
  EXPECT_EQ(sum.at(0).at(1).text(), "P");
  EXPECT_EQ(sum.at(1).at(0).text(), "Q");
  EXPECT_FALSE(sum.at(2).exists());
}

}  // namespace
}  // namespace nms::lang
