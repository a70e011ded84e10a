#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include <nms/lang/tree.h>

namespace nms::lang {

enum class Tok : std::uint8_t {
  eof,
  name,
  au_token,
  quantity,
  string,
  gloss,
  left_paren,
  right_paren,
  left_bracket,
  right_bracket,
  left_brace,
  right_brace,
  semicolon,
  comma,
  colon,
  equal,
  equal_equal,
  less_equal,
  greater_equal,
  less,
  greater,
  plus,
  minus,
  star,
  dot_dot,
  at_sign,
  tilde,
  open_string,  ///< a string that its line ends
  open_gloss,   ///< a backquoted gloss that its line ends
  invalid,      ///< bytes that no token begins with
};

struct Token {
  std::uint32_t begin = 0;
  std::uint32_t end = 0;
  Tok kind = Tok::eof;
  bool line_break = false;  ///< a line break stands between this token and the one before
  bool ends = false;        ///< the parser's view of it: the line break ends the statement
  bool checked = false;     ///< quantity: known to be well formed
};

/// What a byte may be part of.
namespace byte_class {
inline constexpr std::uint8_t kBlank = 1;   // blanks that do not end a line
inline constexpr std::uint8_t kLetter = 2;  // may begin a name
inline constexpr std::uint8_t kDigit = 4;
inline constexpr std::uint8_t kGlossEnd = 8;  // ends a gloss
inline constexpr std::uint8_t kInvalid = 16;  // begins no token

constexpr std::array<std::uint8_t, 256> make_classes() {
  std::array<std::uint8_t, 256> c{};
  for (std::size_t i = 0; i < 256; ++i) c[i] = i < 32 || i >= 127 ? kInvalid : std::uint8_t{0};
  for (char ch : {'!', '#', '$', '&', '\'', '?', '\\', '^', '|', '/', '.', '%'})
    c[static_cast<unsigned char>(ch)] = kInvalid;
  for (std::size_t i = 'a'; i <= 'z'; ++i) c[i] = kLetter;
  for (std::size_t i = 'A'; i <= 'Z'; ++i) c[i] = kLetter;
  c['_'] = kLetter;
  for (std::size_t i = '0'; i <= '9'; ++i) c[i] = kDigit;
  for (char ch : {' ', '\t', '\r', '\f', '\v'}) c[static_cast<unsigned char>(ch)] = kBlank | kGlossEnd;
  for (char ch : {'\n', '[', ']', '{', '}', ';', '@', '"', '`'}) c[static_cast<unsigned char>(ch)] |= kGlossEnd;
  c['\n'] = kGlossEnd;
  return c;
}
inline constexpr std::array<std::uint8_t, 256> kClasses = make_classes();

constexpr std::uint8_t class_of(char c) { return kClasses[static_cast<unsigned char>(c)]; }
constexpr bool is(char c, unsigned classes) { return (class_of(c) & classes) != 0; }
}  // namespace byte_class

/// Cuts text into tokens, one at a time, and gathers comments. Keeps nothing but its place, so a token can be read
/// again in the other mode. Never reports: what is wrong with a token matters only to the parser that takes it.
class Lexer {
 public:
  /// @pre the byte behind the text is a NUL, as it is behind a string's: runs need no other end
  Lexer(std::string_view text, std::vector<Comment>& comments) : text_(text), comments_(comments) {}

  /// The next token in normal mode.
  Token next();
  /// The token at `at` read as a gloss: a run without blanks, brackets, braces, `;`, `@`, `"`, not containing `..` or
  /// `//`; a comma at its end does not belong to it; or a backquoted text. An empty run gives `at` back as it is.
  Token gloss(const Token& at);
  /// End of the gloss that begins at `begin`, backquotes aside.
  [[nodiscard]] std::uint32_t gloss_end(std::uint32_t begin) const;

  [[nodiscard]] static bool begins_name(char c) { return byte_class::is(c, byte_class::kLetter); }
  [[nodiscard]] static bool in_name(char c) { return byte_class::is(c, byte_class::kLetter | byte_class::kDigit); }

  [[nodiscard]] std::uint32_t place() const { return place_; }
  void set_place(std::uint32_t place) { place_ = place; }
  /// The byte at `at`, 0 past the end.
  [[nodiscard]] char byte(std::uint32_t at) const { return at < text_.size() ? text_[at] : '\0'; }
  /// The first byte at or after `at` that is not a blank or line break, 0 at the end.
  [[nodiscard]] char byte_after_blanks(std::uint32_t at) const;

 private:
  bool skip_blanks();
  [[nodiscard]] const char* here() const { return text_.data() + place_; }
  void set_place(const char* here) { place_ = static_cast<std::uint32_t>(here - text_.data()); }
  void quantity(Token& token);
  [[nodiscard]] Token quoted(char quote, Tok closed, Tok open);

  std::string_view text_;
  std::vector<Comment>& comments_;
  std::uint32_t place_ = 0;
};

/// Whether a word is an action unit's: AU12, AU14RC, AUL20B, LAU4.
[[nodiscard]] bool is_au_token(std::string_view word);

}  // namespace nms::lang
