#pragma once

#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include <nms/compiler/explain.h>

#include "merge.h"

namespace nms::compiler {

/// Writes down what merging says it does to each channel of a clip, as it is at one time.
class ExplanationRecorder : public MergeObserver {
 public:
  /// @pre clip and channels outlive the recorder
  ExplanationRecorder(const ClipDraft& clip, const Channels& channels, std::int64_t time_ns)
      : clip_(clip), channels_(channels), time_ns_(time_ns) {}

  void channel(std::uint32_t channel, const std::vector<const Contribution*>& all) override;
  void repeated(const Contribution& left_out) override;
  void let_go(const Contribution& held, const Contribution& going, const Contribution& by) override;
  void joined(const Contribution& pose, const Contribution& joint) override;
  void group(const std::vector<const Contribution*>& of, bool stated, program::MergeOperator op, bool sum,
             const Curve& merged) override;
  void scaled(Layer layer, const Curve& taken, const Curve& merged) override;
  void layers(Layer layer, const Curve* envelope, const Curve& merged) override;
  void replaced(const Curve& envelope, const Curve& merged) override;
  void hidden(const Curve& taken, const Curve& merged) override;

  [[nodiscard]] std::vector<ChannelExplanation> take() { return std::move(explained_); }

 private:
  [[nodiscard]] Cause cause(const Contribution& c) const;
  [[nodiscard]] ChannelExplanation& current() { return explained_.back(); }

  const ClipDraft& clip_;
  const Channels& channels_;
  std::int64_t time_ns_;
  std::vector<ChannelExplanation> explained_;
  std::map<const Contribution*, std::size_t> index_;  ///< of contributions, and of those made of them, into causes
  double below_ = 0.0;                                ///< the layers so far
  double group_ = 0.0;                                ///< the layer, or what is stated, that was merged last
  bool first_ = true;
};

}  // namespace nms::compiler
