#pragma once

#include <vector>

#include <glm/vec3.hpp>

#include <nms/runtime/face.h>

namespace nms::runtime {

/// Where the skin's vertices are at rest, T x + offsets in double precision. V places in the face's coordinates [m]
[[nodiscard]] std::vector<glm::dvec3> places_at_rest(const Skin& skin);

}  // namespace nms::runtime
