#include "lexer.h"

#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include <gtest/gtest.h>

namespace nms::lang {
namespace {

std::vector<Token> tokens(std::string_view text) {
  std::vector<Comment> comments;
  Lexer lexer(text, comments);
  std::vector<Token> all;
  do {
    all.push_back(lexer.next());
  } while (all.back().kind != Tok::eof);
  return all;
}

std::string_view first_gloss(std::string_view text) {
  std::vector<Comment> comments;
  Lexer lexer(text, comments);
  const Token t = lexer.gloss(lexer.next());
  return t.kind == Tok::gloss ? text.substr(t.begin, t.end - t.begin) : std::string_view();
}

TEST(Lexer, tells_action_units_from_names) {
  for (std::string_view au : {"AU12", "AU14RC", "AU19B", "AUL20B", "AU20LB", "LAU4", "AU12CR"})
    EXPECT_TRUE(is_au_token(au)) << au;
  for (std::string_view name : {"AU", "AUDIO", "AUX1", "AU12F", "LAU", "A1", "au12", "AU1x", ""})
    EXPECT_FALSE(is_au_token(name)) << name;
}

TEST(Lexer, a_number_takes_its_unit_but_no_range) {
  const std::vector<Token> t = tokens("0.2s..1.5s 60%+2Hz");
  ASSERT_EQ(t.size(), 7U);
  EXPECT_EQ(t[0].end, 4U);
  EXPECT_EQ(t[1].kind, Tok::dot_dot);
  EXPECT_EQ(t[2].kind, Tok::quantity);
  EXPECT_EQ(t[3].kind, Tok::quantity);
  EXPECT_EQ(t[4].kind, Tok::plus);
}

TEST(Lexer, a_gloss_is_a_run) {
  EXPECT_EQ(first_gloss("NOT-YET x"), "NOT-YET");
  EXPECT_EQ(first_gloss("#NO"), "#NO");
  EXPECT_EQ(first_gloss("(1h)GO]"), "(1h)GO");
  EXPECT_EQ(first_gloss("i:THROW:j@0s"), "i:THROW:j");
  EXPECT_EQ(first_gloss("IX-3..WHERE"), "IX-3");
  EXPECT_EQ(first_gloss("READ_2+// c"), "READ_2+");
  EXPECT_EQ(first_gloss("THINK/KNOW;"), "THINK/KNOW");
  EXPECT_EQ(first_gloss("WHO, 80%"), "WHO");
  EXPECT_EQ(first_gloss("BPCL:5\"chewing\""), "BPCL:5");
  EXPECT_EQ(first_gloss("`NEW YORK` x"), "`NEW YORK`");
  EXPECT_EQ(first_gloss("@0s"), "");
}

TEST(Lexer, gathers_comments) {
  std::vector<Comment> comments;
  Lexer lexer("// a\nx // b\n", comments);
  EXPECT_EQ(lexer.next().kind, Tok::name);
  EXPECT_EQ(lexer.next().kind, Tok::eof);
  ASSERT_EQ(comments.size(), 2U);
  EXPECT_TRUE(comments[0].own_line);
  EXPECT_FALSE(comments[1].own_line);
}

/// All kinds of tokens in the golden files, as lexed in normal mode.
TEST(Lexer, every_token_kind_occurs_in_a_golden_file) {
  std::set<Tok> seen;
  for (const auto& e :
       std::filesystem::directory_iterator(std::filesystem::path(NMS_SOURCE_DIR) / "tests/golden/lang")) {
    if (e.path().extension() != ".nms") continue;
    std::ifstream file(e.path(), std::ios::binary);
    std::stringstream text;
    text << file.rdbuf();
    for (const Token& t : tokens(text.str())) seen.insert(t.kind);
  }
  for (int kind = 0; kind <= static_cast<int>(Tok::invalid); ++kind)
    EXPECT_TRUE(seen.count(static_cast<Tok>(kind))) << "no file of tests/golden/lang has a token of kind " << kind;
}

TEST(Lexer, every_byte_is_in_some_token) {
  for (int c = 0; c < 256; ++c) {
    const std::string text(3, static_cast<char>(c));
    EXPECT_LE(tokens(text).size(), 4U) << c;
  }
}

}  // namespace
}  // namespace nms::lang
