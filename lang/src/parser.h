#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nms/lang/diagnostic_kinds.h>
#include <nms/lang/parse.h>

#include "lexer.h"

namespace nms::lang {

/// Builds a tree by recursive descent: one token of lookahead, nodes pushed in pre-order as they open.
///
/// What is true throughout:
///  - `token_` is the next token. Its `ends` says that the line break before it ends the statement; `at()` is then
///  false
///    for every kind, so that no rule reads over the end of its statement by accident.
///  - A rule returns false once it has reported; `panic_` is then on, and each rule up to the statement's returns at
///  once.
///    The statement's loop recovers: it skips to the statement's end under one `error` node, and goes on.
///  - Nodes that close while `poison_` is on get kFlagError: the statement's node and those in it up to the fault.
///  - One place is reported once.
class Parser {
 public:
  Parser(std::shared_ptr<const Source> source, Diagnostics& diagnostics);
  std::shared_ptr<const Tree> run();

 private:
  // ---- parser.cpp: tokens, nodes, reports, recovery
  void advance();
  void open_bracket();   // takes `(` or `[`: line breaks are blanks inside
  void close_bracket();  // takes `)` or `]`
  void read_as_gloss();
  [[nodiscard]] bool at(Tok kind) const { return token_.kind == kind && !token_.ends; }
  [[nodiscard]] bool at_word(std::string_view word) const { return at(Tok::name) && slice(token_) == word; }
  [[nodiscard]] bool at_statement_end() const {
    return token_.ends || token_.kind == Tok::semicolon || token_.kind == Tok::right_brace || token_.kind == Tok::eof;
  }
  [[nodiscard]] bool at_line_end() const {
    return token_.ends || (token_.kind == Tok::right_brace && token_.line_break && brackets_ == 0);
  }
  /// A number, or a sign and a number with no blank between.
  [[nodiscard]] bool at_quantity() const;
  [[nodiscard]] std::string_view slice(const Token& t) const { return text_.substr(t.begin, t.end - t.begin); }
  [[nodiscard]] Range here() const;  // the place to report: the token, or the end of the line before it
  [[nodiscard]] std::string seen() const;

  std::uint32_t open(NodeKind kind);
  void close(std::uint32_t node);
  void leaf(NodeKind kind);  // the token becomes a node
  void leaf_of(NodeKind kind, std::uint32_t begin, std::uint32_t end, std::uint8_t flags = 0);
  /// Puts a parent of `kind` around the last node, a leaf.
  std::uint32_t wrap_last(NodeKind kind);
  void flag(std::uint32_t node, std::uint8_t bits) { nodes_.add_flags(node, bits); }
  /// Opens at construction, closes at destruction.
  class Open;
  /// Where the parser is; going back costs nothing but what was read since.
  struct Mark {
    Token token;
    std::uint32_t place;
    std::uint32_t nodes;
    std::size_t comments;
    std::uint32_t previous_end;
    Tok previous;
  };
  [[nodiscard]] Mark mark() const;
  void go_back(const Mark& mark);

  /// Reports and leaves the statement.
  template <typename Kind>
  bool fail(Range range, const Kind& kind) {
    if (!panic_) soft_fail(range, kind);
    panic_ = true;
    return false;
  }
  /// Reports and goes on.
  template <typename Kind>
  Diagnostic* soft_fail(Range range, const Kind& kind) {
    poison_ = true;
    if (range.begin == last_report_) return nullptr;
    last_report_ = range.begin;
    if (diagnostics_.error_count() >= Diagnostics::kMaxKept) {
      // Counted, not told: the words would be thrown away.
      diagnostics_.add(Diagnostic{Kind::kKind, Kind::kSeverity, nullptr, range, {}, {}, {}, {}});
      return nullptr;
    }
    return &diagnostics_.report(tree_->source_, range, kind);
  }
  bool unexpected(std::string_view expected, std::string_view help = {});
  bool unclosed(char opener, std::uint32_t at);
  bool expect(Tok kind, std::string_view what, std::string_view help = {});
  bool closing(Tok kind, char opener, std::uint32_t opener_at, std::string_view expected);

  /// Enters one level of brackets; false once they are too deep.
  bool enter();
  void leave() { --nesting_; }
  void recover(std::uint32_t statement_begin);
  void skip_to_block();
  void split_open_string();
  [[nodiscard]] bool declaration_begins_here() const;
  /// `{ items }` of statements. `item` parses one; it need not clean up after itself.
  template <typename Item>
  bool block(Item item);
  /// What stands between `{`, which is the token, and `}`: an item at a time, up to the end of the block or of the
  /// file.
  enum class Braced : std::uint8_t { closed, unclosed, too_deep };
  template <typename Item>
  Braced braced(Item item);
  template <typename Item>
  void statement(Item item);
  void statement_end(Tok last);

  // ---- parse_declarations.cpp
  void file();
  void declaration();
  bool take_docs();
  bool name(std::string_view what = "a name");
  bool params();
  bool string(std::string_view what);
  bool use();
  bool pose();
  bool expression();
  bool motion();
  bool timeline();
  bool ambient();
  bool at_ambience();
  bool ambience();
  bool test();
  bool play();
  bool call_arguments();
  bool expect_();
  bool degree();
  bool discourse();
  bool discourse_item();
  bool role_shift();

