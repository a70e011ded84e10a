#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <nms/lang/diagnostic.h>

namespace nms::lang {

/// What can be wrong with a text before its names are looked up: X(Struct, kind). The one list; tests walk it.
// clang-format off
#define NMS_LANG_DIAGNOSTICS(X)                \
  X(UnexpectedToken, unexpected_token)         \
  X(MissingTerminator, missing_terminator)     \
  X(UnknownDeclaration, unknown_declaration)   \
  X(UnclosedBracket, unclosed_bracket)         \
  X(DetachedBracket, detached_bracket)         \
  X(UnterminatedString, unterminated_string)   \
  X(UnterminatedGloss, unterminated_gloss)     \
  X(EmptyGloss, empty_gloss)                   \
  X(BadSignTime, bad_sign_time)                \
  X(BadQuantity, bad_quantity)                 \
  X(UnknownUnit, unknown_unit)                 \
  X(InvalidCharacter, invalid_character)       \
  X(DuplicateProperty, duplicate_property)     \
  X(NestingTooDeep, nesting_too_deep)          \
  X(FileTooLarge, file_too_large)
// clang-format on

/// Something else stands where the grammar wants `expected`.
struct UnexpectedToken {
  static constexpr std::string_view kKind = "unexpected_token";
  static constexpr Severity kSeverity = Severity::error;
  std::string seen;      ///< as a person reads it: "`over`", "the end of the line"
  std::string expected;  ///< "a name", "`=`"
  std::string help;      ///< may be empty
  [[nodiscard]] Description describe() const;
};

/// A statement goes on where it should have ended.
struct MissingTerminator {
  static constexpr std::string_view kKind = "missing_terminator";
  static constexpr Severity kSeverity = Severity::error;
  std::string seen;
  std::string help;  ///< empty: a new line
  [[nodiscard]] Description describe() const;
};

struct UnknownDeclaration {
  static constexpr std::string_view kKind = "unknown_declaration";
  static constexpr Severity kSeverity = Severity::error;
  std::string word;
  std::vector<std::string> nearest;
  [[nodiscard]] Description describe() const;
};

/// The opener is labelled.
struct UnclosedBracket {
  static constexpr std::string_view kKind = "unclosed_bracket";
  static constexpr Severity kSeverity = Severity::error;
  char opener;
  std::string seen;
  [[nodiscard]] Description describe() const;
};

/// `wh [ ... ]`: a label that a blank parts from its bracket.
struct DetachedBracket {
  static constexpr std::string_view kKind = "detached_bracket";
  static constexpr Severity kSeverity = Severity::error;
  std::string label;  ///< empty: the bracket has none
  [[nodiscard]] Description describe() const;
};

struct UnterminatedString {
  static constexpr std::string_view kKind = "unterminated_string";
  static constexpr Severity kSeverity = Severity::error;
  [[nodiscard]] Description describe() const;
};

struct UnterminatedGloss {
  static constexpr std::string_view kKind = "unterminated_gloss";
  static constexpr Severity kSeverity = Severity::error;
  [[nodiscard]] Description describe() const;
};

/// No sign's name where one is expected.
struct EmptyGloss {
  static constexpr std::string_view kKind = "empty_gloss";
  static constexpr Severity kSeverity = Severity::error;
  std::string seen;
  [[nodiscard]] Description describe() const;
};

struct BadSignTime {
  static constexpr std::string_view kKind = "bad_sign_time";
  static constexpr Severity kSeverity = Severity::error;
  std::string seen;
  std::string expected;
  std::string gloss;
  [[nodiscard]] Description describe() const;
};

struct BadQuantity {
  static constexpr std::string_view kKind = "bad_quantity";
  static constexpr Severity kSeverity = Severity::error;
  std::string text;
  std::string why;
  std::string help;
  [[nodiscard]] Description describe() const;
};

struct UnknownUnit {
  static constexpr std::string_view kKind = "unknown_unit";
  static constexpr Severity kSeverity = Severity::error;
  std::string number;
  std::string unit;
  std::vector<std::string> nearest;
  [[nodiscard]] Description describe() const;
};

struct InvalidCharacter {
  static constexpr std::string_view kKind = "invalid_character";
  static constexpr Severity kSeverity = Severity::error;
  std::string text;  ///< the bytes that begin nothing
  [[nodiscard]] Description describe() const;
};

/// The first one is labelled.
struct DuplicateProperty {
  static constexpr std::string_view kKind = "duplicate_property";
  static constexpr Severity kSeverity = Severity::error;
  std::string name;
  [[nodiscard]] Description describe() const;
};

struct NestingTooDeep {
  static constexpr std::string_view kKind = "nesting_too_deep";
  static constexpr Severity kSeverity = Severity::error;
  int limit;
  [[nodiscard]] Description describe() const;
};

struct FileTooLarge {
  static constexpr std::string_view kKind = "file_too_large";
  static constexpr Severity kSeverity = Severity::error;
  std::size_t bytes;
  std::size_t limit;
  [[nodiscard]] Description describe() const;
};

}  // namespace nms::lang
