#pragma once

#include <functional>
#include <map>
#include <string>

#include <glm/vec3.hpp>

namespace nms::runtime {

/// Places on a face by name: "nose_tip", "brow_inner_L".  [m]
using Landmarks = std::map<std::string, glm::dvec3, std::less<>>;

/// How large a face is against the one that muscles' lengths are written for (ada, an adult's mean): that one has 1
/// throughout.
struct FaceScale {
  glm::dvec3 axes{1.0};  ///< width, height, depth
  double length = 1.0;   ///< their geometric mean: what radii and gaps scale by
};

/// Width from the distance of the eyes' centres, height from the eyes to menton, depth from the jaw's hinge to the
/// lips. A face without hinge or lips is as deep as it is wide; one without eyes or menton counts as 1.
[[nodiscard]] FaceScale face_scale(const Landmarks& landmarks);

}  // namespace nms::runtime
