// The declarations that large files are full of, read from the text without tokens between:
//
//     pose p = 60% AU12 + 40% AU4L
//     expression e 2.4s {
//       40%: p
//       60%: q
//     }
//
// All else, down to a second blank, is left to the rules, which make the same nodes of these.
#include "parser.h"

namespace nms::lang {
namespace {

constexpr bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Digits of a number that need not be looked at again, see Lexer::quantity.
constexpr int kMostDigits = 6;

/// Past up to six digits from `at`; `at` itself: there are none, or more.
const char* past_digits(const char* at) {
  const char* end = at;
  while (is_digit(*end)) ++end;
  return end - at <= kMostDigits ? end : at;
}

/// Past a name that is no action unit's, or null.
const char* past_name(const char* at) {
  if (!Lexer::begins_name(*at)) return nullptr;
  const char* end = at + 1;
  while (Lexer::in_name(*end)) ++end;
  const bool may_be_unit = *at == 'A' || *at == 'L' || *at == 'R';
  return may_be_unit && is_au_token({at, static_cast<std::size_t>(end - at)}) ? nullptr : end;
}

/// Past `AU12`, `AU12L`, `AU12LC` behind the blank at `at`, or null.
const char* past_unit(const char* at) {
  if (at[0] != ' ' || at[1] != 'A' || at[2] != 'U' || !is_digit(at[3])) return nullptr;
  at += 4;
  while (is_digit(*at)) ++at;
  if (*at == 'L' || *at == 'R') ++at;
  if (*at >= 'A' && *at <= 'E') ++at;
  return Lexer::in_name(*at) ? nullptr : at;
}

/// Past the end of the line that is at `at`, or null.
const char* past_line_end(const char* at) {
  if (*at == '\r') ++at;
  return *at == '\n' ? at + 1 : nullptr;
}

/// `40%: p` and the end of its line at `at`; where a step's words may be others, nothing.
struct PlainStep {
  const char* share_end = nullptr;
  const char* name_end = nullptr;  ///< null: it is not plain

  explicit PlainStep(const char* at) : share_end(past_digits(at)) {
    if (share_end == at || share_end[0] != '%' || share_end[1] != ':' || share_end[2] != ' ') return;
    ++share_end;
    const char* const end = past_name(name());
    if (end == nullptr || past_line_end(end) == nullptr) return;
    const std::string_view word(name(), static_cast<std::size_t>(end - name()));
    if (word != "facs" && word != "mouthing") name_end = end;
  }
  [[nodiscard]] const char* name() const { return share_end + 2; }
};

}  // namespace

// Ends of texts need no test: the byte behind a text is a NUL, which goes on with nothing.

// What is read ends before `end`, its last token being of that kind.
void Parser::go_on_behind(const char* end, Tok last) {
  token_.kind = last;
  token_.end = offset(end);
  lexer_.set_place(token_.end);
  advance();
}

// `60% AU12 + 40% AU4L` from `at`. Past the last term, or null: there is none.
const char* Parser::add_plain_terms(const char* at) {
  const char* last = nullptr;
  while (true) {
    const char* const number_end = past_digits(at);
    if (number_end == at || *number_end != '%') return last;
    const char* const unit = number_end + 2;
    const char* const end = past_unit(number_end + 1);
    if (end == nullptr ||
        !nodes_.scaled_leaf(offset(at), offset(number_end + 1), NodeKind::au_token, offset(unit), offset(end)))
      return last;
    last = end;
    if (end[0] != ' ' || end[1] != '+' || end[2] != ' ') return last;
    at = end + 3;
  }
}

// The token is what may be a term's number. False: nothing was read.
bool Parser::plain_terms() {
  if (star_only_ || poison_ || !at(Tok::quantity)) return false;
  const char* const end = add_plain_terms(text_.data() + token_.begin);
  if (end == nullptr) return false;
  go_on_behind(end, Tok::au_token);
  return true;
}

// The token is what may be a step's share. False: nothing was read.
bool Parser::plain_step() {
  if (poison_ || brackets_ != 0 || !at(Tok::quantity)) return false;
  const char* const begin = text_.data() + token_.begin;
  const PlainStep step(begin);
  if (step.name_end == nullptr ||
      !nodes_.named_step(offset(begin), offset(step.share_end), offset(step.name()), offset(step.name_end)))
    return false;
  go_on_behind(step.name_end, Tok::name);
  return true;
}

// The token is the declaration's word. False: nothing was read.
bool Parser::plain_pose() {
  const char* const name = text_.data() + token_.end + 1;
  const char* const name_end = name[-1] == ' ' ? past_name(name) : nullptr;
  if (name_end == nullptr || name_end[0] != ' ' || name_end[1] != '=' || name_end[2] != ' ') return false;
  const std::uint32_t before = nodes_.size();
  nodes_.leaf(NodeKind::name, offset(name), offset(name_end));
  const std::uint32_t sum = nodes_.open(NodeKind::sum, offset(name_end + 3));
  const char* const end = add_plain_terms(name_end + 3);
  if (end == nullptr || past_line_end(end) == nullptr) {
    nodes_.truncate(before);
    return false;
  }
  nodes_.close(sum, offset(end));
  go_on_behind(end, Tok::au_token);
  return true;
}

// The token is the declaration's word. False: nothing was read.
bool Parser::plain_expression() {
  const char* const name = text_.data() + token_.end + 1;
  const char* const name_end = name[-1] == ' ' ? past_name(name) : nullptr;
  if (name_end == nullptr || *name_end != ' ') return false;
  const char* const length = name_end + 1;
  const char* at = past_digits(length);
  if (at == length) return false;
  if (at[0] == '.' && is_digit(at[1])) at = past_digits(at + 1);
  if (at[0] != 's' || at - length > kMostDigits || at[1] != ' ' || at[2] != '{') return false;
  const char* line = past_line_end(at + 3);
  if (line == nullptr) return false;
  const std::uint32_t before = nodes_.size();
  nodes_.leaf(NodeKind::name, offset(name), offset(name_end));
  nodes_.leaf(NodeKind::quantity, offset(length), offset(at + 1));
  while (true) {
    at = line;
    while (*at == ' ' || *at == '\t') ++at;
    if (*at == '}') break;
    const PlainStep step(at);
    if (step.name_end == nullptr ||
        !nodes_.named_step(offset(at), offset(step.share_end), offset(step.name()), offset(step.name_end))) {
      nodes_.truncate(before);
      return false;
    }
    line = past_line_end(step.name_end);
  }
  go_on_behind(at + 1, Tok::right_brace);
  return true;
}

}  // namespace nms::lang
