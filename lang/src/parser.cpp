#include "parser.h"

#include <algorithm>

#include <fmt/format.h>

namespace nms::lang {
namespace {

// A line break after one of these is a blank.
bool goes_on(Tok kind) {
  switch (kind) {
    case Tok::plus:
    case Tok::minus:
    case Tok::star:
    case Tok::equal:
    case Tok::colon:
    case Tok::comma:
    case Tok::left_brace:
      return true;
    default:
      return false;
  }
}

constexpr std::string_view kDeclarations[] = {"use",       "pose",      "expression", "motion", "timeline", "lexicon",
                                              "utterance", "discourse", "test",       "degree", "au",       "axis",
                                              "track",     "muscle",    "face",       "ambient"};

}  // namespace

Parser::Parser(std::shared_ptr<const Source> source, Diagnostics& diagnostics)
    : tree_(std::make_shared<Tree>()),
      nodes_(tree_->nodes_),
      diagnostics_(diagnostics),
      text_(source->text()),
      lexer_(text_, tree_->comments_) {
  tree_->source_ = std::move(source);
}

std::shared_ptr<const Tree> Parser::run() {
  if (text_.size() > kMaxFileBytes) {
    soft_fail({0, 0}, FileTooLarge{text_.size(), kMaxFileBytes});
    nodes_.leaf(NodeKind::file, 0, 0, kFlagError);
    return tree_;
  }
  // Three bytes of nodes to one of text is more than pose and expression lists take, so that the nodes are not moved
  // while they grow; pages never written are never there. Past this many bytes of text address space counts too.
  constexpr std::size_t kMostReserved = std::size_t{64} * 1024 * 1024;
  nodes_.reserve(std::min(text_.size(), kMostReserved) * 3 / 8 + 16);
  file();
  finish_wraps();
  nodes_.shrink_if_sparse();
  return tree_;
}

void Parser::advance() {
  previous_end_ = token_.end;
  previous_ = token_.kind;
  token_ = lexer_.next();
  token_.ends = token_.line_break && brackets_ == 0 && !goes_on(previous_);
  // `}` closes its block from any line.
  if (token_.kind == Tok::right_brace) token_.ends = false;
  // Where a line goes on or a bracket is open, a declaration at the next line's beginning still ends it: its operand or
  // closer was forgotten.
  if (token_.line_break && !token_.ends && previous_ != Tok::left_brace && declaration_begins_here())
    token_.ends = true;
}

void Parser::open_bracket() {
  ++brackets_;
  advance();
}

void Parser::close_bracket() {
  --brackets_;
  advance();
}

void Parser::read_as_gloss() { token_ = lexer_.gloss(token_); }

bool Parser::at_quantity() const {
  if (token_.ends) return false;
  if (token_.kind == Tok::quantity) return true;
  if (token_.kind != Tok::minus && token_.kind != Tok::plus) return false;
  const char c = lexer_.byte(token_.end);
  return c >= '0' && c <= '9';
}

Range Parser::here() const {
  if (at_line_end() || token_.kind == Tok::eof) return {previous_end_, previous_end_};
  return {token_.begin, token_.end};
}

std::string Parser::seen() const {
  if (token_.kind == Tok::eof) return "the end of the file";
  if (at_line_end()) return "the end of the line";
  std::string_view text = slice(token_);
  constexpr std::size_t kMost = 40;
  if (text.size() <= kMost) return fmt::format("`{}`", text);
  std::size_t cut = kMost;
  while (cut > 0 && (static_cast<unsigned char>(text[cut]) & 0xC0U) == 0x80U) --cut;
  return fmt::format("`{}...`", text.substr(0, cut));
}

std::uint32_t Parser::open(NodeKind kind) { return nodes_.open(kind, token_.begin); }

void Parser::close(std::uint32_t node) {
  nodes_.close(node, previous_end_);  // an empty one stands where the last token ended
  if (poison_) nodes_.add_flags(node, kFlagError);
}

void Parser::leaf_of(NodeKind kind, std::uint32_t begin, std::uint32_t end, std::uint8_t flags) {
  nodes_.leaf(kind, begin, end, flags);
}

void Parser::leaf(NodeKind kind) {
  leaf_of(kind, token_.begin, token_.end);
  advance();
}

std::uint32_t Parser::wrap_last(NodeKind kind) { return nodes_.wrap_last(kind); }

Parser::Mark Parser::mark() const {
  return {token_, lexer_.place(), nodes_.size(), tree_->comments_.size(), previous_end_, previous_};
}

void Parser::go_back(const Mark& mark) {
  token_ = mark.token;
  lexer_.set_place(mark.place);
  nodes_.truncate(mark.nodes);
  std::erase_if(wrapped_, [&](std::uint32_t node) { return node >= mark.nodes; });
  tree_->comments_.resize(mark.comments);
  previous_end_ = mark.previous_end;
  previous_ = mark.previous;
}

bool Parser::unexpected(std::string_view expected, std::string_view help) {
  if (panic_) return false;
  if (!token_.ends) {
    if (token_.kind == Tok::open_string) return fail(here(), UnterminatedString{});
    if (token_.kind == Tok::open_gloss) return fail(here(), UnterminatedGloss{});
    if (token_.kind == Tok::invalid) return fail(here(), InvalidCharacter{std::string(slice(token_))});
  }
  return fail(here(), UnexpectedToken{seen(), std::string(expected), std::string(help)});
}

bool Parser::unclosed(char opener, std::uint32_t at) {
  if (panic_) return false;
  Range range = here();
  if (Diagnostic* d = soft_fail(range, UnclosedBracket{opener, seen()}))
    d->labels.push_back({tree_->source_, {at, at + 1}, "opened here"});
  panic_ = true;
  return false;
}

bool Parser::expect(Tok kind, std::string_view what, std::string_view help) {
  if (!at(kind)) return unexpected(what, help);
  advance();
  return true;
}

bool Parser::closing(Tok kind, char opener, std::uint32_t opener_at, std::string_view expected) {
  if (token_.kind == kind) {
    close_bracket();
    return true;
  }
  // A bracket that its line, block or file ends was forgotten; anything else does not belong in it.
  if (token_.line_break || token_.kind == Tok::eof || token_.kind == Tok::right_brace ||
      token_.kind == Tok::semicolon || token_.kind == Tok::left_brace) {
    if (token_.line_break) token_.ends = true;
    return unclosed(opener, opener_at);
  }
  if (panic_) return false;
  if (token_.kind == Tok::invalid || token_.kind == Tok::open_string || token_.kind == Tok::open_gloss)
    return unexpected(expected);
  if (Diagnostic* d = soft_fail(here(), UnexpectedToken{seen(), std::string(expected), ""}))
    d->labels.push_back({tree_->source_, {opener_at, opener_at + 1}, "opened here"});
  panic_ = true;
  return false;
}

bool Parser::enter() {
  if (nesting_ >= kMaxNesting) return fail({token_.begin, token_.end}, NestingTooDeep{kMaxNesting});
  ++nesting_;
  return true;
}

bool Parser::declaration_begins_here() const {
  // A declaration's word at the beginning of a line, inside a block: the block was not closed.
  if (token_.kind != Tok::name || !token_.line_break || token_.begin == 0 || text_[token_.begin - 1] != '\n')
    return false;
  const std::string_view word = slice(token_);
  bool found = false;
  for (std::string_view d : kDeclarations) found = found || d == word;
  // In the blocks of faces, action units and axes these are properties; in those of clips an ambient is used.
  if (!found || word == "track" || word == "muscle" || word == "motion" || word == "axis" || word == "face" ||
      word == "ambient")
    return false;
  std::uint32_t at = token_.end;
  while (lexer_.byte(at) == ' ') ++at;
  if (at == token_.end) return false;
  std::uint32_t end = at;
  const auto letter = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '"';
  };
  while (letter(lexer_.byte(end))) ++end;
  const std::string_view next = text_.substr(at, end - at);
  return !next.empty() && next != "over" && next != "at" && next != "on" && next != "fill";
}

