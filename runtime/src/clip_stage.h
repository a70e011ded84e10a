#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <span>
#include <vector>

#include <nms/program/play.h>
#include <nms/program/program.h>
#include <nms/runtime/face.h>
#include <nms/runtime/face_scale.h>
#include <nms/runtime/rig.h>

#include "animation_keys.h"

namespace nms::runtime {

/// A face on which clips are played: what a file of them is compared with.
class ClipStage {
 public:
  ClipStage(const Face& face, const Rig& rig, const program::Program& program);

  /// Values of every channel; what the clip does not touch is at rest.
  void evaluate(const program::Clip& clip, std::int64_t time_ns);
  /// The frames' movements too.
  void evaluate_motions(const program::Clip& clip, std::int64_t time_ns);
  /// One channel alone, the others at rest. The surface is posed.
  void pose_alone(std::uint32_t channel, float value);
  /// The surface of the values last evaluated.
  void pose_values();
  /// The pose has been changed by hand.
  void forget_pose() { posed_.clear(); }

  const Face& face;
  const Rig& rig;
  const program::Program& program;
  const Landmarks landmarks;
  Pose pose;
  std::vector<float> values;  ///< one for each channel

 private:
  std::deque<program::BoundClip> bound_;
  std::map<const program::Clip*, const program::BoundClip*> clips_;
  std::vector<float> posed_;  // the values of the pose; none: not known
};

/// A moment of a clip at least every 120th of a second, and wherever a curve may bend; ascending.
template <typename Visit>
void visit_moments(const program::Program& program, const program::Clip& clip, Visit visit) {
  constexpr std::int64_t kStep_ns = 8'333'333;
  const std::vector<std::int64_t> breaks = break_times(program, clip);
  for (std::size_t i = 0; i < breaks.size(); ++i) {
    const std::int64_t end = i + 1 < breaks.size() ? breaks[i + 1] : breaks[i] + 1;
    const std::int64_t steps = std::max<std::int64_t>(1, (end - breaks[i] + kStep_ns - 1) / kStep_ns);
    for (std::int64_t k = 0; k < steps; ++k) visit(breaks[i] + (end - breaks[i]) * k / steps);
  }
}

}  // namespace nms::runtime
