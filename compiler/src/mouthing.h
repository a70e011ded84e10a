#pragma once

#include <vector>

#include "movement.h"

namespace nms::compiler {

/// A viseme in a word: what it wants of the mouth, and how strongly.
struct Viseme {
  Pose pose;                     ///< what it states; the rest it leaves to its neighbours
  double dominance = 1.0;        ///< at its middle, above 0
  std::int64_t reach_ns = 1;     ///< over which its dominance falls to 1/e, to either side; above 0
  std::int64_t duration_ns = 0;  ///< above 0
};

/// Of its dominance, what a viseme has on a channel that its pose does not state; it wants rest there. An engineering
/// default: enough that a vowel lets go of lips that were shut, little enough that it rounds a consonant beside it.
inline constexpr double kFaintDominance = 0.3;

/// Steps to the middle of each viseme, and from there to its end, blended by dominance functions (Cohen & Massaro
/// 1993):
///
///   value(t) = sum D_i(t) T_i / sum D_i(t),   D_i(t) = dominance_i exp(-|t - middle_i| / reach_i)
///
/// where T_i is what viseme i wants of the channel. So a vowel rounds the consonants before it, and lips that must shut
/// do shut. Values are exact at the steps' ends; between them they go as steps go. No value lies outside those wanted.
[[nodiscard]] std::vector<Step> blend_visemes(const std::vector<Viseme>& visemes);

}  // namespace nms::compiler
