#pragma once

#include <nms/lang/diagnostic.h>

#include "declarations.h"

namespace nms::compiler {

/// Joins lexicons with those they extend and include from, leaves out what they remove, and indexes labels.
///
/// After it every lexicon has its names and labels, no lexicon is made of itself, and no chain of `extends` is longer
/// than 100. Reports what is missing, what is made of itself, and labels that entries of a root's lexicon share.
void link_lexicons(Declarations& all, const std::vector<LoadedFile>& files, lang::Diagnostics& diagnostics);

/// The name behind `from` in `include mm, th from asl`.
[[nodiscard]] lang::NodeRef included_from(lang::NodeRef include);

}  // namespace nms::compiler
