// Action units, axes, tracks, muscles and faces.
#include "parser.h"

namespace nms::lang {

bool Parser::property_block() {
  return block([this] { return property(false); });
}

bool Parser::au() {
  const auto header = [this] {
    if (!at(Tok::quantity)) return unexpected("the action unit's number", "write `au 12 \"Lip Corner Puller\" { }`");
    if (!quantity()) return false;
    if (!string("the action unit's name in quotes")) return false;
    if (at_word("sides")) leaf(NodeKind::sides);
    return true;
  };
  header();
  skip_to_block();
  return !panic_ && property_block();
}

bool Parser::axis() {
  const auto header = [this] {
    if (!name("the axis' name") || !expect(Tok::equal, "`=`")) return false;
    if (!at(Tok::au_token)) return unexpected("an action unit");
    leaf(NodeKind::au_token);
    if (!expect(Tok::minus, "`-`", "an axis is the difference of two action units: `AU51 - AU52`")) return false;
    if (!at(Tok::au_token)) return unexpected("an action unit");
    leaf(NodeKind::au_token);
    return true;
  };
  header();
  skip_to_block();
  return !panic_ && property_block();
}

bool Parser::track() {
  name("the track's name");
  skip_to_block();
  return !panic_ && property_block();
}

bool Parser::muscle() {
  const auto header = [this] {
    if (!name("the muscle's name")) return false;
    if (at_word("sides")) leaf(NodeKind::sides);
    if (!expect(Tok::colon, "`:` and the muscle's kind")) return false;
    if (!at(Tok::name)) return unexpected("the muscle's kind: linear, sheet, ...");
    leaf(NodeKind::muscle_kind);
    while (at_word("from") || at_word("to") || at_word("at") || at_word("about")) {
      Open place(*this, NodeKind::place);
      leaf(NodeKind::name);
      if (!name("a landmark's name")) return false;
      if (at(Tok::plus)) {
        advance();
        if (!vector()) return false;
      }
    }
    return true;
  };
  header();
  skip_to_block();
  return !panic_ && property_block();
}

bool Parser::landmark() {
  Open node(*this, NodeKind::landmark);
  take_docs();
  advance();
  if (!name("the landmark's name")) return false;
  if (at_word("sides")) leaf(NodeKind::sides);
  if (at_word("vertex")) {
    leaf(NodeKind::name);
    return quantity("the vertex' number") && (!at_quantity() || quantity());
  }
  if (at_word("on")) {
    leaf(NodeKind::name);
    return string("the surface's name in quotes") && quantity("the place along u, from 0 to 1") &&
           quantity("the place along v, from 0 to 1");
  }
  return vector();
}

bool Parser::face() {
  name("the face's name");
  skip_to_block();
  return !panic_ && block([this] {
    if (at_word("landmark")) return landmark();
    if (at_word("muscle")) {
      Open node(*this, NodeKind::muscle);
      take_docs();
      advance();
      return muscle();
    }
    return property(false);
  });
}

}  // namespace nms::lang
