// What moves: sums of scaled poses and action units, calls, steps.
#include "parser.h"

namespace nms::lang {

// Words that may follow a sum. After a bare number they are not what it scales.
bool Parser::at_placement_word() const {
  const std::string_view w = slice(token_);
  switch (w.size()) {
    case 2:
      return w == "at" || w == "on" || w == "to" || w == "by";
    case 3:
      return w == "for" || w == "per";
    case 4:
      return w == "over" || w == "fill" || w == "from";
    case 5:
      return w == "rises" || w == "falls" || w == "never";
    default:
      return false;
  }
}

bool Parser::at_primary() const {
  if (token_.ends) return false;
  switch (token_.kind) {
    case Tok::au_token:
    case Tok::left_paren:
      return true;
    case Tok::name:
      return !at_placement_word();
    default:
      return false;
  }
}

bool Parser::sum() {
  Open node(*this, NodeKind::sum);
  bool minus = false;
  while (true) {
    if (minus || !plain_terms()) {
      Open open_term(*this, NodeKind::term);
      if (minus) flag(open_term.node(), kFlagMinus);
      if (!term()) return false;
    }
    minus = at(Tok::minus);
    // In a list of values a sign that touches its number begins the next value; `+-` begins a tolerance.
    if ((star_only_ && at_quantity()) || (at(Tok::plus) && lexer_.byte(token_.end) == '-')) return true;
    if (!minus && !at(Tok::plus)) return true;
    advance();
  }
}

// Factors, then what they scale. A number or name is a factor only if something follows it, which is known one token
// later: it is the last node then, and gets its parent afterwards.
bool Parser::term() {
  while (true) {
    if (at_quantity()) {
      if (!quantity()) return false;
      if (at(Tok::star)) {
        flag(wrap_last(NodeKind::factor), kFlagStar);
        advance();
        continue;
      }
      if (star_only_ || !at_primary()) return true;
      wrap_last(NodeKind::factor);
      continue;
    }
    if (token_.ends) return unexpected("a pose, a name, a number or an action unit");
    switch (token_.kind) {
      case Tok::au_token:
        leaf(NodeKind::au_token);
        return true;
      case Tok::name: {
        const std::string_view word = slice(token_);
        if (word == "facs" && lexer_.byte_after_blanks(token_.end) == '"') {
          Open facs(*this, NodeKind::facs);
          advance();
          return string("a FACS string in quotes");
        }
        if (word == "mouthing" && lexer_.byte_after_blanks(token_.end) == '"') {
          Open mouthing(*this, NodeKind::mouthing);
          advance();
          return string("a word in IPA, X-SAMPA or ARPAbet, in quotes");
        }
        leaf(NodeKind::name);
        if (at(Tok::star)) {
          flag(wrap_last(NodeKind::factor), kFlagStar);
          advance();
          continue;
        }
        if (at(Tok::left_paren)) return call();
        if (word == "gaze" && at(Tok::name) && !at_placement_word() && !star_only_) {
          const std::uint32_t node = wrap_last(NodeKind::call);
          {
            Open addressee(*this, NodeKind::argument);
            leaf(NodeKind::name);
          }
          close(node);
          return true;
        }
        if (at_primary() && !at(Tok::left_paren) && !star_only_) {  // a degree: `slightly smile`
          wrap_last(NodeKind::factor);
          continue;
        }
        return true;
      }
      case Tok::left_paren: {
        if (at_steps()) return steps();
        const std::uint32_t node = nodes_.size();
        if (!group()) return false;
        if (!at(Tok::star)) return true;
        wrapped_.push_back(node);
        advance();
        continue;
      }
      default:
        return unexpected("a pose, a name, a number or an action unit");
    }
  }
}

bool Parser::group() {
  Open node(*this, NodeKind::group);
  if (!enter()) return false;
  const bool star_only = std::exchange(star_only_, false);
  const std::uint32_t opener = token_.begin;
  open_bracket();
  bool ok = sum();
  star_only_ = star_only;
  leave();
  return ok && closing(Tok::right_paren, '(', opener, "`+`, `-` or `)`");
}

bool Parser::call() {
  const std::uint32_t node = wrap_last(NodeKind::call);
  const std::uint32_t opener = token_.begin;
  bool ok = enter();
  if (ok) {
    ok = arguments(opener);
    leave();
  }
  close(node);
  return ok;
}

// The token is `(`.
bool Parser::arguments(std::uint32_t opener_at) {
  const bool star_only = std::exchange(star_only_, false);
  open_bracket();
  bool ok = true;
  while (ok && !at(Tok::right_paren) && token_.kind != Tok::eof) {
    ok = argument();
    if (!ok || !at(Tok::comma)) break;
    advance();
  }
  star_only_ = star_only;
  return ok && closing(Tok::right_paren, '(', opener_at, "`,` or `)`");
}

bool Parser::argument() {
  Open node(*this, NodeKind::argument);
  if (at(Tok::name) && lexer_.byte_after_blanks(token_.end) == '=') {
    leaf(NodeKind::name);
    if (!expect(Tok::equal, "`=`")) return false;
    flag(node.node(), kFlagNamed);
  }
  if (at(Tok::string)) {
    leaf(NodeKind::string);
    return true;
  }
  const std::uint32_t begin = nodes_.size();
  if (!sum()) return false;
  // A number or name by itself stands by itself: sum(term(x)) becomes x.
  if (nodes_.size() == begin + 3) {
    const Node inner = nodes_[begin + 2];
    if (inner.kind == NodeKind::quantity || inner.kind == NodeKind::name) {
      nodes_.truncate(begin);
      nodes_.leaf(inner.kind, inner.begin, inner.end, inner.flags);
    }
  }
  return true;
}

// `(` number `:`
bool Parser::at_steps() const {
  std::uint32_t at_byte = token_.end;
  const auto skip = [&](auto&& accepts) {
    while (accepts(lexer_.byte(at_byte))) ++at_byte;
  };
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; };
  if (!at(Tok::left_paren)) return false;
  skip(blank);
  // A comment before the first step is stepped over with its line.
  while (lexer_.byte(at_byte) == '/' && lexer_.byte(at_byte + 1) == '/') {
    skip([](char c) { return c != '\n' && c != '\0'; });
    skip(blank);
  }
  const char first = lexer_.byte(at_byte);
  if (first < '0' || first > '9') return false;
  skip([](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '.' || c == '%';
  });
  skip(blank);
  return lexer_.byte(at_byte) == ':';
}

bool Parser::steps() {
  Open node(*this, NodeKind::steps);
  if (!enter()) return false;
  const std::uint32_t opener = token_.begin;
  open_bracket();
  bool ok = true;
  while (ok) {
    while (at(Tok::semicolon)) advance();
    if (at(Tok::right_paren)) break;
    ok = step();
    if (ok && !at(Tok::semicolon) && !(token_.line_break && at_quantity())) break;
  }
  leave();
  return ok && closing(Tok::right_paren, '(', opener, "`;` or `)`");
}

bool Parser::step() {
  if (plain_step()) return true;
  Open node(*this, NodeKind::step);
  if (!quantity("a step: a share or a time, then `:`")) return false;
  if (!expect(Tok::colon, "`:`", "a step is written `10%: P1`")) return false;
  if (!sum()) return false;
  return !at(Tok::left_brace) || options();
}

}  // namespace nms::lang
