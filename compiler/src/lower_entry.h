#pragma once

#include <optional>
#include <string_view>

#include "schedule.h"

namespace nms::compiler {

/// The word after `spreads`, or nothing.
[[nodiscard]] std::string_view spreading_of(const Declaration& entry);

/// Schedules all components of an entry over a span. `scope` is the entry's own, arguments bound.
/// @param used  its name or bracket in an utterance, for messages; none where it is played alone
void schedule_entry(ClipDraft& clip, const Declaration& entry, const Scope& scope, const Span& span, const Timing& use,
                    double intensity, const ManualTier* tier, Evaluator& evaluator, lang::NodeRef used = {});

/// Whether the condition of a `when` or `unless` is met. Nothing: it is wrong or unclear, which has been reported.
/// @param context  its `whole` is what `in span` means; without signs no sign is in anything
[[nodiscard]] std::optional<bool> holds(lang::NodeRef when, const PlacementContext& context, const Scope& scope,
                                        Evaluator& evaluator);

/// Schedules one `placement` node whose sum is a movement: a component of an entry, of a timeline or of an utterance.
/// @param base  span, timing, layer and names that hold where the placement says nothing
void schedule_component(ClipDraft& clip, lang::NodeRef placement, Placed base, double intensity, const Scope& scope,
                        const PlacementContext& context, Evaluator& evaluator);

}  // namespace nms::compiler
