#include <gtest/gtest.h>
#include <nms/lang/diagnostic_kinds.h>
#include <nms/lang/render.h>
#include <nlohmann/json.hpp>

namespace nms::lang {
namespace {

std::shared_ptr<const Source> source(std::string text) { return std::make_shared<Source>("a.nms", std::move(text)); }

TEST(Source, lines_and_positions) {
  const Source s("a.nms", "ab\r\n\ncd");
  EXPECT_EQ(s.position(0).line, 1U);
  EXPECT_EQ(s.position(5).line, 3U);
  EXPECT_EQ(s.position(6).column, 2U);
  EXPECT_EQ(s.position(900).column, 3U);
  EXPECT_EQ(s.line(1), "ab");
  EXPECT_EQ(s.line(2), "");
  EXPECT_EQ(s.line(3), "cd");
  EXPECT_EQ(s.line(4), "");
}

TEST(Nearest, counts_swaps_and_folds_case) {
  const std::vector<std::string> names = {"squint", "squnit", "smile", "Smile", "brow_furrow"};
  EXPECT_EQ(nearest("sqiunt", names, 1), std::vector<std::string>{"squint"});
  EXPECT_EQ(nearest("SMILE", names), (std::vector<std::string>{"smile", "Smile"}));
  EXPECT_TRUE(nearest("gaze", names).empty());
  EXPECT_TRUE(nearest("", names).empty());
  EXPECT_EQ(nearest("a", {"b"}), std::vector<std::string>{"b"});
}

TEST(Diagnostics, beyond_the_most_they_are_counted) {
  Diagnostics d;
  const auto s = source("x");
  for (std::size_t i = 0; i < Diagnostics::kMaxKept + 5; ++i) d.report(s, {0, 1}, UnterminatedString{});
  EXPECT_EQ(d.all().size(), Diagnostics::kMaxKept);
  EXPECT_EQ(d.error_count(), Diagnostics::kMaxKept + 5);
  EXPECT_EQ(d.dropped(), 5U);
}

TEST(Diagnostics, are_sorted_by_file_then_place) {
  Diagnostics d;
  const auto a = source("xxxx");
  const auto b = source("yyyy");
  d.report(b, {2, 3}, UnterminatedString{});
  d.report(a, {3, 4}, UnterminatedString{});
  d.report(b, {1, 2}, UnterminatedGloss{});
  d.sort();
  EXPECT_EQ(d.all()[0].range.begin, 1U);
  EXPECT_EQ(d.all()[1].range.begin, 2U);
  EXPECT_EQ(d.all()[2].source, a);
}

TEST(RenderText, underlines_the_place_past_tabs_and_wide_characters) {
  Diagnostics d;
  const std::string text = "\t\xE5\xAE\xB6 e\xCC\x81 bad";
  d.report(source(text), {9, 12}, UnterminatedString{});
  EXPECT_EQ(render_text(d, false),
            "a.nms:1:10: error unterminated_string: the line ends inside a string\n"
            "  1 | " +
                text +
                "\n"
                "    | \t     ^~~\n"
                "help: write `\"` where the string ends\n");
}

TEST(RenderText, shows_nothing_that_moves_a_terminal) {
  Diagnostics d;
  d.report(source("a\x1b[31m\x07"), {0, 1}, UnterminatedString{});
  EXPECT_EQ(render_text(d, false).find('\x1b'), std::string::npos);
  EXPECT_NE(render_text(d, true).find('\x1b'), std::string::npos);
}

TEST(RenderText, a_file_of_one_long_line_is_cut) {
  Diagnostics d;
  d.report(source(std::string(1'000'000, 'x')), {500'000, 500'004}, UnterminatedString{});
  const std::string out = render_text(d, false);
  EXPECT_LT(out.size(), 600U);
  EXPECT_NE(out.find("^~~~"), std::string::npos);
}

TEST(RenderJson, says_the_same_for_programs) {
  Diagnostics d;
  Diagnostic& one = d.report(source("use \xff"), {4, 5}, UnknownUnit{"5", "\xff", {"s"}});
  one.labels.push_back({one.source, {0, 3}, "here"});
  const auto json = nlohmann::json::parse(render_json(d));
  EXPECT_EQ(json["errors"], 1);
  EXPECT_EQ(json["diagnostics"][0]["kind"], "unknown_unit");
  EXPECT_EQ(json["diagnostics"][0]["range"]["start"]["column"], 5);
  EXPECT_EQ(json["diagnostics"][0]["range"]["end"]["offset"], 5);
  EXPECT_EQ(json["diagnostics"][0]["labels"][0]["text"], "here");
  EXPECT_EQ(json["diagnostics"][0]["fields"]["nearest"], "s");
}

}  // namespace
}  // namespace nms::lang
