#include "lexer.h"

#include <cstring>

namespace nms::lang {

using namespace byte_class;

namespace {

constexpr bool is_side(char c) { return c == 'L' || c == 'R'; }

}  // namespace

bool is_au_token(std::string_view w) {
  std::size_t i = 0;
  const auto at = [&](std::size_t k) { return k < w.size() ? w[k] : '\0'; };
  if (is_side(at(0))) i = 1;
  if (at(i) != 'A' || at(i + 1) != 'U') return false;
  i += 2;
  if (is_side(at(i))) ++i;
  const std::size_t digits = i;
  while (is(at(i), kDigit)) ++i;
  if (i == digits) return false;
  if (is_side(at(i))) ++i;
  if (at(i) >= 'A' && at(i) <= 'E') ++i;
  if (is_side(at(i))) ++i;
  return i == w.size();
}

bool Lexer::skip_blanks() {
  bool line_break = false;
  bool line_start = place_ == 0;
  const std::size_t size = text_.size();
  // A byte order mark is a blank at the very start only.
  if (place_ == 0 && text_.substr(0, 3) == "\xEF\xBB\xBF") place_ = 3;
  while (place_ < size) {
    const char c = text_[place_];
    if (c == '\n') {
      line_break = true;
      line_start = true;
      ++place_;
    } else if (is(c, kBlank)) {
      const char* at = here() + 1;
      while (is(*at, kBlank)) ++at;
      set_place(at);
    } else if (c == '/' && byte(place_ + 1) == '/') {
      const void* found = std::memchr(text_.data() + place_, '\n', size - place_);
      const std::size_t end =
          found == nullptr ? size : static_cast<std::size_t>(static_cast<const char*>(found) - text_.data());
      comments_.push_back({{place_, static_cast<std::uint32_t>(end)}, line_start});
      place_ = static_cast<std::uint32_t>(end);
    } else {
      break;
    }
  }
  return line_break;
}

char Lexer::byte_after_blanks(std::uint32_t at) const {
  while (at < text_.size() && (text_[at] == '\n' || is(text_[at], kBlank))) ++at;
  return byte(at);
}

// Digits, one optional part after a point, and whatever letters or `%` follow. The common short forms are checked here,
// so that the parser need not read them again.
void Lexer::quantity(Token& token) {
  token.kind = Tok::quantity;
  const std::uint32_t begin = place_;
  int points = 0;
  const char* at = here();
  while (is(*at, kDigit)) ++at;
  set_place(at);
  while (true) {
    if (is(byte(place_), kDigit)) {
      ++place_;
    } else if (byte(place_) == '.' && is(byte(place_ + 1), kDigit)) {
      ++points;
      ++place_;
    } else {
      break;
    }
  }
  const std::uint32_t digits = place_ - begin;
  const std::uint32_t unit = place_;
  if (byte(place_) == '%') {
    ++place_;
    token.checked = true;
  } else {
    while (is(byte(place_), kLetter | kDigit)) ++place_;
    switch (place_ - unit) {
      case 0:
        token.checked = true;
        break;
      case 1:
        token.checked = text_[unit] == 's' || text_[unit] == 'x';
        break;
      case 2:
        token.checked = text_[unit] == 'm' && (text_[unit + 1] == 's' || text_[unit + 1] == 'm');
        break;
      default:
        break;
    }
  }
  token.checked = token.checked && digits <= 6 && points <= 1 && text_[begin] != '.';
}

Token Lexer::quoted(char quote, Tok closed, Tok open) {
  Token token;
  token.begin = place_++;
  while (place_ < text_.size() && text_[place_] != '\n') {
    const char c = text_[place_];
    if (c == quote) {
      token.end = ++place_;
      token.kind = closed;
      return token;
    }
    if (c == '\\' && quote == '"' && place_ + 1 < text_.size() && text_[place_ + 1] != '\n') ++place_;
    ++place_;
  }
  // The line's own end is not part of it.
  while (place_ > token.begin + 1 && is(text_[place_ - 1], kBlank)) --place_;
  token.end = place_;
  token.kind = open;
  return token;
}

Token Lexer::next() {
  const bool line_break = skip_blanks();
  Token token;
  token.begin = place_;
  token.line_break = line_break;
  if (place_ >= text_.size()) {
    token.end = place_;
    return token;
  }
  const char c = text_[place_];
  if (is(c, kLetter)) {
    const char* at = here() + 1;
    while (is(*at, kLetter | kDigit)) ++at;
    set_place(at);
    token.kind = Tok::name;
    if ((c == 'A' || c == 'L' || c == 'R') && is_au_token(text_.substr(token.begin, place_ - token.begin)))
      token.kind = Tok::au_token;
  } else if (is(c, kDigit) || (c == '.' && is(byte(place_ + 1), kDigit))) {
    quantity(token);
  } else if (c == '"' || c == '`') {
    token = c == '"' ? quoted('"', Tok::string, Tok::open_string) : quoted('`', Tok::gloss, Tok::open_gloss);
    token.line_break = line_break;
    return token;
  } else {
    const char second = byte(place_ + 1);
    std::uint32_t length = 1;
    const auto pair = [&](char other, Tok two, Tok one) {
      if (second != other) return one;
      length = 2;
      return two;
    };
    switch (c) {
      case '(':
        token.kind = Tok::left_paren;
        break;
      case ')':
        token.kind = Tok::right_paren;
        break;
      case '[':
        token.kind = Tok::left_bracket;
        break;
      case ']':
        token.kind = Tok::right_bracket;
        break;
      case '{':
        token.kind = Tok::left_brace;
        break;
      case '}':
        token.kind = Tok::right_brace;
        break;
      case ';':
        token.kind = Tok::semicolon;
        break;
      case ',':
        token.kind = Tok::comma;
        break;
      case ':':
        token.kind = Tok::colon;
        break;
      case '+':
        token.kind = Tok::plus;
        break;
      case '-':
        token.kind = Tok::minus;
        break;
      case '*':
        token.kind = Tok::star;
        break;
      case '@':
        token.kind = Tok::at_sign;
        break;
      case '~':
        token.kind = Tok::tilde;
        break;
      case '=':
        token.kind = pair('=', Tok::equal_equal, Tok::equal);
        break;
      case '<':
        token.kind = pair('=', Tok::less_equal, Tok::less);
        break;
      case '>':
        token.kind = pair('=', Tok::greater_equal, Tok::greater);
        break;
      case '.':
        token.kind = pair('.', Tok::dot_dot, Tok::invalid);
        break;
      default:
        token.kind = Tok::invalid;
        break;
    }
    place_ += length;
    // Neighbouring bytes that begin nothing are one token: one report is enough.
    if (token.kind == Tok::invalid) {
      while (is(byte(place_), kInvalid) && place_ < text_.size()) {
        const char next = text_[place_];
        if (next == '/' && byte(place_ + 1) == '/') break;
        if (next == '.' && (byte(place_ + 1) == '.' || is(byte(place_ + 1), kDigit))) break;
        ++place_;
      }
    }
  }
  token.end = place_;
  return token;
}

std::uint32_t Lexer::gloss_end(std::uint32_t begin) const {
  std::uint32_t at = begin;
  while (at < text_.size() && !is(text_[at], kGlossEnd)) {
    if ((text_[at] == '.' && byte(at + 1) == '.') || (text_[at] == '/' && byte(at + 1) == '/')) break;
    ++at;
  }
  while (at > begin && text_[at - 1] == ',') --at;
  return at;
}

Token Lexer::gloss(const Token& at) {
  if (at.kind == Tok::gloss || at.kind == Tok::open_gloss) return at;
  const std::uint32_t end = gloss_end(at.begin);
  if (end == at.begin) return at;
  Token token = at;
  token.kind = Tok::gloss;
  token.end = end;
  place_ = end;
  return token;
}

}  // namespace nms::lang
