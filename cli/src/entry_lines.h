#pragma once

#include <string>

#include <nms/lang/tree.h>

namespace nms::cli {

/// A line for each entry that a file declares, in its order: lexicon, name, function, evidence, ids, labels, meaning,
/// between tabs; ids and labels with a blank between them. What an entry does not state is empty.
[[nodiscard]] std::string entry_lines(const lang::Tree& tree);

}  // namespace nms::cli
