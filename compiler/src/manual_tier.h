#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "movement.h"

namespace nms::compiler {

/// One sign with its times. `end_ns` includes the hold, `stroke_end_ns` does not.
struct Sign {
  std::string_view gloss;
  std::string_view tag;
  std::string_view alias;
  std::int64_t start_ns = 0;
  std::int64_t stroke_end_ns = 0;
  std::int64_t end_ns = 0;
  bool non_dominant = false;
  bool timed = false;        ///< by the source or from outside; else its times are measured ones
  std::uint32_t cycles = 1;  ///< of its movement: one more for each `+` at the gloss's end, or what its tag counts
  lang::NodeRef node;
};

/// A gloss without the `+` at its end: WORK of WORK+++.
[[nodiscard]] std::string_view stem(std::string_view gloss);

/// Whether a sign has that tag or gloss, a `+` at the gloss's end aside.
[[nodiscard]] bool is_called(const Sign& sign, std::string_view tag_or_gloss);

/// Most cycles that one sign may have.
inline constexpr std::uint32_t kMaxSignCycles = 100;

/// A labelled bracket over signs [first, last].
struct Bracket {
  std::string_view label;
  std::uint32_t first = 0;
  std::uint32_t last = 0;
  bool empty = true;
  lang::NodeRef node;
};

/// The manual tier of an utterance: signs of the signing hand in order of time, then those of the other hand.
struct ManualTier {
  std::vector<Sign> signs;
  std::uint32_t dominant_count = 0;  ///< signs [0, dominant_count) are the signing hand's
  std::vector<Bracket> brackets;     ///< outer before inner, in order
  std::vector<Sign> utterances;      ///< of a discourse: each as one span under its name

  [[nodiscard]] bool empty() const { return signs.empty(); }
  /// The signs that the utterance is made of are [0, main_count): the signing hand's, or the other's if it signs alone.
  [[nodiscard]] std::uint32_t main_count() const {
    return dominant_count != 0 ? dominant_count : static_cast<std::uint32_t>(signs.size());
  }
};

/// Reads the `signs { }` blocks. What a table of times says of a sign takes the place of what the source says. Signs
/// without times get measured lengths and gaps: 233 ms a sign, 100 ms a gap, 400 ms the last sign (NCSLGR medians);
/// between signs that have times they shrink in proportion, where there is less room.
[[nodiscard]] ManualTier build_manual_tier(lang::NodeRef utterance, const Scope& scope, Evaluator& evaluator);

}  // namespace nms::compiler
