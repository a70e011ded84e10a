#pragma once

#include <cstdint>
#include <vector>

#include "schedule.h"

namespace nms::compiler {

/// One channel's final curve in a clip.
struct MergedCurve {
  std::uint32_t channel = 0;
  Curve curve;
};

/// Merges all contributions of a clip, channel by channel:
///  0. what is held goes where another comes, and poses of one layer that follow each other are joined from apex to
///     apex (coarticulation.h);
///  1. within a layer by the track's operator: strongest is the maximum; sum adds (axes always add); latest lets the
///     later to start take the place of the earlier, as far as its envelope says;
///  2. between layers, action units by v = 1 - prod(1 - v_i), axes by addition;
///  3. what the utterance states takes the place of all that, as far as its envelope says;
///  4. held within [0, 1], axes within [-1, 1].
/// Every operator is monotone in each cause, and bounded. Ordered by channel.
[[nodiscard]] std::vector<MergedCurve> merge(const ClipDraft& clip, const Channels& channels);

}  // namespace nms::compiler
