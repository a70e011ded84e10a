#pragma once

#include <string>
#include <vector>

#include <nms/runtime/face.h>

#include "sphere_fit.h"

namespace nms::runtime {

/// A ball with iris and pupil looking forward, in place of one that has no look of its own. Its materials are added to
/// `materials` where they are not there yet.
[[nodiscard]] RigidMesh make_eyeball(const Sphere& sphere, const std::string& name, Frame frame,
                                     std::vector<Material>& materials);

}  // namespace nms::runtime
