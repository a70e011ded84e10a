#pragma once

#include <optional>

#include "schedule.h"

namespace nms::compiler {

/// Each turns one declaration into a clip that has yet to be merged. Nothing: it has errors, which have been reported.
[[nodiscard]] std::optional<ClipDraft> lower_expression(const Declaration& d, Evaluator& evaluator);
[[nodiscard]] std::optional<ClipDraft> lower_timeline(const Declaration& d, Evaluator& evaluator);
[[nodiscard]] std::optional<ClipDraft> lower_utterance(const Declaration& d, Evaluator& evaluator);
/// An entry played alone, over a carrier of measured length, without signs.
[[nodiscard]] std::optional<ClipDraft> lower_entry(const Declaration& d, Evaluator& evaluator);

}  // namespace nms::compiler
