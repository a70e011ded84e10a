#pragma once

#include <vector>

#include "schedule.h"

namespace nms::compiler {

/// `combine A with B { head from B }`, its names resolved.
struct CombineRule {
  const Declaration* yields = nullptr;  ///< A
  const Declaration* takes = nullptr;   ///< B
  std::uint32_t track = kUnreachable;   ///< head
  lang::NodeRef node;
};

/// Facts about pairs of entries: where uses of A and B meet, what A has on the track of `head from B` gives way to B,
///
///   a (1 - w),   w = max of the envelopes of what B has on that track,
///
/// so that B takes over as it comes and hands back as it goes. Over the onset of a pose of A, w is what it is at A's
/// apex, over its offset what it is at A's release: two that come and go together do not cross on the way. Where B has
/// nothing on the track, A stays. All envelopes
/// are those before any rule, so that the order of rules says nothing. w in [0, 1]: more of A is never less of A.
/// @returns false: it has become more knots than a clip may have, by the last of its givings
[[nodiscard]] bool combine(ClipDraft& clip, const std::vector<CombineRule>& rules, const Channels& channels);

/// The same by the rules of a lexicon, and reports what is too large.
/// @param lexicon  of the utterance: its own combinations, then those of the lexicons it extends; for one pair the
///                 nearest counts
void combine(ClipDraft& clip, std::uint32_t lexicon, const Scope& scope, Evaluator& evaluator);

/// Checks every `combine` of the roots' lexicons, met or not: its entries, tracks and rules.
void check_combinations(Evaluator& evaluator);

}  // namespace nms::compiler
