#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <nms/lang/tree.h>

#include "format.h"

namespace nms::lang {

/// Writes canonical lines: indent, line breaks, trials of one line, and the comments that stand between the tokens.
/// Whoever prints the nodes derives from it, and hands each token's place over before it writes the token.
class FormatLines {
 protected:
  explicit FormatLines(const Tree& tree) : tree_(tree), text_(tree.source().text()) {}

  static constexpr std::string_view kBlanks = " \t\r\n\f\v";
  static constexpr std::size_t kNoStatement = static_cast<std::size_t>(-1);

  void put(std::string_view s);
  void line_break(int indent);

  /// Writes with `print` on one line; takes it back if that is too long.
  template <typename Print>
  bool try_flat(Print print) {
    const std::size_t size = out_.size();
    ++flat_;
    print();
    --flat_;
    if (!over_) return true;
    if (flat_ == 0) over_ = false;
    out_.resize(size);
    return false;
  }

  /// Whether a comment waits that stands before this byte.
  [[nodiscard]] bool comment_before(std::uint32_t end) const;
  /// Inside a statement, before the token at `begin`.
  void comments_before_token(std::uint32_t begin);

  /// @return its number, for end_statement and next_line
  std::size_t begin_statement(NodeRef n);
  /// What stands behind it on its line has been written.
  void end_statement(std::size_t i);

  /// Ends the line and begins the one for what stands at `begin`: comments between, and one blank line if there was
  /// any. `last` is the statement that the line ends; `closing`: nothing is begun.
  void next_line(std::uint32_t begin, bool first, bool closing = false, std::size_t last = kNoStatement);

  const Tree& tree_;
  std::string_view text_;
  std::string out_;
  std::vector<FormattedStatement> statements_;
  int indent_ = 0;
  int brackets_ = 0;  ///< open ( and [ since the last {: a line may end anywhere inside
  int flat_ = 0;      ///< > 0: on one line, or not at all
  bool over_ = false;
  std::uint32_t last_end_ = 0;  ///< in the source, of what was written last

 private:
  void trim();
  [[nodiscard]] std::string_view comment_text(const Comment& c) const;
  void put_trailing(std::string_view text, int indent);
  void start_line(std::uint32_t begin, bool first);

  std::size_t line_begin_ = 0;
  bool comment_ends_line_ = false;
  std::size_t comment_ = 0;  // the next one
  std::vector<const Comment*> pending_;
};

}  // namespace nms::lang
