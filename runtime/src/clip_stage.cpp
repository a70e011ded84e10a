#include "clip_stage.h"

#include <nms/runtime/face_file.h>

namespace nms::runtime {

ClipStage::ClipStage(const Face& face_of, const Rig& rig_of, const program::Program& program_of)
    : face(face_of),
      rig(rig_of),
      program(program_of),
      landmarks(landmarks_of(face_of, program_of)),
      pose(make_pose(face_of, rig_of)),
      values(rig_of.channel_count(), 0.0F) {}

void ClipStage::evaluate(const program::Clip& clip, std::int64_t time_ns) {
  auto found = clips_.find(&clip);
  if (found == clips_.end()) found = clips_.emplace(&clip, &bound_.emplace_back(program, clip)).first;
  std::fill(values.begin(), values.end(), 0.0F);
  found->second->evaluate(time_ns, values);
}

void ClipStage::pose_values() {
  if (posed_ == values) return;
  pose_face(face, rig, values, pose);
  posed_ = values;
}

void ClipStage::evaluate_motions(const program::Clip& clip, std::int64_t time_ns) {
  evaluate(clip, time_ns);
  forget_pose();
  contractions(rig, values, pose.contractions);
  move_frames(rig, values, pose.contractions, pose);
}

void ClipStage::pose_alone(std::uint32_t channel, float value) {
  std::fill(values.begin(), values.end(), 0.0F);
  values[channel] = value;
  pose_values();
  values[channel] = 0.0F;
}

}  // namespace nms::runtime
