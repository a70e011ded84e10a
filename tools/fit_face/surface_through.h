#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include <glm/vec3.hpp>

#include <nms/runtime/face_x3d.h>

namespace nms::fit_face {

/// A place in space [mm] for every (u, v) from 0 to 1.
using Shape = std::function<glm::dvec3(double u, double v)>;

/// The bicubic surface that goes through `shape` at its Greville points: as many places as it has control points.
runtime::FaceFileSurface surface_through(const std::string& name, std::size_t spans_u, std::size_t spans_v,
                                         const Shape& shape);

}  // namespace nms::fit_face