  // ---- parse_lexicon.cpp
  bool lexicon();
  bool entry();
  bool entry_item();
  bool combine();
  bool include();
  bool remove();
  bool licence();
  bool names(std::string_view what);
  bool when();
  bool one_of();
  [[nodiscard]] bool at_one_of() const;
  bool utterance();
  bool utterance_item();

  // ---- parse_face.cpp
  bool au();
  bool axis();
  bool track();
  bool muscle();
  bool face();
  bool landmark();

  // ---- parse_property.cpp
  bool quantity(std::string_view what = "a quantity");
  void check_quantity();
  bool vector();
  bool value();
  bool property(bool in_options);
  bool property_block();
  bool options();
  bool profile();
  void note_property(std::string_view name, Range range);
  [[nodiscard]] bool at_property_word() const;

  // ---- parse_movement.cpp
  bool sum();
  bool term();
  bool call();  // the name is the last node, the token is `(`
  bool arguments(std::uint32_t opener_at);
  bool argument();
  bool group();
  bool steps();
  bool step();
  [[nodiscard]] bool at_steps() const;
  [[nodiscard]] bool at_primary() const;
  [[nodiscard]] bool at_placement_word() const;

  // ---- parse_plain.cpp
  bool plain_pose();
  bool plain_expression();
  bool plain_terms();
  bool plain_step();
  const char* add_plain_terms(const char* at);
  void go_on_behind(const char* end, Tok last);
  [[nodiscard]] std::uint32_t offset(const char* at) const { return static_cast<std::uint32_t>(at - text_.data()); }

  // ---- parse_placement.cpp
  bool placement();
  bool span();
  bool span_end();
  bool point(std::string_view what = "a point in time");
  bool offset();
  bool at_point();
  bool gloss();
  bool over();

  // ---- parse_signs.cpp
  bool signs();
  void sign_items(char opener, std::uint32_t opener_at);
  void sign();
  void tag();
  bool sign_time(std::string_view gloss_text);
  void bracket(std::uint32_t label_end);
  void recover_sign();
  void skip_braces();
  [[nodiscard]] std::uint32_t bracket_label() const;

  void finish_wraps();

  std::shared_ptr<Tree> tree_;
  NodeList& nodes_;
  Diagnostics& diagnostics_;
  std::string_view text_;
  Lexer lexer_;
  Token token_;
  std::uint32_t previous_end_ = 0;
  Tok previous_ = Tok::eof;
  int brackets_ = 0;  // open ( and [ since the last {
  int nesting_ = 0;   // open brackets and blocks of all kinds
  bool panic_ = false;
  bool poison_ = false;
  bool star_only_ = false;              // values: a factor needs its `*`
  std::vector<std::uint32_t> wrapped_;  // groups that turned out to be factors
  std::uint32_t last_report_ = UINT32_MAX;

  /// Properties a block may say once, and where it did.
  struct Once {
    std::uint32_t seen = 0;
    Range first[16];
  };
  Once* once_ = nullptr;
};

class Parser::Open {
 public:
  Open(Parser& parser, NodeKind kind) : parser_(parser), node_(parser.open(kind)) {}
  ~Open() { parser_.close(node_); }
  Open(const Open&) = delete;
  Open& operator=(const Open&) = delete;
  [[nodiscard]] std::uint32_t node() const { return node_; }

 private:
  Parser& parser_;
  std::uint32_t node_;
};

template <typename Item>
void Parser::statement(Item item) {
  const bool poisoned = std::exchange(poison_, false);
  const std::uint32_t begin = token_.begin;
  const bool star_only = std::exchange(star_only_, false);
  token_.ends = false;
  item();
  star_only_ = star_only;
  if (!panic_) statement_end(previous_);
  if (panic_) recover(begin);
  poison_ = poisoned;
}

template <typename Item>
bool Parser::block(Item item) {
  if (!at(Tok::left_brace)) {
    const bool next_line = token_.ends && token_.kind == Tok::left_brace;
    unexpected("`{`", next_line ? "write `{` on the same line: a line break ends the statement" : "");
    // The block is read all the same, wherever it begins.
    if (next_line) {
      token_.ends = false;
      panic_ = false;
    } else {
      skip_to_block();
    }
    if (panic_) return false;
  }
  switch (braced([&] { statement(item); })) {
    case Braced::too_deep:
      return false;
    case Braced::closed:
      return true;
    case Braced::unclosed:
      panic_ = false;
      token_.ends = true;
      return true;
  }
  return false;
}

template <typename Item>
Parser::Braced Parser::braced(Item item) {
  const std::uint32_t opener = token_.begin;
  if (!enter()) return Braced::too_deep;
  const int brackets = std::exchange(brackets_, 0);
  Once once;
  Once* outer_once = std::exchange(once_, &once);
  advance();
  Braced end = Braced::closed;
  while (true) {
    while (token_.kind == Tok::semicolon) advance();
    if (token_.kind == Tok::right_brace) break;
    if (token_.kind == Tok::eof || declaration_begins_here()) {
      token_.ends = false;
      unclosed('{', opener);
      end = Braced::unclosed;
      break;
    }
    item();
  }
  brackets_ = brackets;
  once_ = outer_once;
  leave();
  if (end == Braced::closed) advance();
  return end;
}

}  // namespace nms::lang
