// Which way a bulge pushes: as the skin about it faces, not as each point's own sheet does. The lips' red and the
// mouth's lining turn back behind the skin; pushed along their own normals they would go against it, and the corner of
// the mouth would turn inside out. A bulge that leaves the lining out is no push from within but a swelling: along each
// normal.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <span>
#include <vector>

#include <glm/geometric.hpp>

#include <nms/runtime/muscle.h>

#include "rig_parts.h"

namespace nms::runtime {

namespace {

constexpr const char* kLiningRegion = "lining";
// Skin within this share of the bulge's smaller radius gives the direction.
constexpr double kReach = 0.25;
// Where there is none, twice as far is looked for, so often.
constexpr int kWidenings = 3;

// More skin about a bulge than this is taken together in cubes, so many to a reach: a head of 200,000 vertices would
// otherwise be looked at vertex by vertex for each of its own. On ada, who has less, the cubes change the furthest
// target by 0.14 mm of 11.6 mm.
constexpr std::size_t kManyVertices = 12'000;
constexpr double kCubesToReach = 5.0;

// The skin of each cube as one piece, in the middle of its vertices. The order is that of the cubes.
std::vector<RigParts::SkinNormal> in_cubes(std::span<const RigParts::SkinNormal> skin, double edge) {
  struct Cube {
    RigParts::SkinNormal sum;
    double vertices = 0.0;
  };
  std::map<std::array<double, 3>, Cube> cubes;
  for (const RigParts::SkinNormal& n : skin) {
    Cube& cube = cubes[{std::floor(n.place.x / edge), std::floor(n.place.y / edge), std::floor(n.place.z / edge)}];
    cube.sum.place += n.place;
    cube.sum.area += n.area;
    cube.vertices += 1.0;
  }
  std::vector<RigParts::SkinNormal> pieces;
  pieces.reserve(cubes.size());
  for (const auto& [at, cube] : cubes) pieces.push_back({cube.sum.place / cube.vertices, cube.sum.area, false});
  return pieces;
}

// Which way the skin within `reach` of p faces, the nearer the more. `skin` ascends in x.
glm::dvec3 faces_about(std::span<const RigParts::SkinNormal> skin, const glm::dvec3& p, double reach) {
  glm::dvec3 sum(0.0);
  const auto by_x = [](const RigParts::SkinNormal& a, double x) { return a.place.x < x; };
  for (auto n = std::lower_bound(skin.begin(), skin.end(), p.x - reach, by_x);
       n != skin.end() && n->place.x < p.x + reach; ++n) {
    const glm::dvec3 d = n->place - p;
    const double squared = dot(d, d);
    if (squared < reach * reach) sum += (1.0 - squared / (reach * reach)) * n->area;
  }
  return sum;
}

}  // namespace

// Of every vertex that is no lining: the triangles about it, by their areas.
std::vector<RigParts::SkinNormal> RigParts::outer_skin() const {
  const Skin& skin = face.skin;
  const SparseMatrix& t = skin.surface;
  const auto lining = face.regions.find(kLiningRegion);
  std::vector<SkinNormal> all(t.rows);
  for (std::uint32_t v = 0; v < t.rows; ++v) {
    all[v].place = glm::dvec3(skin.offsets[v]);
    for (std::uint32_t k = t.row_begin[v]; k < t.row_begin[v + 1]; ++k) {
      all[v].place += static_cast<double>(t.value[k]) * skin.points[t.column[k]];
      if (lining != face.regions.end() && lining->second[t.column[k]] > 0.0F) all[v].hidden = true;
    }
  }
  for (const Primitive& primitive : skin.primitives) {
    for (std::size_t i = 0; i + 2 < primitive.triangles.size(); i += 3) {
      SkinNormal* corners[3] = {&all[primitive.triangles[i]], &all[primitive.triangles[i + 1]],
                                &all[primitive.triangles[i + 2]]};
      const glm::dvec3 area = glm::cross(corners[1]->place - corners[0]->place, corners[2]->place - corners[0]->place);
      for (SkinNormal* corner : corners) corner->area += area;
    }
  }
  std::erase_if(all, [](const SkinNormal& n) { return n.hidden; });
  return all;
}

std::vector<glm::dvec3> RigParts::bulge_directions(const program::Muscle& muscle, const MusclePlaces& places,
                                                   std::span<const glm::dvec3> normals,
                                                   std::span<const SkinNormal> skin_normals) const {
  std::vector<glm::dvec3> directions(normals.begin(), normals.end());
  if (program.string(muscle.except) == kLiningRegion) return directions;
  const glm::dvec3 along = places.insertion - places.attachment;
  const double major =
      muscle.major_radius > 0.0F ? static_cast<double>(muscle.major_radius) : std::sqrt(dot(along, along));
  const double minor = muscle.minor_radius > 0.0F ? static_cast<double>(muscle.minor_radius) : major;
  const double widest = std::max(major, minor) + kReach * (1 << kWidenings) * minor;
  std::vector<SkinNormal> near;
  for (const SkinNormal& n : skin_normals) {
    const glm::dvec3 from = n.place - places.attachment;
    if (dot(from, from) < widest * widest) near.push_back(n);
  }
  if (near.size() > kManyVertices && minor > 0.0) near = in_cubes(near, kReach * minor / kCubesToReach);
  std::stable_sort(near.begin(), near.end(),
                   [](const SkinNormal& a, const SkinNormal& b) { return a.place.x < b.place.x; });
  for (std::size_t i = 0; i < directions.size(); ++i) {
    if (bulge_push(muscle, places, face.skin.points[i], normals[i]) == glm::dvec3(0.0)) continue;
    double reach = kReach * minor;
    for (int round = 0; round <= kWidenings; ++round, reach *= 2.0) {
      const glm::dvec3 sum = faces_about(near, face.skin.points[i], reach);
      const double length = std::sqrt(dot(sum, sum));
      if (length <= 0.0) continue;
      directions[i] = sum / length;
      break;
    }
  }
  return directions;
}

}  // namespace nms::runtime
