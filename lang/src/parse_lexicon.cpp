// Lexicons with their entries, and utterances, whose items are much the same.
#include "parser.h"

namespace nms::lang {

bool Parser::lexicon() {
  name("the lexicon's name");
  if (!panic_ && at(Tok::string)) leaf(NodeKind::string);
  if (!panic_ && at_word("extends")) {
    Open extends(*this, NodeKind::extends);
    advance();
    name("the name of the lexicon it extends");
  }
  skip_to_block();
  return !panic_ && block([this] {
    if (at_word("entry")) return entry();
    if (at_word("combine")) return combine();
    if (at_word("include")) return include();
    if (at_word("remove")) return remove();
    if (at_word("licence")) return licence();
    return unexpected("`entry`, `combine`, `include`, `remove` or `licence`");
  });
}

bool Parser::entry() {
  Open node(*this, NodeKind::entry);
  take_docs();
  advance();
  const auto header = [this] {
    if (!name("the entry's name")) return false;
    if (at(Tok::left_paren) && !params()) return false;
    if (at(Tok::colon)) {
      advance();
      if (!at(Tok::name)) return unexpected("what it does: syntactic, lexical, ...");
      leaf(NodeKind::function);
    }
    if (at_word("for")) {
      Open sign(*this, NodeKind::for_sign);
      advance();
      if (!at_word("sign")) return unexpected("`sign`", "write `for sign NOT-YET`");
      advance();
      if (at(Tok::string)) {
        leaf(NodeKind::string);
        return true;
      }
      return gloss();
    }
    return true;
  };
  header();
  skip_to_block();
  return !panic_ && block([this] { return entry_item(); });
}

// `mm, th`: names with commas between.
bool Parser::names(std::string_view what) {
  while (name(what)) {
    if (!at(Tok::comma)) return true;
    advance();
  }
  return false;
}

bool Parser::include() {
  Open node(*this, NodeKind::include);
  advance();
  if (!names("an entry's name")) return false;
  if (!at_word("from")) return unexpected("`from`", "write `include mm, th from asl`");
  advance();
  return name("a lexicon's name");
}

bool Parser::remove() {
  Open node(*this, NodeKind::remove);
  advance();
  return names("the name of an entry that the extended lexicon has");
}

// `licence "Apache-2.0"`: what may be done with the lexicon and with what is made of it.
bool Parser::licence() {
  Open node(*this, NodeKind::property);
  note_property("licence", {token_.begin, token_.end});
  leaf(NodeKind::name);
  return string("the licence, as \"Apache-2.0\"");
}

bool Parser::at_property_word() const {
  if (!at(Tok::name)) return false;
  static constexpr std::string_view kWords[] = {
      "label",   "alias", "meaning", "source", "evidence", "id",  "synonym", "competes", "before", "excludes",
      "spreads", "onset", "apex",    "offset", "lead",     "lag", "profile", "held",     "easing", "layer"};
  const std::string_view word = slice(token_);
  bool found = false;
  for (std::string_view w : kWords) found = found || w == word;
  return found && lexer_.byte(token_.end) != '(';
}

bool Parser::entry_item() {
  if (at(Tok::name)) {
    const std::string_view word = slice(token_);
    if (at_property_word()) return word == "profile" ? profile() : property(false);
    if (word == "when" || word == "unless") return when();
    if (word == "optional") {
      Open node(*this, NodeKind::optional);
      advance();
      return at_one_of() ? one_of() : placement();
    }
    if (at_one_of()) return one_of();
  }
  return placement();
}

bool Parser::at_one_of() const { return at_word("one") && text_.substr(token_.end, 3) == " of"; }

bool Parser::when() {
  Open node(*this, NodeKind::when);
  if (at_word("unless")) flag(node.node(), kFlagUnless);
  advance();
  {
    Open condition(*this, NodeKind::condition);
    if (at_word("sign")) {
      advance();
      if (name("a tag") && at_word("in")) {
        advance();
        name("a span's name");
      }
    } else {
      if (name("a condition: `sign TAG in SPAN`, or a parameter") && at_word("is")) {
        advance();
        name("a word that the parameter may be");
      }
    }
  }
  skip_to_block();
  return !panic_ && block([this] { return entry_item(); });
}

bool Parser::one_of() {
  Open node(*this, NodeKind::one_of);
  advance();
  advance();
  return block([this] { return at_one_of() ? one_of() : placement(); });
}

bool Parser::combine() {
  Open node(*this, NodeKind::combine);
  take_docs();
  advance();
  const auto header = [this] {
    if (!name("an entry's name")) return false;
    if (!at_word("with")) return unexpected("`with`", "write `combine yn with neg { head from neg }`");
    advance();
    return name("another entry's name");
  };
  header();
  skip_to_block();
  return !panic_ && block([this] {
    Open rule(*this, NodeKind::combine_rule);
    if (!name("what is taken from one of them: a track's name")) return false;
    if (!at_word("from")) return unexpected("`from`", "write `head from neg`");
    advance();
    return name("an entry's name");
  });
}

bool Parser::utterance() {
  const auto header = [this] {
    if (!name("the utterance's name")) return false;
    if (at_word("in")) {
      Open in(*this, NodeKind::in);
      advance();
      if (!name("a lexicon's name")) return false;
    }
    if (at_word("signer")) {
      Open signer(*this, NodeKind::property);
      leaf(NodeKind::name);
      return name("the signer's hand: left_handed or right_handed");
    }
    return true;
  };
  header();
  skip_to_block();
  return !panic_ && block([this] { return utterance_item(); });
}

bool Parser::utterance_item() {
  if (at(Tok::name)) {
    const std::string_view word = slice(token_);
    if (word == "signs") {
      const char next = lexer_.byte_after_blanks(token_.end);
      if (next == '{' || next == 'n') return signs();
    }
    if (word == "signer") return property(false);
    if (word == "optional") {  // `optional none`: a name elsewhere
      const std::string_view rest = text_.substr(token_.end, 5);
      if (rest.starts_with(" all") || rest == " none") return property(false);
    }
    if (at_property_word()) return word == "profile" ? profile() : property(false);
    if (word == "when" || word == "unless") return when();
    if (at_ambience()) return ambience();
  }
  return placement();
}

}  // namespace nms::lang
