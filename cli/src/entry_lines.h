#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include <nms/lang/tree.h>

namespace nms::cli {

/// The file that declares a lexicon of that name; null: there is none.
using FindLexicon = std::function<std::shared_ptr<const lang::Tree>(std::string_view name)>;

/// A line for each entry that a file's lexicons declare or include, in its order: lexicon, name, function, evidence,
/// ids, labels, meaning, between tabs; ids and labels with a blank between them. What an entry does not state is empty.
[[nodiscard]] std::string entry_lines(const lang::Tree& tree, const FindLexicon& find);

}  // namespace nms::cli
