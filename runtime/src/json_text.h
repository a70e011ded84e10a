#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace nms::runtime {

/// A stretch of a text.
struct TextSpan {
  std::size_t begin = 0;
  std::size_t end = 0;
  [[nodiscard]] std::string_view of(std::string_view text) const { return text.substr(begin, end - begin); }
  [[nodiscard]] bool empty() const { return begin == end; }
};

/// `"key": value` in an object.
struct JsonMember {
  TextSpan key;  ///< between its quotes
  TextSpan value;
  [[nodiscard]] TextSpan whole() const { return {key.begin - 1, value.end}; }
};

// Where things stand in a JSON text that is known to be well-formed. What is asked of anything else ends within the
// text, with spans that mean nothing. Nothing recurses.

/// The value that begins at or behind `at`, without the blanks about it.
[[nodiscard]] TextSpan json_value(std::string_view text, std::size_t at);

/// Members of an object in the text's order; of anything else none.
[[nodiscard]] std::vector<JsonMember> json_members(std::string_view text, TextSpan object);

/// Elements of an array; of anything else none.
[[nodiscard]] std::vector<TextSpan> json_elements(std::string_view text, TextSpan array);

/// The value of a member; where a key stands twice, the last counts, as in most readers. Empty: there is none.
[[nodiscard]] TextSpan json_member(std::string_view text, TextSpan object, std::string_view key);

/// Changes to a JSON text that leave every other byte of it as it is.
class JsonEdit {
 public:
  explicit JsonEdit(std::string_view text) : text_(text), root_(json_value(text, 0)) {}

  [[nodiscard]] std::string_view text() const { return text_; }
  [[nodiscard]] TextSpan root() const { return root_; }

  /// Puts `by` in the place of what stands there.
  void replace(TextSpan span, std::string by);
  /// Adds to the end of an array, or of an object (`"key":value`).
  void append(TextSpan container, const std::vector<std::string>& elements);
  /// The text with all changes made; what stands behind the root value is left out.
  [[nodiscard]] std::string done();

 private:
  struct Change {
    TextSpan span;
    std::string by;
  };
  std::string_view text_;
  TextSpan root_;
  std::vector<Change> changes_;
};

}  // namespace nms::runtime
