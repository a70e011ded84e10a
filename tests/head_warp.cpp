#include "head_warp.h"

#include <cmath>

#include <glm/geometric.hpp>

#include <nms/runtime/face_file.h>
#include <nms/runtime/muscle.h>

#include "ada_fixture.h"

namespace nms::test {

glm::dvec3 Warp::operator()(const glm::dvec3& p) const {
  const double wave = std::cos(p.x / 0.075);
  return {scale.x * p.x * (1.0 + bend / 0.08 * std::sin(p.y / 0.07 + phase)),
          scale.y * p.y + bend * std::sin(p.y / 0.06 + 2.0 * phase) * wave,
          scale.z * p.z + bend * std::sin(p.y / 0.05 + 3.0 * phase) * wave};
}

Warp random_warp(std::mt19937& random) {
  const auto between = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random()) / 4294967296.0;
  };
  const double size = between(0.6, 1.7);
  Warp warp;
  warp.scale = size * glm::dvec3(between(0.88, 1.14), between(0.88, 1.14), between(0.9, 1.1));
  warp.bend = size * between(0.0, 0.0035);
  warp.phase = between(0.0, 6.28);
  return warp;
}

namespace {

// Lids fit their eyeball, which stays a ball: within the first of these distances from its centre all goes with it,
// beyond the second nothing does. [m]
constexpr double kWithEye = 0.018;
constexpr double kFreeOfEye = 0.045;

glm::dvec3 warped(const Warp& warp, double size, const runtime::Landmarks& marks, const glm::dvec3& p) {
  glm::dvec3 out = warp(p);
  for (const char* eye : {"eye_centre_L", "eye_centre_R"}) {
    const glm::dvec3 centre = marks.at(eye);
    const double with = runtime::smooth_fall((glm::distance(p, centre) - kWithEye) / (kFreeOfEye - kWithEye));
    out += with * (warp(centre) + size * (p - centre) - warp(p));
  }
  return out;
}

}  // namespace

runtime::Face warped_ada(const Warp& warp) {
  runtime::Face face = ada::face();
  const runtime::Landmarks marks = runtime::landmarks_of(ada::face(), ada::all_units().image.program());
  const double size = std::cbrt(warp.scale.x * warp.scale.y * warp.scale.z);
  const auto move = [&](const glm::dvec3& p) { return warped(warp, size, marks, p); };
  for (glm::dvec3& p : face.skin.points) p = move(p);
  for (glm::vec3& o : face.skin.offsets) o = glm::vec3(glm::dvec3(o) * size);
  for (runtime::RigidMesh& mesh : face.rigid)
    for (glm::vec3& p : mesh.positions) p = glm::vec3(move(glm::dvec3(p)));
  for (const auto& [name, p] : marks) face.landmarks[name] = move(p);
  return face;
}

}  // namespace nms::test
