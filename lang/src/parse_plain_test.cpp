// A second blank sends a declaration round the short ways of parse_plain.cpp: with it and without, the tree is the
// same.
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nms/lang/parse.h>

namespace nms::lang {
namespace {

/// Plain declarations with, here and there, a word in the place of another.
class Texts {
 public:
  explicit Texts(std::uint32_t seed) : random_(seed) {}

  std::string next() {
    std::string out;
    for (int i = below(6); i >= 0; --i) out += below(2) == 0 ? pose() : expression();
    return out;
  }

 private:
  int below(int n) { return static_cast<int>(random_() % static_cast<std::uint32_t>(n)); }

  std::string word(std::string plain) {
    static const std::vector<std::string> kOthers = {
        "60%",    "1234567%", "100.5%", ".5%",        "60",       "AU12",      "AU12LC", "AU1x", "AUL4B", "LAU4",
        "AU",     "smile",    "facs",   "mouthing",   "\"a b\"",  "-",         "*",      "(",    ")",     "{",
        "}",      "+",        ":",      ",",          "\n",       ";",         "2s",     "2.5s", "2..5s", "1.2.3s",
        "2ms",    "2sx",      "pose",   "expression", "// a b\n", "///ab\n", "\t",     "\r\n", "",      "\xC3\xA9",
        "\"open", "over",     "[",      "`",          "slightly", "0.5",       "x=1"};
    return below(40) == 0 ? kOthers[static_cast<std::size_t>(below(static_cast<int>(kOthers.size())))] : plain;
  }
  std::string blank() { return word(" "); }
  std::string share() { return word(fmt::format("{}%", below(130))); }
  std::string name() { return word(below(9) == 0 ? "Lamb_7" : fmt::format("p{}", below(20))); }

  std::string pose() {
    std::string out = word("pose") + blank() + name() + blank() + word("=");
    for (int i = below(5); i >= 0; --i) {
      out += blank() + share() + blank() + word(fmt::format("AU{}{}", 1 + below(60), below(6) == 0 ? "L" : ""));
      if (i != 0) out += blank() + word("+");
    }
    return out + word("\n");
  }
  std::string expression() {
    std::string out = word("expression") + blank() + name() + blank();
    out += word(fmt::format("{}.{}s", below(9), below(10))) + blank() + word("{") + word("\n");
    for (int i = below(4); i >= 0; --i) out += word("  ") + share() + word(":") + blank() + name() + word("\n");
    return out + word("}") + word("\n");
  }

  std::mt19937 random_;
};

/// The text with every blank twice, and where each of its bytes stood.
struct Doubled {
  std::string text;
  std::vector<std::uint32_t> place;

  explicit Doubled(std::string_view plain) {
    for (std::uint32_t i = 0; i < plain.size(); ++i)
      for (int k = plain[i] == ' ' ? 2 : 1; k > 0; --k) {
        text += plain[i];
        place.push_back(i);
      }
    place.push_back(static_cast<std::uint32_t>(plain.size()));
  }
};

TEST(ParsePlain, the_short_way_makes_the_same_tree) {
  Texts texts(7);
  int whole = 0;
  for (int round = 0; round < 4'000; ++round) {
    const std::string text = texts.next();
    const Doubled doubled(text);
    Diagnostics said, said_of_doubled;
    const auto tree = parse(std::make_shared<Source>("a.nms", text), said);
    const auto other = parse(std::make_shared<Source>("a.nms", doubled.text), said_of_doubled);
    whole += said.error_count() == 0 ? 1 : 0;
    ASSERT_EQ(tree->nodes().size(), other->nodes().size()) << text;
    ASSERT_EQ(tree->declarations(), other->declarations()) << text;
    ASSERT_EQ(tree->comments().size(), other->comments().size()) << text;
    for (std::uint32_t i = 0; i < tree->nodes().size(); ++i) {
      const Node a = tree->nodes()[i];
      const Node b = other->nodes()[i];
      ASSERT_EQ(identifier(a.kind), identifier(b.kind)) << "node " << i << " of\n" << text;
      ASSERT_EQ(a.flags, b.flags) << "node " << i << " of\n" << text;
      ASSERT_EQ(a.next, b.next) << "node " << i << " of\n" << text;
      ASSERT_EQ(a.begin, doubled.place[b.begin]) << "node " << i << " of\n" << text;
      ASSERT_EQ(a.end, doubled.place[b.end]) << "node " << i << " of\n" << text;
    }
    ASSERT_EQ(said.all().size(), said_of_doubled.all().size()) << text;
    for (std::size_t i = 0; i < said.all().size(); ++i) {
      const Diagnostic& a = said.all()[i];
      const Diagnostic& b = said_of_doubled.all()[i];
      ASSERT_EQ(a.kind, b.kind) << text;
      ASSERT_EQ(a.range.begin, doubled.place[b.range.begin]) << a.kind << " in\n" << text;
    }
  }
  EXPECT_GT(whole, 500) << "too few texts without a fault";
}

}  // namespace
}  // namespace nms::lang
