#pragma once

#include <vector>

#include <nms/picture/render.h>
#include <nms/runtime/face.h>
#include <nms/runtime/rig.h>

namespace nms::cli {

/// A posed face as meshes to draw, one for each material of the skin and of each rigid part, all in place.
[[nodiscard]] std::vector<picture::Mesh> face_meshes(const runtime::Face& face, const runtime::Rig& rig,
                                                     const runtime::Pose& pose);

/// A camera that shows the head of the face at rest, with some room for its movements.
[[nodiscard]] picture::Camera head_camera(const runtime::Face& face, const runtime::Rig& rig, const runtime::Pose& rest,
                                          double aspect);

/// How high the picture of that camera must be to hold the head of a pose, which a lean or a shift of the torso may take
/// far from its place at rest; no less than it is. [m]
[[nodiscard]] float height_to_hold(const picture::Camera& camera, const runtime::Pose& pose, double aspect);

}  // namespace nms::cli
