// What `nmsc plot` and `nmsc gloss` make: pictures and overbar text as they stand in tests/golden/, and what holds of
// any picture. NMS_REFRESH=1 rewrites the goldens, among them the picture in docs/images/.
#include <algorithm>
#include <sstream>

#include <pugixml.hpp>

#include "command_run.h"

namespace {

using namespace nms::command_run;

/// Reads a picture as XML; every character and every number must be good.
pugi::xml_document picture(const std::string& svg) {
  pugi::xml_document document;
  const auto result = document.load_buffer(svg.data(), svg.size(), pugi::parse_full, pugi::encoding_utf8);
  EXPECT_TRUE(result) << result.description() << " at " << result.offset;
  EXPECT_STREQ(document.document_element().name(), "svg");
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_EQ(svg.find("inf\""), std::string::npos);
  EXPECT_EQ(svg.find("-0.00"), std::string::npos);
  return document;
}

bool has_text(const pugi::xml_document& document, const std::string& text) {
  return document.find_node([&](const pugi::xml_node& n) {
    return std::string_view(n.name()) == "text" && text == n.child_value();
  }) != nullptr;
}

TEST(Picture, is_as_it_was) {
  const Folder folder;
  struct Case {
    const char* file;
    const char* clip;
    const char* golden;
  };
  for (const Case& c : {Case{"wh_question.nms", "where_is_the_book", "docs/images/wh_question.svg"},
                        Case{"negation.nms", "i_do_not_understand_the_book", "tests/golden/plot/negation.svg"},
                        Case{"parallel_tracks.nms", "greeting", "tests/golden/plot/parallel_tracks.svg"}}) {
    const std::string svg = run(folder, fmt::format("plot {} --clip {} -o -", example(c.file), c.clip));
    picture(svg);
    expect_golden(kRoot / c.golden, svg);
  }
}

TEST(Overbar, is_as_it_was) {
  const Folder folder;
  for (const char* name : {"wh_question", "negation", "yes_no", "lexical"})
    expect_golden(kRoot / fmt::format("tests/golden/gloss/{}.txt", name),
                  run(folder, fmt::format("gloss {}", example(fmt::format("{}.nms", name)))));
}

TEST(Overbar, of_a_compiled_program_is_that_of_its_source) {
  const Folder folder;
  const std::string compiled = fmt::format("\"{}\"", (folder.path / "p.auc").string());
  run(folder, fmt::format("compile {} -o {}", example("wh_question.nms"), compiled));
  EXPECT_EQ(run(folder, fmt::format("gloss {}", compiled)), run(folder, "gloss " + example("wh_question.nms")));
  EXPECT_EQ(run(folder, fmt::format("plot {} --clip the_same -o -", compiled)),
            run(folder, fmt::format("plot {} --clip the_same -o -", example("wh_question.nms"))));
}

TEST(Overbar, puts_the_other_hand_below_as_long_as_it_is_there) {
  const Folder folder;
  const std::string file = source(folder,
                                  "utterance both in asl {\n"
                                  "  signs { topic[ CAR@0s..0.5s ] RED@0.7s..1.1s BIG@1.2s..1.7s }\n"
                                  "  signs nd { FIRST@0.6s..1.9s THAT@2s..2.2s }\n"
                                  "  wh on FIRST\n"
                                  "}\n"
                                  "utterance alone in asl { signs nd { THAT@0s..0.4s } }\n");
  EXPECT_EQ(run(folder, fmt::format("gloss {}", file)),
            "// both\n"
            " ___topic  _____wh\n"
            " CAR       RED BIG\n"
            "           FIRST--  THAT\n"
            "\n"
            "// alone\n"
            " THAT\n");
}

TEST(Overbar, stacks_by_nesting_and_snaps_to_signs) {
  const Folder folder;
  const std::string file = source(folder,
                                  "utterance u in asl {\n"
                                  "  signs { cond[ A@0s..0.4s mm[ B@0.5s..0.9s ] C@1s..1.4s ] D@1.5s..2s }\n"
                                  "  th over 1.6s..1.9s\n"
                                  "}\n");
  EXPECT_EQ(run(folder, fmt::format("gloss {} --clip u", file)),
            "// u\n"
            " _______cond\n"
            "    ___mm     ___th\n"
            " A  B      C  D\n");
}

TEST(Picture, escapes_hostile_glosses) {
  const Folder folder;
  const std::string file = source(folder, "utterance u in asl { signs { wh[ `<&\">`@0s..1s `]]>`@1s..2s ] } }\n");
  const auto document = picture(run(folder, fmt::format("plot {} --clip u -o -", file)));
  EXPECT_TRUE(has_text(document, "<&\">"));
  EXPECT_TRUE(has_text(document, "]]>"));
  EXPECT_TRUE(has_text(document, "wh"));
}

TEST(Picture, of_an_empty_clip_and_of_one_without_signs) {
  const Folder folder;
  const std::string file = source(folder, "timeline nothing 1s { }\ntimeline look 1s { gaze left over 0.2s..0.6s }\n");
  EXPECT_FALSE(has_text(picture(run(folder, fmt::format("plot {} --clip nothing -o -", file))), "signs"));
  const auto document = picture(run(folder, fmt::format("plot {} --clip look -o -", file)));
  EXPECT_FALSE(has_text(document, "signs"));
  EXPECT_FALSE(has_text(document, "non-manual signs"));
  EXPECT_TRUE(has_text(document, "gaze"));
}

TEST(Picture, of_two_hundred_signs_names_each_of_them) {
  const Folder folder;
  std::string text = "utterance u in asl { signs { wh[";
  for (int i = 0; i < 200; ++i) text += fmt::format(" G-{}@{}ms..{}ms", i, 300 * i, 300 * i + 250);
  const std::string file = source(folder, text + " ] } }\n");
  const auto document = picture(run(folder, fmt::format("plot {} --clip u -o -", file)));
  for (int i = 0; i < 200; ++i) EXPECT_TRUE(has_text(document, fmt::format("G-{}", i))) << i;
  const std::string bars = run(folder, fmt::format("gloss {}", file));
  EXPECT_EQ(std::count(bars.begin(), bars.end(), '\n'), 3);
}

TEST(Picture, draws_both_sides_once_where_they_are_equal) {
  const Folder folder;
  const std::string file =
      source(folder, "timeline t 1s { AU4 over 0.2s..0.6s\n  40% AU12L + 60% AU12R over 0.2s..0.6s }\n");
  const std::string svg = run(folder, fmt::format("plot {} --clip t -o -", file));
  EXPECT_NE(svg.find(">AU4</tspan>"), std::string::npos);
  EXPECT_NE(svg.find(">AU12L</tspan>"), std::string::npos);
  EXPECT_NE(svg.find(">AU12R</tspan>"), std::string::npos);
}

TEST(Picture, has_the_width_asked_for) {
  const Folder folder;
  const auto document =
      picture(run(folder, fmt::format("plot {} --clip the_same --width 640 -o -", example("wh_question.nms"))));
  EXPECT_EQ(document.document_element().attribute("width").as_int(), 640);
}

}  // namespace
