// Quantities, values, properties and blocks of options.
#include <fmt/format.h>
#include <nms/lang/quantity.h>

#include "parser.h"

namespace nms::lang {

// The token is a number: says what is wrong with it, if anything is. The number is taken as it is.
void Parser::check_quantity() {
  if (token_.checked) return;
  const std::string_view text = slice(token_);
  if (read_quantity(text)) return;
  std::size_t digits = 0;
  int points = 0;
  while (digits < text.size() && ((text[digits] >= '0' && text[digits] <= '9') || text[digits] == '.'))
    points += text[digits++] == '.' ? 1 : 0;
  const std::string number(text.substr(0, digits));
  const std::string unit(text.substr(digits));
  const Range range{token_.begin, token_.end};
  if (points > 1) {
    soft_fail(range, BadQuantity{std::string(text), "has more than one decimal point", ""});
  } else if (text.front() == '.') {
    soft_fail(range, BadQuantity{std::string(text), "has no digit before its decimal point",
                                 fmt::format("write `0{}`", text)});
  } else if (!unit.empty() && !read_quantity("1" + unit)) {
    static const std::vector<std::string> kUnits = {"%", "s", "ms", "us", "deg", "Hz", "x", "mm", "cm"};
    std::vector<std::string> near = nearest(unit, kUnits, 1);
    // Of one letter, every other is one edit away.
    if (unit.size() == 1) near.clear();
    // What people write for them elsewhere.
    if (unit == "sec" || unit == "secs" || unit == "seconds" || unit == "second" || unit == "S") near = {"s"};
    if (unit == "msec" || unit == "msecs" || unit == "milliseconds") near = {"ms"};
    if (unit == "degrees" || unit == "degree" || unit == "d") near = {"deg"};
    if (unit == "hertz" || unit == "hz") near = {"Hz"};
    if (unit == "times" || unit == "X") near = {"x"};
    if (unit == "percent" || unit == "pct") near = {"%"};
    soft_fail({token_.begin + static_cast<std::uint32_t>(digits), token_.end}, UnknownUnit{number, unit, near});
  } else {
    soft_fail(range, BadQuantity{std::string(text), "is too large", "times go up to 1000000s, all else to 1000000000"});
  }
}

bool Parser::quantity(std::string_view what) {
  if (!at_quantity()) return unexpected(what);
  const std::uint32_t begin = token_.begin;
  if (token_.kind != Tok::quantity) advance();
  const bool poisoned = std::exchange(poison_, false);
  check_quantity();
  leaf_of(NodeKind::quantity, begin, token_.end, poison_ ? kFlagError : std::uint8_t{0});
  poison_ = poison_ || poisoned;
  advance();
  return true;
}

bool Parser::vector() {
  if (!at(Tok::left_paren)) return unexpected("`(`", "a place is written `(1mm, 2mm, 3mm)`");
  Open node(*this, NodeKind::vector);
  const std::uint32_t opener = token_.begin;
  open_bracket();
  for (int i = 0; i < 3; ++i) {
    if (i > 0 && !expect(Tok::comma, "`,`", "a place has three numbers: `(1mm, 2mm, 3mm)`")) return false;
    if (!quantity("a number")) return false;
  }
  return closing(Tok::right_paren, '(', opener, "`)`");
}

// `100ms`, `left`, `"text"`, `(1, 2, 3)`, and sums of the kind `100ms + 2 * k`.
bool Parser::value() {
  if (at(Tok::string) || at(Tok::gloss)) {
    leaf(at(Tok::string) ? NodeKind::string : NodeKind::gloss);
    return true;
  }
  const Mark start = mark();
  bool arithmetic = false;
  if (at(Tok::left_paren)) {
    // `(` quantity `,` begins a vector.
    std::uint32_t at_byte = token_.end;
    while (lexer_.byte(at_byte) != '\0' && lexer_.byte(at_byte) != ',' && lexer_.byte(at_byte) != ')' &&
           lexer_.byte(at_byte) != '(' && at_byte - token_.end < 80)
      ++at_byte;
    if (lexer_.byte(at_byte) == ',') return vector();
    arithmetic = true;
  } else if (at_quantity()) {
    if (!quantity()) return false;
  } else if (at(Tok::name) || at(Tok::au_token)) {
    const bool is_name = at(Tok::name);
    const std::uint32_t end = token_.end;
    leaf(is_name ? NodeKind::name : NodeKind::au_token);
    arithmetic = is_name && at(Tok::left_paren) && token_.begin == end;
  } else {
    return unexpected("a value");
  }
  if (at(Tok::star) || ((at(Tok::plus) || at(Tok::minus)) && !at_quantity())) arithmetic = true;
  if (!arithmetic) return true;
  const bool poisoned = poison_;
  go_back(start);
  star_only_ = true;
  const bool ok = sum();
  star_only_ = false;
  poison_ = poison_ || poisoned;
  return ok;
}

void Parser::note_property(std::string_view name, Range range) {
  if (once_ == nullptr) return;
  static constexpr std::string_view kOnce[] = {"onset",   "apex",   "offset",  "lead",   "lag",   "held",
                                               "profile", "easing", "spreads", "layer",  "merge", "surface",
                                               "every",   "jitter", "size",    "licence"};
  for (std::size_t i = 0; i < std::size(kOnce); ++i) {
    if (name != kOnce[i]) continue;
    if ((once_->seen >> i & 1U) != 0) {
      if (Diagnostic* d = soft_fail(range, DuplicateProperty{std::string(name)}))
        d->labels.push_back({tree_->source_, once_->first[i], "first said here"});
    } else {
      once_->seen |= 1U << i;
      once_->first[i] = range;
    }
  }
}

// In a block of statements a property ends with its line; in options also where the next name begins, its first value
// aside: `easing linear  onset 100ms`. `held` alone never takes a name.
bool Parser::property(bool in_options) {
  Open node(*this, NodeKind::property);
  bool takes_name = true;
  if (at(Tok::quantity)) {
    if (!quantity()) return false;
    if (!expect(Tok::equal, "`=`", "a property begins with its name, or is of the form `100% = 75deg`")) return false;
  } else if (at(Tok::name)) {
    const std::string_view word = slice(token_);
    note_property(word, {token_.begin, token_.end});
    takes_name = word != "held";
    leaf(NodeKind::name);
    if (at(Tok::equal) || at(Tok::colon))
      return unexpected("a value", fmt::format("write `{} VALUE`, without the `{}`", word, slice(token_)));
  } else {
    return unexpected("a property's name");
  }
  while (!at_statement_end()) {
    if (in_options && at(Tok::name) && !takes_name) return true;
    if (in_options && at(Tok::comma)) return unexpected("the next property", "leave the comma out");
    if (at(Tok::left_brace)) return true;
    if (!value()) return false;
    takes_name = false;
  }
  return true;
}

bool Parser::profile() {
  Open node(*this, NodeKind::profile);
  note_property("profile", {token_.begin, token_.end});
  advance();
  if (at(Tok::name)) {
    leaf(NodeKind::name);
    return true;
  }
  while (true) {
    {
      Open here(*this, NodeKind::profile_point);
      if (!quantity("a share, as in `60% start, 100% at WHO, 80% end`")) return false;
      if (at_word("start") || at_word("end")) {
        leaf(NodeKind::name);
      } else if (at_word("at")) {
        advance();
        if (!at_point()) return false;
      } else {
        return unexpected("`start`, `end` or `at`");
      }
    }
    if (!at(Tok::comma)) return true;
    advance();
  }
}

bool Parser::options() {
  Open node(*this, NodeKind::options);
  const bool star_only = std::exchange(star_only_, false);
  const Braced end = braced([&] {
    token_.ends = false;
    const std::uint32_t begin = token_.begin;
    const bool poisoned = std::exchange(poison_, false);
    if (at_word("profile"))
      profile();
    else
      property(true);
    if (panic_) recover(begin);
    poison_ = poison_ || poisoned;
  });
  star_only_ = star_only;
  return end == Braced::closed;
}

}  // namespace nms::lang
