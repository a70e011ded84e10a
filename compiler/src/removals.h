#pragma once

#include <string>
#include <vector>

#include <nms/compiler/mutation.h>
#include <nms/lang/tree.h>

namespace nms::compiler {

/// A part that an entry can do without, and how the text is without it.
struct RemovablePart {
  Removal::Part part;
  lang::Range range;  ///< of the part
  lang::Range cut;    ///< of what goes: the part, and the sign or semicolon that joined it
  std::string instead;
};

/// Every part of an entry that may be taken out, in the order of the text. What is left always has an entry's shape,
/// though it may mean nothing.
[[nodiscard]] std::vector<RemovablePart> removable_parts(lang::NodeRef entry);

}  // namespace nms::compiler
