// Holds docs/grammar.ebnf against the parser: sentences are drawn from the grammar as it is printed there, and the
// parser must take each of them. What a production leaves out of a construct is not found by this; the golden files,
// which are written by hand, are. Every production must be used, and every name in it must be one of a production or of
// a token.
#include <algorithm>
#include <cstdint>
#include <fstream>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <nms/lang/parse.h>
#include <nms/lang/render.h>

namespace {

using namespace nms::lang;

/// A grammar's right-hand side.
struct Rule {
  enum class Kind { choice, sequence, optional, repeat, terminal, name };
  Kind kind = Kind::sequence;
  std::vector<Rule> parts;
  std::string text;
};

class Grammar {
 public:
  explicit Grammar(const std::string& text) {
    lex(text);
    while (at_ < tokens_.size()) {
      const std::string name = next();
      expect("=");
      EXPECT_TRUE(rules.emplace(name, choice()).second) << name << " has two productions";
      order.push_back(name);
      expect(";");
    }
  }

  std::map<std::string, Rule> rules;
  std::vector<std::string> order;

 private:
  void lex(const std::string& text) {
    for (std::size_t i = 0; i < text.size();) {
      if (text.compare(i, 2, "(*") == 0) {
        i = text.find("*)", i) + 2;
      } else if (text[i] == '"') {
        const std::size_t end = text.find('"', i + 1);
        tokens_.push_back(text.substr(i, end - i));  // without the closing quote: `"pose`
        i = end + 1;
      } else if (std::isalpha(static_cast<unsigned char>(text[i])) != 0) {
        std::size_t end = i;
        while (std::isalnum(static_cast<unsigned char>(text[end])) != 0 || text[end] == '_') ++end;
        tokens_.push_back(text.substr(i, end - i));
        i = end;
      } else {
        if (std::isspace(static_cast<unsigned char>(text[i])) == 0) tokens_.emplace_back(1, text[i]);
        ++i;
      }
    }
  }
  [[nodiscard]] std::string peek() const { return at_ < tokens_.size() ? tokens_[at_] : std::string(); }
  std::string next() { return at_ < tokens_.size() ? tokens_[at_++] : std::string(); }
  void expect(const std::string& token) {
    const std::string got = next();
    if (got != token) {
      ADD_FAILURE() << "the grammar has `" << got << "` where `" << token << "` should stand, after " << order.size()
                    << " productions";
      at_ = tokens_.size();
    }
  }
  Rule choice() {
    Rule r{Rule::Kind::choice, {sequence()}, {}};
    while (peek() == "|") {
      next();
      r.parts.push_back(sequence());
    }
    return r.parts.size() == 1 ? r.parts[0] : r;
  }
  Rule sequence() {
    Rule r{Rule::Kind::sequence, {}, {}};
    const std::set<std::string> ends{"|", ";", ")", "]", "}", ""};
    while (ends.count(peek()) == 0) r.parts.push_back(item());
    return r;
  }
  Rule item() {
    const std::string token = next();
    const auto inner = [this](Rule::Kind kind, const char* closer) {
      Rule r{kind, {choice()}, {}};
      expect(closer);
      return r;
    };
    if (token == "(") return inner(Rule::Kind::sequence, ")");
    if (token == "[") return inner(Rule::Kind::optional, "]");
    if (token == "{") return inner(Rule::Kind::repeat, "}");
    if (token[0] == '"') return {Rule::Kind::terminal, {}, token.substr(1)};
    return {Rule::Kind::name, {}, token};
  }

