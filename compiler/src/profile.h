#pragma once

#include <optional>

#include "curve.h"
#include "placement.h"

namespace nms::compiler {

/// The profile among the options or properties of `parent`, as factors over time; nothing where there is none or it is
/// wrong, which has been reported.
/// @param span     what `start` and `end` mean; no point lies outside it
/// @param context  where signs are looked up
[[nodiscard]] std::optional<Curve> read_profile(lang::NodeRef parent, const Span& span, const PlacementContext& context,
                                                const Scope& scope, Evaluator& evaluator);

/// A curve times a profile, with a knot at every point of the profile that lies in the curve's time; exact where either
/// is level, else fitted.
[[nodiscard]] Curve profiled(const Curve& curve, const Curve& profile);

}  // namespace nms::compiler
