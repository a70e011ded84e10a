#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "manual_tier.h"

namespace nms::compiler {

/// A stretch of time, and the signs of the signing hand that lie in it (none for bare times).
struct Span {
  std::int64_t start_ns = 0;
  std::int64_t end_ns = 0;
  std::uint32_t first_sign = kUnreachable;
  std::uint32_t last_sign = kUnreachable;

  [[nodiscard]] bool has_signs() const { return first_sign != kUnreachable; }
};

/// Where things can be placed: signs, and the span that `start`, `end`, `first sign` speak of.
struct PlacementContext {
  const ManualTier* tier = nullptr;  ///< null in a timeline
  Span whole;                        ///< the entry's span, the utterance, or the timeline
  bool entry = false;                ///< without signs the entry's span stands for its only one
};

/// Resolves `X over SPAN` and `X at POINT [for TIME]`. One grammar, one meaning, wherever it stands.
class Placer {
 public:
  Placer(Evaluator& evaluator, const Scope& scope, const PlacementContext& context)
      : evaluator_(evaluator), scope_(scope), context_(context) {}

  /// Nothing: an error, which has been reported.
  [[nodiscard]] std::optional<Span> over(lang::NodeRef over);
  [[nodiscard]] std::optional<std::int64_t> point(lang::NodeRef point);
  /// The sign that a gloss or an alias means.
  [[nodiscard]] std::optional<std::uint32_t> sign(lang::NodeRef name);
  /// The sign, or in a discourse the utterance, of that name.
  [[nodiscard]] const Sign* named(lang::NodeRef name);

 private:
  enum class End : std::uint8_t { start, end };
  struct Place {
    std::int64_t time_ns = 0;
    std::uint32_t sign = kUnreachable;
  };
  [[nodiscard]] std::optional<Place> span_end(lang::NodeRef node, End which);
  [[nodiscard]] std::optional<Span> own_span(lang::NodeRef span_end);
  [[nodiscard]] bool signed_here(std::string_view gloss) const;
  /// `start` or `end` of what surrounds the placement. Nothing: nobody has said where that ends.
  [[nodiscard]] std::optional<std::int64_t> edge(lang::NodeRef at, bool start);
  [[nodiscard]] std::optional<std::uint32_t> tagged(std::string_view tag) const;

  Evaluator& evaluator_;
  const Scope& scope_;
  const PlacementContext& context_;
};

}  // namespace nms::compiler