  std::vector<std::string> tokens_;
  std::size_t at_ = 0;
};

/// What the grammar leaves to the lexer, with examples. The first is the one taken where a sentence gets too deep.
const std::map<std::string, std::vector<std::string>> kLexical = {
    {"name", {"alpha", "beta", "gamma_2", "Delta"}},
    {"string", {R"("text")", R"("a \"b\" \\")", R"("")"}},
    {"quantity", {"60%", "-200ms", "2.34s", "15deg", "2Hz", "3x", "8mm", "0.5"}},
    {"gloss", {"BOOK", "IX-3", "`NEW YORK`", "#NO", "(1h)GO", "i:THROW:j", "READ_2+"}},
    {"label", {"wh", "topic", "y/n", "rs:3a"}},
    {"digits", {"12", "4", "101"}},
    {"function", {"syntactic", "lexical"}},
    {"doc", {"/// what it means\n"}},
    {"nl", {"\n", ";", "\n\n"}},
    {"eof", {"\n"}},
};

class Generator {
 public:
  Generator(const Grammar& grammar, std::uint32_t seed) : grammar_(grammar), random_(seed) { measure(); }

  std::string sentence(const std::string& start) {
    text_.clear();
    size_ = 0;
    produce(start, 0);
    return text_;
  }
  std::set<std::string> used;

 private:
  static constexpr int kUnknown = 1000;

  /// How deep the shallowest sentence of each production is.
  void measure() {
    for (const auto& [name, rule] : grammar_.rules) depth_[name] = kUnknown;
    for (bool changed = true; changed;) {
      changed = false;
      for (const auto& [name, rule] : grammar_.rules) {
        const int d = least(rule) + 1;
        if (d < depth_[name]) {
          depth_[name] = d;
          changed = true;
        }
      }
    }
  }
  [[nodiscard]] int least(const Rule& r) const {
    switch (r.kind) {
      case Rule::Kind::choice: {
        int d = kUnknown;
        for (const Rule& p : r.parts) d = std::min(d, least(p));
        return d;
      }
      case Rule::Kind::sequence: {
        int d = 0;
        for (const Rule& p : r.parts) d = std::max(d, least(p));
        return d;
      }
      case Rule::Kind::name: {
        const auto it = depth_.find(r.text);
        return it == depth_.end() ? 0 : it->second;
      }
      default:
        return 0;
    }
  }
  // Draws by remainders: the distributions of the C++ library differ between machines.
  std::size_t draw(std::size_t n) { return random_() % n; }

  void produce(const std::string& name, int depth) {
    // No property stands twice in a block, and so no profile.
    if (name == "profile" && std::exchange(has_profile_, true)) return property(depth);
    used.insert(name);
    if (name == "options" || name == "entry") {
      const bool outer_profile = std::exchange(has_profile_, false);
      const std::size_t outer_properties = std::exchange(properties_, 0);
      derive(name, depth);
      has_profile_ = outer_profile;
      properties_ = outer_properties;
      return;
    }
    derive(name, depth);
  }

  void derive(const std::string& name, int depth) {
    const auto lexical = kLexical.find(name);
    if (name == "sum" && production_ == "motion") emit("alpha +");  // what begins with steps is steps
    // What a label's bracket may not hold is said in a comment.
    if (name == "arguments" && production_ == "bracket") return emit(draw(2) == 0 ? "60%" : "alpha = 2 * beta");
    if (name == "quantity" && production_ == "step") return emit("60%");  // a step's length has no sign
    if (lexical != kLexical.end()) {
      emit(lexical->second[depth > kDeepest ? 0 : draw(lexical->second.size())]);
      return;
    }
    const auto rule = grammar_.rules.find(name);
    if (rule == grammar_.rules.end()) {
      ADD_FAILURE() << "the grammar speaks of " << name << ", which is no production and no token";
      return;
    }
    const std::string outer = std::exchange(production_, name);
    expand(rule->second, depth + 1);
    production_ = outer;
    glue_ = false;
  }

  void expand(const Rule& r, int depth) {
    const bool deep = depth > kDeepest || size_ > kMostTokens;
    switch (r.kind) {
      case Rule::Kind::choice: {
        std::vector<const Rule*> open;
        int best = kUnknown;
        for (const Rule& p : r.parts) best = std::min(best, least(p));
        for (const Rule& p : r.parts)
          if (!deep || least(p) == best) open.push_back(&p);
        expand(*open[draw(open.size())], depth);
        break;
      }
      case Rule::Kind::sequence:
        for (const Rule& p : r.parts) expand(p, depth);
        break;
      case Rule::Kind::optional:
        if (!deep && draw(2) == 0) expand(r.parts[0], depth);
        break;
      case Rule::Kind::repeat:
        if (deep) break;
        for (std::size_t n = draw(4); n > 0; --n) expand(r.parts[0], depth);
        break;
      case Rule::Kind::terminal:
        emit(r.text);
        break;
      case Rule::Kind::name:
        if (r.text == "property" || r.text == "option") {
          used.insert(r.text);
          property(depth);
        } else {
          produce(r.text, depth);
        }
        break;
    }
  }

  /// A property's name decides, in an entry, that it is one; and no property stands twice. The rest is the grammar's.
  void property(int depth) {
    static const std::vector<std::string> kEntry = {"spreads", "onset", "offset", "lead", "lag", "easing"};
    const std::size_t n = properties_++;
    const bool in_options = production_ == "options";
    if (production_ == "utterance") {
      emit("source");
    } else if (production_ == "entry_item") {
      emit(n < kEntry.size() ? kEntry[n] : "label");
    } else {
      emit("property_" + std::to_string(n));
    }
    const std::size_t values = in_options ? 1 + draw(2) : draw(3);
    for (std::size_t i = 0; i < values; ++i) produce(i == 0 ? "value" : in_options ? "unnamed" : "further", depth + 1);
  }

  void emit(const std::string& token) {
    ++size_;
    const bool together = touches(token);
    if (token[0] == '/' && !text_.empty() && text_.back() != '\n') text_ += '\n';  // a line of its own
    if (!together && !text_.empty() && text_.back() != '\n') text_ += ' ';
    text_ += token;
  }
  /// Where no blank may stand: inside an action unit's token, before the `[` of a bracket, before a call's `(`.
  bool touches(const std::string& token) {
    if (production_ == "au_token") return std::exchange(glue_, true);
    if (token == "[" && production_ == "bracket") return true;
    return token == "(" &&
           (production_ == "call" || production_ == "bracket" || production_ == "role_shift" || production_ == "play");
  }

  static constexpr int kDeepest = 14;
  static constexpr std::size_t kMostTokens = 400;
  const Grammar& grammar_;
  std::mt19937 random_;
  std::map<std::string, int> depth_;
  std::string text_;
  std::string production_;
  std::size_t size_ = 0;
  std::size_t properties_ = 0;
  bool has_profile_ = false;
  bool glue_ = false;
};

std::string read(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

TEST(Grammar, the_parser_takes_what_the_grammar_makes) {
  const Grammar grammar(read(std::string(NMS_SOURCE_DIR) + "/docs/grammar.ebnf"));
  ASSERT_GT(grammar.rules.size(), 40U);
  Generator generator(grammar, 20050419);
  int refused = 0;
  for (int i = 0; i < 20000 && refused < 5; ++i) {
    const std::string text = generator.sentence("file");
    Diagnostics diagnostics;
    const auto tree = parse(std::make_shared<const Source>("sentence.nms", text), diagnostics);
    if (diagnostics.all().empty()) continue;
    ++refused;
    ADD_FAILURE() << "sentence " << i << "\n"
                  << render_text(diagnostics, false).substr(0, 600) << "\n---\n"
                  << text.substr(0, 1500);
  }
  for (const std::string& name : grammar.order) EXPECT_TRUE(generator.used.count(name)) << name << " is never used";
}

TEST(Grammar, the_formatter_keeps_the_tree_of_what_the_grammar_makes) {
  const Grammar grammar(read(std::string(NMS_SOURCE_DIR) + "/docs/grammar.ebnf"));
  Generator generator(grammar, 1978);
  int wrong = 0;
  for (int i = 0; i < 3000 && wrong < 3; ++i) {
    const std::string text = generator.sentence("file");
    Diagnostics diagnostics;
    const auto tree = parse(std::make_shared<const Source>("sentence.nms", text), diagnostics);
    const std::string once = format(*tree);
    const auto again = parse(std::make_shared<const Source>("sentence.nms", once), diagnostics);
    if (diagnostics.all().empty() && dump(*again) == dump(*tree) && format(*again) == once) continue;
    ++wrong;
    ADD_FAILURE() << "sentence " << i << "\n"
                  << render_text(diagnostics, false).substr(0, 600) << "\n--- written\n"
                  << text.substr(0, 1500) << "\n--- formatted\n"
                  << once.substr(0, 1500);
  }
}

}  // namespace
