#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "movement.h"

namespace nms::compiler {

/// What an author calls a component: the name in its sum that says most.
[[nodiscard]] std::string_view component_name(lang::NodeRef sum);

/// What does not play in one use of an entry: `optional` components that the use does without, and the alternatives of
/// each `one of` that it did not choose.
class Choices {
 public:
  /// Where nothing is said every `optional` component plays, and of each `one of` the first alternative.
  /// @param options   of the use, `{ optional none  choose puff }`; may not exist. What is wrong in them is reported.
  /// @param optional  whether optional components play where the use says nothing: the utterance's word
  [[nodiscard]] static Choices of_use(const Declaration& entry, lang::NodeRef options, bool optional,
                                      const Scope& scope, Evaluator& evaluator);

  /// Whether the entry's use does without this item.
  [[nodiscard]] bool leaves_out(lang::NodeRef item) const;

 private:
  std::vector<std::uint32_t> left_out_;  ///< indices of nodes, rising
};

/// Whether `optional all` or `optional none` is written; nothing said or nothing sensible: `otherwise`.
[[nodiscard]] bool optional_plays(lang::NodeRef property, bool otherwise, const Scope& scope, Evaluator& evaluator);

}  // namespace nms::compiler
