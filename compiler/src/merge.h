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

/// What merging does, told as it happens, channel by channel. It changes nothing: merging works the same whether
/// anybody listens or not. References are good for the time of the call.
class MergeObserver {
 public:
  MergeObserver() = default;
  MergeObserver(const MergeObserver&) = delete;
  MergeObserver& operator=(const MergeObserver&) = delete;
  virtual ~MergeObserver() = default;

  /// All contributions to a channel: those of its steps follow.
  virtual void channel(std::uint32_t channel, const std::vector<const Contribution*>& all) = 0;
  /// Left out: the same motion is asked for by another that outlasts it.
  virtual void repeated(const Contribution& left_out) = 0;
  /// What was held goes when another comes; `going` takes its place.
  virtual void let_go(const Contribution& held, const Contribution& going, const Contribution& by) = 0;
  /// Co-articulated: `pose` becomes a part of `joint`, which goes from apex to apex.
  virtual void joined(const Contribution& pose, const Contribution& joint) = 0;
  /// The contributions of one layer, or (`stated`) of the utterance itself, became `merged`, held within [low, 1].
  /// @param sum  they added: the operator says so, or the channel is an axis and the operator is not `latest`
  virtual void group(const std::vector<const Contribution*>& of, bool stated, program::MergeOperator op, bool sum,
                     const Curve& merged) = 0;
  /// What the layer had became `merged`, scaled by (1 - taken): another of its slot, antagonists above, or, from the
  /// ambient layer, language on its track took that.
  virtual void scaled(Layer layer, const Curve& taken, const Curve& merged) = 0;
  /// All layers up to `layer` became `merged`.
  /// @param envelope  under `highest`: how far the layer took the place of those below; else, or if there are none,
  /// null
  virtual void layers(Layer layer, const Curve* envelope, const Curve& merged) = 0;
  /// What is stated took the place of the layers as far as `envelope` says, and they became `merged`.
  virtual void replaced(const Curve& envelope, const Curve& merged) = 0;
  /// At last it became `merged`, scaled by (1 - taken): what hides it took that.
  virtual void hidden(const Curve& taken, const Curve& merged) { static_cast<void>(taken), static_cast<void>(merged); }
};

/// The strongest of several curves at every time.
[[nodiscard]] Curve strongest_of(std::vector<Curve> curves);

/// Merges all contributions of a clip.
///  0. Of each channel what is held goes where another comes, and poses of one layer that follow each other are joined
///     from apex to apex (coarticulation.h).
///  1. Within a layer by the track's operator: strongest is the maximum; sum adds (axes always add); latest lets the
///     later to start take the place of the earlier, as far as its envelope says.
///  2. Across channels: the ambient layer is left what language does not claim on its track; of layers that share a slot a later one is left what the earlier ones do not claim, and a
///  higher
///     layer scales the antagonists below it by (1 - its own value).
///  3. Between layers by the track's other operator: either is v = 1 - prod(1 - v_i), of axes the sum; highest lets the
///     higher take the place of the lower, as far as its envelope says.
///  4. What the utterance states takes the place of all that, as far as its envelope says.
///  5. Held within [0, 1], axes within [-1, 1]; what is hidden is scaled by (1 - what hides it).
/// Every operator is monotone in each cause of its own channel, and bounded. Ordered by channel.
[[nodiscard]] std::vector<MergedCurve> merge(const ClipDraft& clip, const Channels& channels,
                                             MergeObserver* observer = nullptr);

}  // namespace nms::compiler
