#pragma once

#include <optional>
#include <vector>

#include "lower_clip.h"

namespace nms::compiler {

/// An utterance that has yet to be merged, with its signs and the span that they take; without signs the span has no
/// end.
struct UtteranceDraft {
  ClipDraft clip;
  ManualTier tier;
  Span whole;
};
/// What a discourse says of an utterance in it.
struct UtteranceSetting {
  const Places* places = nullptr;  ///< outlive the call
  bool in_discourse = false;       ///< which says itself what faces do by themselves
  // Of `rs(ROLE)[ UTTERANCE ] { ... }`:
  lang::NodeRef role_shift;
  const Declaration* role_shift_entry = nullptr;
  double speaker_yaw_deg = 0.0;    ///< where the quoted one is
  double addressee_yaw_deg = 0.0;  ///< whom the quoted one speaks to
};
[[nodiscard]] std::optional<UtteranceDraft> lower_utterance(const Declaration& d, Evaluator& evaluator,
                                                            const UtteranceSetting& setting = {});

/// What another participant does in a discourse: the placements of its `by` blocks, on the discourse's clock.
[[nodiscard]] std::optional<ClipDraft> lower_participant(const Declaration& discourse,
                                                         const std::vector<lang::NodeRef>& blocks,
                                                         const ManualTier& tier, const Span& whole,
                                                         const Places& places, Evaluator& evaluator);

}  // namespace nms::compiler
