#pragma once

#include <optional>
#include <vector>

#include <glm/vec3.hpp>

#include <nms/runtime/tessellate.h>

#include "model.h"
#include "triangle_tree.h"

namespace nms::fit_face {

/// A place on the skin with its outward normal. [mm]
struct SkinPlace {
  glm::dvec3 point{0.0};
  glm::dvec3 normal{0.0};
};

/// The fitted half's skin (no lips, lids' backs, ears) as triangles: what shells are laid on. [mm]
class SkinMesh {
 public:
  explicit SkinMesh(const Model& model);

  enum class Hit { first, last };
  std::optional<SkinPlace> cast(const glm::dvec3& from, const glm::dvec3& direction, Hit which) const;
  const std::vector<glm::dvec3>& vertices() const { return vertices_; }

 private:
  std::vector<glm::dvec3> vertices_;
  std::vector<glm::dvec3> normals_;
  std::vector<Triangle> triangles_;
};

/// Samples per span, as the layout asks.
std::vector<runtime::SurfaceSamples> samples(const Layout& layout);

}  // namespace nms::fit_face
