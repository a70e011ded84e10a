#include "skin_mesh.h"

#include <cmath>
#include <string>

#include <glm/geometric.hpp>

namespace nms::fit_face {

SkinMesh::SkinMesh(const Model& m) {
  const runtime::NetMesh mesh = runtime::tessellate(m.net, m.seams, samples(m.layout), m.x);
  for (const runtime::Row& row : mesh.vertices) vertices_.push_back(m.at(row) * kMillimetres);
  normals_.assign(vertices_.size(), glm::dvec3(0.0));
  for (std::size_t s = 0; s < mesh.triangles.size(); ++s) {
    const std::vector<std::uint32_t>& corners = mesh.triangles[s];
    for (std::size_t i = 0; i + 2 < corners.size(); i += 3) {
      const Triangle t{corners[i], corners[i + 1], corners[i + 2]};
      const glm::dvec3 area = glm::cross(vertices_[t[1]] - vertices_[t[0]], vertices_[t[2]] - vertices_[t[0]]);
      for (const auto v : t) normals_[v] += area;
      if (m.layout.surfaces[s].part == "skin") triangles_.push_back(t);
    }
  }
  for (auto& n : normals_) {
    if (glm::length(n) > 0) n = glm::normalize(n);
  }
}

// Moeller and Trumbore (1997), over all triangles: a few thousand rays.
std::optional<SkinPlace> SkinMesh::cast(const glm::dvec3& from, const glm::dvec3& direction, Hit which) const {
  constexpr double kParallel = 1e-12;
  constexpr double kRim = 1e-6;  // a ray along an edge hits one of its triangles
  double best = -1;
  SkinPlace hit;
  for (const Triangle& t : triangles_) {
    const glm::dvec3 a = vertices_[t[0]];
    const glm::dvec3 e1 = vertices_[t[1]] - a;
    const glm::dvec3 e2 = vertices_[t[2]] - a;
    const glm::dvec3 p = glm::cross(direction, e2);
    const double det = glm::dot(e1, p);
    if (std::abs(det) < kParallel) continue;
    const glm::dvec3 s = from - a;
    const double u = glm::dot(s, p) / det;
    if (u < -kRim || u > 1 + kRim) continue;
    const glm::dvec3 q = glm::cross(s, e1);
    const double w = glm::dot(direction, q) / det;
    if (w < -kRim || u + w > 1 + kRim) continue;
    const double x = glm::dot(e2, q) / det;
    if (x < 0 || !(best < 0 || (which == Hit::last ? x > best : x < best))) continue;
    best = x;
    hit.point = from + direction * x;
    hit.normal = glm::normalize(normals_[t[0]] * (1 - u - w) + normals_[t[1]] * u + normals_[t[2]] * w);
  }
  if (best < 0) return std::nullopt;
  return hit;
}

std::vector<runtime::SurfaceSamples> samples(const Layout& layout) {
  std::vector<runtime::SurfaceSamples> out;
  for (const LayoutSurface& s : layout.surfaces) out.push_back({s.samples_u, s.samples_v});
  return out;
}

}  // namespace nms::fit_face
