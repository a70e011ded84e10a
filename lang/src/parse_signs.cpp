// The manual tier: glosses with their times, tags and names, in labelled brackets.
#include "parser.h"

namespace nms::lang {

bool Parser::signs() {
  Open node(*this, NodeKind::signs);
  advance();
  if (at_word("nd")) {
    flag(node.node(), kFlagNonDominant);
    advance();
  }
  if (!at(Tok::left_brace)) return unexpected("`{`");
  if (!enter()) return false;
  const std::uint32_t opener = token_.begin;
  const int brackets = std::exchange(brackets_, 1);  // line breaks are blanks inside
  advance();
  sign_items('{', opener);
  leave();
  brackets_ = brackets;
  if (panic_) return false;
  advance();
  return true;
}

// Everything up to the closer, which is left to the caller; false closers are reported here.
void Parser::sign_items(char opener, std::uint32_t opener_at) {
  while (!panic_) {
    if (token_.kind == Tok::right_brace) {
      if (opener == '{') return;
      unclosed('[', opener_at);
      return;
    }
    if (token_.kind == Tok::right_bracket) {
      if (opener == '[') return;
      unexpected("a sign", "remove the `]`, or write its label and `[` before");
      panic_ = false;
      leaf(NodeKind::error);
      continue;
    }
    if (token_.kind == Tok::eof || declaration_begins_here()) {
      unclosed(opener, opener_at);
      return;
    }
    const bool poisoned = std::exchange(poison_, false);
    const std::uint32_t begin = token_.begin;
    const std::uint32_t label = bracket_label();
    if (label != 0 || token_.kind == Tok::left_bracket)
      bracket(label);
    else
      sign();
    if (panic_ && token_.kind != Tok::eof && !declaration_begins_here()) {
      panic_ = false;
      // At a closer nothing is skipped: the loop tells whose it is.
      if (token_.kind != Tok::right_brace && token_.kind != Tok::right_bracket) {
        if (token_.kind == Tok::left_brace)
          skip_braces();
        else if (token_.begin == begin)
          leaf(NodeKind::error);
        recover_sign();
      }
    }
    poison_ = poisoned;
  }
}

// Skips `{ ... }`, in which no brackets of signs stand.
void Parser::skip_braces() {
  const std::uint32_t begin = token_.begin;
  std::uint32_t end = token_.end;
  advance();
  while (token_.kind != Tok::eof && token_.kind != Tok::right_brace && token_.kind != Tok::right_bracket &&
         token_.kind != Tok::left_bracket && !token_.line_break) {
    end = token_.end;
    advance();
  }
  if (token_.kind == Tok::right_brace && !token_.line_break) {
    end = token_.end;
    advance();
  }
  leaf_of(NodeKind::error, begin, end, kFlagError);
}

// Skips to the next blank: what is left of a sign.
void Parser::recover_sign() {
  while (token_.kind != Tok::eof && token_.begin == previous_end_) {
    if (token_.kind == Tok::right_brace || token_.kind == Tok::right_bracket) return;
    const Token run = lexer_.gloss(token_);
    token_ = run;
    advance();
  }
}

// If the text at the token is a label that `[` follows, or `(arguments)[`: where the label ends; else 0.
std::uint32_t Parser::bracket_label() const {
  switch (token_.kind) {
    case Tok::semicolon:
    case Tok::left_bracket:
    case Tok::left_brace:
    case Tok::string:
    case Tok::open_string:
    case Tok::gloss:
    case Tok::open_gloss:
      return 0;
    default:
      break;
  }
  const std::uint32_t end = lexer_.gloss_end(token_.begin);
  if (end == token_.begin) return 0;
  const std::string_view run = text_.substr(token_.begin, end - token_.begin);
  const std::size_t paren = run.find('(');
  if (paren == std::string_view::npos) return lexer_.byte(end) == '[' ? end : 0;
  if (paren == 0) return 0;  // (1h)GO
  // Arguments may hold blanks, so they are followed to their `)`; a few levels and a page of text are enough.
  constexpr int kDeepest = 8;
  constexpr std::uint32_t kLongest = 2000;
  const std::uint32_t label_end = token_.begin + static_cast<std::uint32_t>(paren);
  int depth = 0;
  for (std::uint32_t at_byte = label_end; at_byte < text_.size() && at_byte - label_end < kLongest; ++at_byte) {
    switch (text_[at_byte]) {
      case '(':
        if (++depth > kDeepest) return 0;
        break;
      case ')':
        if (--depth == 0) return lexer_.byte(at_byte + 1) == '[' ? label_end : 0;
        break;
      case '[':
      case ']':
      case '{':
      case '}':
      case ';':
      case '@':
        return 0;
      default:
        break;
    }
  }
  return 0;
}

void Parser::bracket(std::uint32_t label_end) {
  Open node(*this, NodeKind::bracket);
  if (!enter()) return;
  const auto done = [this] { leave(); };
  if (label_end != 0) {
    token_.end = label_end;
    token_.kind = Tok::name;
    lexer_.set_place(label_end);
    leaf(NodeKind::name);
    if (at(Tok::left_paren) && !arguments(token_.begin)) return done();
  } else {
    soft_fail(here(), DetachedBracket{""});
  }
  const std::uint32_t opener = token_.begin;
  if (!at(Tok::left_bracket)) {
    unexpected("`[`");
    return done();
  }
  open_bracket();
  sign_items('[', opener);
  if (panic_) return done();
  close_bracket();
  done();
  if (at(Tok::left_brace)) options();
}

void Parser::sign() {
  Open node(*this, NodeKind::sign);
  if (token_.kind == Tok::comma) {
    unexpected("a sign", "signs stand side by side with blanks; leave the comma out");
    return;
  }
  if (!gloss()) return;
  const std::uint32_t nodes = nodes_.size();
  const Node gloss_node = nodes_[nodes - 1];
  const std::string_view text = text_.substr(gloss_node.begin, gloss_node.end - gloss_node.begin);
  if (at(Tok::left_brace)) tag();
  if (at(Tok::at_sign) && !sign_time(text)) return;
  if (at(Tok::left_brace)) {
    soft_fail(here(), UnexpectedToken{seen(), "the next sign", "a tag stands before the time: `WHERE{wh}@0.4s..0.8s`"});
    tag();
  }
  if (at_word("as")) {
    const Token run = lexer_.gloss(token_);
    lexer_.set_place(token_.end);
    if (run.end == token_.end) {
      Open alias(*this, NodeKind::alias);
      advance();
      if (!name("a name for this sign")) return;
    }
  }
  // `wh [ ... ]`: what was read as a sign is a label.
  if (at(Tok::left_bracket) && nodes_.size() == nodes && text.front() != '`') {
    soft_fail({gloss_node.begin, gloss_node.end}, DetachedBracket{std::string(text)});
    nodes_.set_kind(node.node(), NodeKind::bracket);
    nodes_.set_kind(nodes - 1, NodeKind::name);
    if (!enter()) return;
    const std::uint32_t opener = token_.begin;
    open_bracket();
    sign_items('[', opener);
    leave();
    if (panic_) return;
    close_bracket();
    if (at(Tok::left_brace)) options();
  }
}

// A faulty tag is skipped whole, so that its `}` is not taken for another.
void Parser::tag() {
  Open node(*this, NodeKind::tag);
  advance();
  const bool tagged = at_quantity() || name("a tag, as `WHERE{wh}`");
  if (tagged && (!at_quantity() || quantity()) &&
      expect(Tok::right_brace, "`}`", "a tag is one name, a count of cycles, or both: `WHERE{wh}`, `WALK{3x}`"))
    return;
  panic_ = false;
  while (token_.kind != Tok::eof && token_.kind != Tok::right_brace && token_.kind != Tok::right_bracket &&
         token_.kind != Tok::left_bracket && !token_.line_break)
    advance();
  if (token_.kind == Tok::right_brace && !token_.line_break) advance();
}

bool Parser::sign_time(std::string_view gloss_text) {
  Open node(*this, NodeKind::sign_time);
  advance();
  const auto bad = [&](std::string_view expected) {
    return fail(here(), BadSignTime{seen(), std::string(expected), std::string(gloss_text)});
  };
  if (!at_quantity()) return bad("when it starts");
  if (!quantity()) return false;
  if (!at(Tok::dot_dot)) return bad("`..` and when it ends");
  advance();
  if (!at_quantity()) return bad("when it ends");
  if (!quantity()) return false;
  if (!at(Tok::tilde)) return true;
  advance();
  if (!at_quantity()) return bad("until when it is held");
  return quantity();
}

}  // namespace nms::lang
