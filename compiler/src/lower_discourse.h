#pragma once

#include <memory>
#include <optional>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "lower_utterance.h"
#include "places.h"

namespace nms::compiler {

/// A discourse that has yet to be merged: the signer's clip, and one for each other participant, on the same clock.
struct DiscourseDraft {
  ClipDraft clip;
  ManualTier tier;  ///< the signs of all its utterances, and the utterances themselves
  Span whole;
  std::vector<ClipDraft> participants;
};

/// The discourses of one compilation: what their places are, and what they play.
class Discourses {
 public:
  explicit Discourses(Evaluator& evaluator);

  /// Plays its utterances one after the other: each begins with its first sign, a pause after the last sign of the one
  /// before. Nothing: it has errors, which have been reported.
  [[nodiscard]] std::optional<DiscourseDraft> lower(const Declaration& discourse);

  /// The places that an utterance knows that is played by itself: those of the first discourse that it is part of.
  [[nodiscard]] const Places* places_of(const Declaration& utterance);

 private:
  [[nodiscard]] const Places& places_in(const Declaration& discourse);

  Evaluator& evaluator_;
  std::unordered_map<const Declaration*, const Declaration*> part_of_;
  std::unordered_map<const Declaration*, std::unique_ptr<Places>> places_;
  std::size_t spent_ = 0;  ///< signs and contributions of all utterances played so far
};

}  // namespace nms::compiler
