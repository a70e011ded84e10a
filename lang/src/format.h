#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <nms/lang/tree.h>

namespace nms::lang {

/// A statement that begins a line of canonical text, from the beginning of that line up to the end of its last one,
/// comments behind it on that line included.
struct FormattedStatement {
  NodeRef node;
  std::size_t begin = 0;  ///< in the canonical text
  std::size_t end = 0;
  std::size_t next = 0;  ///< index just past the last statement inside this one
};

struct FormattedText {
  std::string text;
  std::vector<FormattedStatement> statements;  ///< in pre-order
};

/// Canonical text, and where each statement stands in it.
/// @pre the tree has no errors
[[nodiscard]] FormattedText format_statements(const Tree& tree);

}  // namespace nms::lang