void Parser::recover(std::uint32_t statement_begin) {
  panic_ = false;
  brackets_ = 0;
  int depth = 0;
  const std::uint32_t begin = token_.begin;
  const bool must_move = token_.begin == statement_begin;
  bool moved = false;
  std::uint32_t end = begin;
  while (token_.kind != Tok::eof) {
    split_open_string();
    if (depth == 0) {
      if ((moved || !must_move) && (token_.line_break && (moved || token_.ends))) break;
      if (token_.kind == Tok::semicolon || token_.kind == Tok::right_brace) break;
    } else if (declaration_begins_here()) {
      break;
    }
    if (token_.kind == Tok::left_brace) ++depth;
    const bool closes = token_.kind == Tok::right_brace;
    if (closes) --depth;
    end = token_.end;
    advance();
    moved = true;
    // A block ends its statement.
    if (closes && depth == 0) break;
  }
  if (moved) {
    leaf_of(NodeKind::error, begin, end, kFlagError);
  }
}

// A string that its line ends has swallowed the brace there, if there is one. Given back, it keeps blocks in step.
void Parser::split_open_string() {
  if (token_.kind != Tok::open_string || token_.end - token_.begin < 2) return;
  const char last = text_[token_.end - 1];
  if (last != '{' && last != '}') return;
  token_.begin = token_.end - 1;
  token_.kind = last == '{' ? Tok::left_brace : Tok::right_brace;
}

