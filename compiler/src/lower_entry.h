#pragma once

#include <optional>
#include <string_view>

#include "choices.h"
#include "schedule.h"

namespace nms::compiler {

/// One use of an entry: what it says of it.
struct EntryUse {
  Scope scope;             ///< the entry's own, arguments bound
  double intensity = 1.0;  ///< scales all of it: every entry has an intensity, declared or not, neg(60%)
  Choices choices;
  Timing timing;       ///< phases and profile
  lang::NodeRef node;  ///< its name or bracket, for messages; none where the entry is played alone
};

/// The word after `spreads`, or nothing.
[[nodiscard]] std::string_view spreading_of(const Declaration& entry);

/// Schedules all components of an entry over a span.
void schedule_entry(ClipDraft& clip, const Declaration& entry, const EntryUse& use, const Span& span,
                    const ManualTier* tier, Evaluator& evaluator);

/// Whether the condition of a `when` or `unless` is met. Nothing: it is wrong or unclear, which has been reported.
/// @param context  its `whole` is what `in span` means; without signs no sign is in anything
/// @param scope  its arguments are what `when NAME` asks
[[nodiscard]] std::optional<bool> holds(lang::NodeRef when, const PlacementContext& context, const Scope& scope,
                                        Evaluator& evaluator);

/// Schedules one `placement` node whose sum is a movement: a component of an entry, of a timeline or of an utterance.
/// @param base  span, timing, layer and names that hold where the placement says nothing
void schedule_component(ClipDraft& clip, lang::NodeRef placement, Placed base, double intensity, const Scope& scope,
                        const PlacementContext& context, Evaluator& evaluator);

}  // namespace nms::compiler
