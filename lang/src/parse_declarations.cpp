// The file and its declarations, but for lexicons, utterances and faces.
#include <fmt/format.h>

#include "parser.h"

namespace nms::lang {

void Parser::file() {
  Open node(*this, NodeKind::file);
  nodes_.set_begin(node.node(), 0);
  advance();
  while (token_.kind != Tok::eof) {
    if (token_.kind == Tok::semicolon) {
      advance();
      continue;
    }
    statement([this] { declaration(); });
  }
  poison_ = false;
  previous_end_ = static_cast<std::uint32_t>(text_.size());
}

// The `///` comments right before the token become nodes of the declaration that is open.
bool Parser::take_docs() {
  std::vector<Comment>& comments = tree_->comments_;
  const auto is_doc = [this](const Comment& c) {
    const std::string_view t = text_.substr(c.range.begin, c.range.end - c.range.begin);
    return c.own_line && t.size() >= 3 && t[2] == '/' && (t.size() == 3 || t[3] != '/');
  };
  std::size_t first = comments.size();
  while (first > 0 && comments[first - 1].range.begin >= previous_end_ && is_doc(comments[first - 1])) --first;
  if (first == comments.size()) return false;
  nodes_.set_begin(nodes_.size() - 1, comments[first].range.begin);
  for (std::size_t i = first; i < comments.size(); ++i) {
    std::uint32_t begin = comments[i].range.begin + 3;
    std::uint32_t end = comments[i].range.end;
    if (begin < end && text_[begin] == ' ') ++begin;
    while (end > begin && (text_[end - 1] == ' ' || text_[end - 1] == '\t' || text_[end - 1] == '\r')) --end;
    leaf_of(NodeKind::doc_comment, begin, end);
  }
  comments.resize(first);
  return true;
}

void Parser::declaration() {
  struct Row {
    std::string_view word;
    NodeKind kind;
    bool (Parser::*parse)();
    bool (Parser::*plain)() = nullptr;  ///< reads it if it is of the commonest form
  };
  static constexpr Row kRows[] = {
      {"pose", NodeKind::pose, &Parser::pose, &Parser::plain_pose},
      {"expression", NodeKind::expression, &Parser::expression, &Parser::plain_expression},
      {"use", NodeKind::use, &Parser::use},
      {"motion", NodeKind::motion, &Parser::motion},
      {"timeline", NodeKind::timeline, &Parser::timeline},
      {"lexicon", NodeKind::lexicon, &Parser::lexicon},
      {"utterance", NodeKind::utterance, &Parser::utterance},
      {"discourse", NodeKind::discourse, &Parser::discourse},
      {"test", NodeKind::test, &Parser::test},
      {"degree", NodeKind::degree, &Parser::degree},
      {"au", NodeKind::au, &Parser::au},
      {"axis", NodeKind::axis, &Parser::axis},
      {"track", NodeKind::track, &Parser::track},
      {"muscle", NodeKind::muscle, &Parser::muscle},
      {"face", NodeKind::face, &Parser::face},
      {"ambient", NodeKind::ambient, &Parser::ambient},
  };
  if (at(Tok::name)) {
    const std::string_view word = slice(token_);
    for (const Row& row : kRows) {
      if (row.word != word) continue;
      Open node(*this, row.kind);
      tree_->declarations_.push_back(node.node());
      take_docs();
      if (row.plain != nullptr && (this->*row.plain)()) return;
      advance();
      (this->*row.parse)();
      return;
    }
    std::vector<std::string> words;
    for (const Row& row : kRows) words.emplace_back(row.word);
    words.emplace_back("entry");
    std::vector<std::string> near = word == "entry" ? std::vector<std::string>{} : nearest(word, words);
    if (word == "entry") {
      fail(here(), UnexpectedToken{"`entry`", "a declaration", "entries stand inside `lexicon name { }`"});
      return;
    }
    std::erase(near, "entry");
    fail(here(), UnknownDeclaration{std::string(word), std::move(near)});
    return;
  }
  if (token_.kind == Tok::right_brace) {
    // A run of stray braces is one fault.
    const std::uint32_t begin = token_.begin;
    token_.line_break = false;
    unexpected("a declaration", "remove the `}`, or open its block with `{` before");
    panic_ = false;
    std::uint32_t end = begin;
    while (token_.kind == Tok::right_brace) {
      end = token_.end;
      advance();
    }
    previous_ = Tok::right_brace;
    leaf_of(NodeKind::error, begin, end, kFlagError);
    return;
  }
  unexpected("a declaration", token_.kind == Tok::plus || token_.kind == Tok::minus
                                  ? "a sum goes on over lines when the line above ends with its `+` or `-`"
                                  : "");
}

bool Parser::name(std::string_view what) {
  if (!at(Tok::name)) return unexpected(what, at(Tok::au_token) ? "this is an action unit's name; choose another" : "");
  leaf(NodeKind::name);
  return true;
}

bool Parser::string(std::string_view what) {
  if (!at(Tok::string)) return unexpected(what);
  leaf(NodeKind::string);
  return true;
}

bool Parser::params() {
  Open node(*this, NodeKind::params);
  const std::uint32_t opener = token_.begin;
  open_bracket();
  while (!at(Tok::right_paren)) {
    {
      Open parameter(*this, NodeKind::param);
      if (!name("a parameter's name")) return false;
      if (at(Tok::equal)) {
        advance();
        if (at_quantity()) {
          if (!quantity()) return false;
        } else if (!name("a default: a quantity or a name")) {
          return false;
        }
      }
    }
    if (!at(Tok::comma)) break;
    advance();
  }
  return closing(Tok::right_paren, '(', opener, "`,` or `)`");
}

bool Parser::use() { return string("a file's name in quotes"); }

bool Parser::pose() {
  if (!name("the pose's name")) return false;
  if (at(Tok::left_paren) && !params()) return false;
  if (!expect(Tok::equal, "`=`")) return false;
  return sum();
}

bool Parser::degree() {
  if (!name("the degree's name")) return false;
  if (!expect(Tok::equal, "`=`", "write `degree slightly = 50%`")) return false;
  return quantity("a factor, as 50%");
}

bool Parser::expression() {
  name("the expression's name") && (!at(Tok::left_paren) || params()) && (!at_quantity() || quantity());
  skip_to_block();
  return !panic_ && block([this] { return step(); });
}

bool Parser::motion() {
  if (!name("the motion's name")) return false;
  if (at(Tok::left_paren) && !params()) return false;
  if (!expect(Tok::equal, "`=`")) return false;
  return at_steps() ? steps() : sum();
}

bool Parser::timeline() {
  name("the timeline's name") && (!at(Tok::left_paren) || params()) && (!at_quantity() || quantity());
  skip_to_block();
  return !panic_ && block([this] { return at_ambience() ? ambience() : placement(); });
}

bool Parser::ambient() {
  name("the ambient's name") && (!at(Tok::left_paren) || params());
  skip_to_block();
  return !panic_ && block([this] {
    Open node(*this, NodeKind::placement);
    if (!sum()) return false;
    if (at_word("fill")) leaf(NodeKind::fill);
    return !at(Tok::left_brace) || options();
  });
}

// `ambient NAME`: the word is a keyword where a name follows that no placement goes on with.
bool Parser::at_ambience() {
  if (!at_word("ambient")) return false;
  const Mark before = mark();
  advance();
  const bool follows = at(Tok::name) && !at_word("over") && !at_word("at") && !at_word("on") && !at_word("fill");
  go_back(before);
  return follows;
}

bool Parser::ambience() {
  Open node(*this, NodeKind::ambience);
  advance();
  return name("the ambient's name") && call_arguments();
}

bool Parser::test() {
  string("the test's title in quotes");
  skip_to_block();
  return !panic_ && block([this] {
    if (at_word("play")) return play();
    if (at_word("expect")) return expect_();
    return unexpected("`play` or `expect`");
  });
}

bool Parser::play() {
  Open node(*this, NodeKind::play);
  advance();
  if (!name("the name of what to play")) return false;
  if (!call_arguments()) return false;
  if (at_word("for")) {
    Open duration(*this, NodeKind::duration);
    advance();
    return quantity("a time");
  }
  return true;
}

// `(ARGUMENTS)` after a name, if there are any.
bool Parser::call_arguments() {
  if (!at(Tok::left_paren)) return true;
  const std::uint32_t opener = token_.begin;
  if (!enter()) return false;
  const bool ok = arguments(opener);
  leave();
  return ok;
}

bool Parser::expect_() {
  Open node(*this, NodeKind::expect);
  advance();
  if (!sum()) return false;
  const auto comparison_here = [this] {
    return at(Tok::equal_equal) || at(Tok::less_equal) || at(Tok::greater_equal) || at(Tok::less) || at(Tok::greater);
  };
  bool compares = false;
  if (at_word("rises") || at_word("falls") || at_word("never")) {
    const bool never = at_word("never");
    leaf(NodeKind::comparison);
    compares = never && comparison_here();
  } else {
    compares = comparison_here();
    if (!compares && at(Tok::equal)) return unexpected("a comparison", "write `==` to compare");
  }
  if (compares) {
    leaf(NodeKind::comparison);
    if (!quantity("a quantity to compare with")) return false;
    if (at(Tok::plus) && lexer_.byte(token_.end) == '-') {
      Open tolerance(*this, NodeKind::tolerance);
      advance();
      advance();
      if (!quantity("a tolerance")) return false;
    }
  }
  if (at_word("at")) {
    Open place(*this, NodeKind::at);
    advance();
    return point();
  }
  if (at_word("over")) return over();
  if (at_word("from")) {
    Open range(*this, NodeKind::from_to);
    advance();
    if (!at_point()) return false;
    if (!at_word("to")) return unexpected("`to`", "write `from POINT to POINT`");
    advance();
    return at_point();
  }
  return true;
}

bool Parser::discourse() {
  name("the discourse's name");
  if (!panic_ && at_word("in")) {
    Open in(*this, NodeKind::in);
    advance();
    name("a lexicon's name");
  }
  skip_to_block();
  return !panic_ && block([this] { return discourse_item(); });
}

bool Parser::discourse_item() {
  const auto placements = [this] { return block([this] { return at_ambience() ? ambience() : placement(); }); };
  if (at_ambience()) return ambience();
  if (at_word("role") || at_word("locus")) {
    Open node(*this, at_word("role") ? NodeKind::role : NodeKind::locus);
    advance();
    if (!name(nodes_.kind(node.node()) == NodeKind::role ? "the role's name" : "the locus' name")) return false;
    while (!at_statement_end()) {
      if (at_quantity()) {
        if (!quantity()) return false;
      } else if (!name("a name or an angle")) {
        return false;
      }
    }
    return true;
  }
  if (at_word("pause")) {
    Open node(*this, NodeKind::pause);
    advance();
    return quantity("a time");
  }
  if (at_word("by")) {
    Open node(*this, NodeKind::by);
    advance();
    name("who acts");
    skip_to_block();
    return !panic_ && placements();
  }
  if (at_word("rs") && lexer_.byte_after_blanks(token_.end) == '(') return role_shift();
  return name("an utterance's name, role, locus, pause, rs, by or ambient");
}

bool Parser::role_shift() {
  Open node(*this, NodeKind::role_shift);
  advance();
  std::uint32_t opener = token_.begin;
  open_bracket();
  if (!name("the role's name")) return false;
  if (!closing(Tok::right_paren, '(', opener, "`)`")) return false;
  opener = token_.begin;
  if (!at(Tok::left_bracket)) return unexpected("`[`", "write `rs(role)[ utterance ]`");
  open_bracket();
  if (!name("an utterance's name")) return false;
  if (!closing(Tok::right_bracket, '[', opener, "`]`")) return false;
  if (!at(Tok::left_brace)) return true;
  return block([this] { return placement(); });
}

}  // namespace nms::lang
