// Where things stand: X over SPAN, X at POINT for TIME, X on SIGN.
//
// After `over`, `on`, `of`, `..` and the like the next run is read as a gloss. Glosses take `+` and `-`, so an offset's
// sign stands after a blank: `start of IX-3 + 30ms`. `..` never belongs to a gloss: `IX-3..WHERE` is two. A run that
// reads as a time is one, `0.2s..1.5s`; a sign of that name needs backquotes, and so does one named by a keyword.
#include <nms/lang/quantity.h>

#include "parser.h"

namespace nms::lang {

bool Parser::placement() {
  Open node(*this, NodeKind::placement);
  if (!sum()) return false;
  if (at(Tok::name)) {
    if (at_word("over")) {
      if (!over()) return false;
    } else if (at_word("at")) {
      Open at_node(*this, NodeKind::at);
      advance();
      if (!point()) return false;
      if (at_word("for")) {
        Open duration(*this, NodeKind::duration);
        advance();
        if (!quantity("a time")) return false;
      }
    } else if (at_word("on")) {
      Open on(*this, NodeKind::on);
      advance();
      if (!gloss()) return false;
    }
    if (at_word("fill")) {
      leaf(NodeKind::fill);
    } else if (at_word("per")) {
      Open per_cycle(*this, NodeKind::per_cycle);
      advance();
      if (!at_word("cycle")) return unexpected("`cycle`", "write `X per cycle`: once for each cycle of the sign");
      advance();
    }
  }
  return !at(Tok::left_brace) || options();
}

bool Parser::over() {
  Open node(*this, NodeKind::over);
  advance();
  return span();
}

bool Parser::span() {
  Open node(*this, NodeKind::span);
  if (!span_end()) return false;
  if (!at(Tok::dot_dot)) return true;
  advance();
  return span_end();
}

// A sign's name. The token is replaced by its reading as a gloss.
bool Parser::gloss() {
  if (token_.ends || token_.kind == Tok::eof) return fail(here(), EmptyGloss{seen()});
  read_as_gloss();
  if (token_.kind == Tok::open_gloss) return fail(here(), UnterminatedGloss{});
  if (token_.kind != Tok::gloss || slice(token_) == "``") return fail(here(), EmptyGloss{seen()});
  leaf(NodeKind::gloss);
  return true;
}

bool Parser::offset() {
  if (!at(Tok::plus) && !at(Tok::minus)) return true;
  Open node(*this, NodeKind::offset);
  if (at(Tok::minus)) flag(node.node(), kFlagMinus);
  advance();
  return quantity("a time");
}

bool Parser::at_point() {
  // A time or an anchor, or a sign by its bare gloss.
  const Token at_token = token_;
  if (token_.ends || token_.kind == Tok::eof) return unexpected("a point in time or a sign");
  const Token run = lexer_.gloss(at_token);
  lexer_.set_place(at_token.end);
  const std::string_view text = slice(run);
  const bool keyword = at_token.kind == Tok::name && run.end == at_token.end &&
                       (text == "start" || text == "end" || text == "stroke" || text == "mark");
  if (keyword || at_quantity()) return point();
  return gloss();
}

bool Parser::point(std::string_view what) {
  Open node(*this, NodeKind::point);
  if (at_quantity()) return quantity() && offset();
  if (!at(Tok::name)) return unexpected(what, "a point is a time, or `start of SIGN`, `end of SIGN`, `mark M`");
  {
    Open anchor(*this, NodeKind::anchor);
    if (at_word("mark")) {
      advance();
      if (!name("a mark's name")) return false;
    } else if (at_word("start") || at_word("end") || at_word("stroke")) {
      const bool stroke = at_word("stroke");
      advance();
      if (stroke) {
        if (!at_word("end")) return unexpected("`end`", "write `stroke end of SIGN`");
        advance();
      }
      if (at_word("of")) {
        advance();
        if (!gloss()) return false;
      } else if (stroke) {
        return unexpected("`of`", "write `stroke end of SIGN`");
      }
    } else {
      return unexpected(what, "a point is a time, or `start of SIGN`, `end of SIGN`, `mark M`");
    }
  }
  return offset();
}

bool Parser::span_end() {
  constexpr std::string_view kHelp = "a span is a name, or POINT..POINT";
  Open node(*this, NodeKind::span_end);
  if (token_.ends || token_.kind == Tok::eof) return unexpected("a span", kHelp);
  const Token normal = token_;
  read_as_gloss();
  if (token_.kind == Tok::open_gloss) return fail(here(), UnterminatedGloss{});
  if (token_.kind != Tok::gloss) return unexpected("a span", kHelp);
  const std::string_view run = slice(token_);
  const auto as_normal = [&] {
    token_ = normal;
    lexer_.set_place(normal.end);
  };
  if (run == "``") return fail(here(), EmptyGloss{seen()});
  if (run == "sign") {
    as_normal();
    Open tagged(*this, NodeKind::tagged_sign);
    advance();
    if (!name("a sign's tag")) return false;
  } else if (run == "first" || run == "last") {
    as_normal();
    Open edge(*this, NodeKind::edge_sign);
    const std::string help = "write `" + std::string(run) + " sign`";
    advance();
    if (!at_word("sign")) return unexpected("`sign`", help);
    advance();
  } else if (run == "start" || run == "end" || run == "stroke" || run == "mark") {
    as_normal();
    // `start` alone is the edge of what encloses; with `of` or an offset it is a point.
    const Mark before = mark();
    advance();
    const bool is_point = run == "stroke" || run == "mark" || at_word("of") || at(Tok::plus) || at(Tok::minus);
    go_back(before);
    if (is_point) {
      if (!point()) return false;
    } else {
      leaf(NodeKind::edge_sign);
    }
  } else if (normal.kind == Tok::quantity || normal.kind == Tok::plus || normal.kind == Tok::minus) {
    const std::optional<Quantity> q = read_quantity(run);
    if (q.has_value()) {
      as_normal();
      if (!point()) return false;
    } else {
      leaf(NodeKind::gloss);
    }
  } else {
    leaf(NodeKind::gloss);
    if (at(Tok::plus) || at(Tok::minus))
      return unexpected("the end of the span", "write `start of SIGN + TIME` or `end of SIGN + TIME`");
  }
  if (!at_word("else")) return true;
  Open otherwise(*this, NodeKind::else_);
  if (!enter()) return false;
  advance();
  const bool ok = span_end();
  leave();
  return ok;
}

}  // namespace nms::lang