// After a fault in a block's header: goes on at its `{`, if the line has one, so that what is inside is still read.
void Parser::skip_to_block() {
  if (!panic_) return;
  const Mark start = mark();
  const int brackets = std::exchange(brackets_, 0);
  const std::uint32_t begin = token_.begin;
  std::uint32_t end = begin;
  split_open_string();
  while (!at_statement_end() && token_.kind != Tok::left_brace) {
    end = token_.end;
    advance();
    split_open_string();
  }
  if (!at(Tok::left_brace)) {
    go_back(start);
    brackets_ = brackets;
    return;
  }
  panic_ = false;
  if (end != begin) {
    leaf_of(NodeKind::error, begin, end, kFlagError);
  }
}

void Parser::statement_end(Tok last) {
  if (at_statement_end() || last == Tok::right_brace) return;
  if (token_.kind == Tok::invalid || token_.kind == Tok::open_string || token_.kind == Tok::open_gloss) {
    unexpected("");
    return;
  }
  std::string help;
  if (token_.kind == Tok::right_paren || token_.kind == Tok::right_bracket)
    help = fmt::format("remove the `{}`, or open it before", slice(token_));
  else if (token_.kind == Tok::star)
    help = "a scale stands in front: `60% AU12`, `k * smile`";
  else if (token_.kind == Tok::left_bracket)
    help = "brackets of signs stand inside `signs { }`";
  fail(here(), MissingTerminator{seen(), help});
}

// Groups found to be factors only after they were read get their parent here, all in one pass from the back.
void Parser::finish_wraps() {
  if (wrapped_.empty()) return;
  std::sort(wrapped_.begin(), wrapped_.end());
  const NodeList old = std::exchange(nodes_, NodeList());
  nodes_.reserve(old.size() + wrapped_.size());
  struct Waiting {
    std::uint32_t node;
    std::uint32_t end;
    std::uint32_t next;  // in the old list: it closes before that
  };
  std::vector<Waiting> waiting;
  const auto close_before = [&](std::uint32_t next) {
    for (; !waiting.empty() && waiting.back().next <= next; waiting.pop_back())
      nodes_.close(waiting.back().node, waiting.back().end);
  };
  const auto open_as = [&](NodeKind kind, std::uint8_t flags, const Node& n) {
    const std::uint32_t node = nodes_.open(kind, n.begin);
    nodes_.add_flags(node, flags);
    waiting.push_back({node, n.end, n.next});
  };
  auto wrap = wrapped_.begin();
  auto declaration = tree_->declarations_.begin();
  for (std::uint32_t i = 0; i < old.size(); ++i) {
    close_before(i);
    const Node n = old[i];
    if (wrap != wrapped_.end() && *wrap == i) {
      ++wrap;
      open_as(NodeKind::factor, static_cast<std::uint8_t>(kFlagStar | (n.flags & kFlagError)), n);
    }
    if (declaration != tree_->declarations_.end() && *declaration == i) {
      *declaration = nodes_.size();
      ++declaration;
    }
    open_as(n.kind, n.flags, n);
  }
  close_before(old.size());
}

std::shared_ptr<const Tree> parse(std::shared_ptr<const Source> source, Diagnostics& diagnostics) {
  return Parser(std::move(source), diagnostics).run();
}

}  // namespace nms::lang
