#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "lower_entry.h"

namespace nms::compiler {

/// Each turns one declaration into a clip that has yet to be merged. Nothing: it has errors, which have been reported.
[[nodiscard]] std::optional<ClipDraft> lower_expression(const Declaration& d, Evaluator& evaluator);
[[nodiscard]] std::optional<ClipDraft> lower_timeline(const Declaration& d, Evaluator& evaluator);
[[nodiscard]] std::optional<ClipDraft> lower_timeline(const Declaration& d, const Scope& scope, Evaluator& evaluator);

/// The lexicon that an utterance or a discourse names with `in`, or kUnreachable. Nothing: there is no such lexicon,
/// which has been reported.
[[nodiscard]] std::optional<std::uint32_t> lexicon_in(const Declaration& d, const Scope& scope, Evaluator& evaluator);

/// A clip becomes as long as all that is in it.
void extend(ClipDraft& clip);
/// What gives way does; what competes is reported; the clip is as long as all that is in it.
void finish(ClipDraft& clip, const Scope& scope, Evaluator& evaluator);
/// Marks that a clip asks for stand in it as markers.
void mark_markers(ClipDraft& clip, const OutsideTimes::InClip& in);

/// An entry with the arguments of a use, and nothing else that the use says.
/// @param degree  what stands in front of it: slightly neg
/// @param call  its `argument` children are the use's; may not exist
[[nodiscard]] std::optional<EntryUse> bind_entry(const Declaration& e, lang::NodeRef call, const Scope& scope,
                                                 Evaluator& evaluator, double degree = 1.0);
/// The length of the carrier that an entry is played alone over.
[[nodiscard]] std::int64_t carrier_ns(const Declaration& entry);

/// An entry played alone, over a carrier of measured length, without signs.
[[nodiscard]] std::optional<ClipDraft> lower_entry(const Declaration& d, Evaluator& evaluator);
/// The same over a carrier of that length.
[[nodiscard]] std::optional<ClipDraft> lower_entry(const Declaration& d, const EntryUse& use, std::int64_t length_ns,
                                                   Evaluator& evaluator);

}  // namespace nms::compiler
