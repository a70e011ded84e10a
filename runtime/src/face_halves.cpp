#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "face_scene.h"

namespace nms::runtime {
namespace {

glm::dvec3 mirror(const glm::dvec3& p) { return {p.x == 0.0 ? 0.0 : -p.x, p.y, p.z}; }

std::vector<glm::dvec3> mirrored_points(const std::vector<glm::dvec3>& points) {
  std::vector<glm::dvec3> out;
  for (const glm::dvec3& p : points) out.push_back(mirror(p));
  return out;
}

/// Of a grid, u fastest: each row the other way round.
template <typename T>
std::vector<T> rows_reversed(const std::vector<T>& grid, std::size_t count_u) {
  std::vector<T> out = grid;
  for (std::size_t at = 0; at + count_u <= out.size(); at += count_u) {
    const auto row = out.begin() + static_cast<std::ptrdiff_t>(at);
    std::reverse(row, row + static_cast<std::ptrdiff_t>(count_u));
  }
  return out;
}

bool on_midline(const std::vector<glm::dvec3>& points) {
  return std::all_of(points.begin(), points.end(), [](const glm::dvec3& p) { return p.x == 0.0; });
}

std::string other_name(const std::string& name) {
  const std::string other = mirrored_name(name);
  return other == name ? name + "_mirrored" : other;
}

std::map<std::string, std::vector<float>> other_regions(const std::map<std::string, std::vector<float>>& regions) {
  std::map<std::string, std::vector<float>> out;
  for (const auto& [name, weights] : regions) out[mirrored_name(name)] = weights;
  return out;
}

/// Adds the mirror images to a file. What lies on the midline stands there once and belongs to both halves.
class Halves {
 public:
  explicit Halves(FaceFile& file)
      : file_(file),
        nodes_(file.nodes.size(), kNoIndex),
        curves_(file.curves.size(), kNoIndex),
        node_places_(file.nodes.size(), glm::dvec3(0.0)) {
    for (const FaceFileCurve& c : file.curves) {
      if (c.curve.ends[0].node != kNoIndex) node_places_[c.curve.ends[0].node] = c.points.front();
      if (c.curve.ends[1].node != kNoIndex) node_places_[c.curve.ends[1].node] = c.points.back();
    }
  }

  /// The image's u runs the other way: its outside is outside again.
  void add_surface(std::size_t index) {
    FaceFileSurface image = file_.surfaces[index];
    NetSurface& g = image.geometry;
    const std::size_t count_u = g.count_u();
    image.mirrored = false;
    image.part = mirrored_name(image.part);
    image.frame = mirrored_name(image.frame);
    image.points = rows_reversed(mirrored_points(image.points), count_u);
    image.tint = rows_reversed(image.tint, count_u);
    image.regions = other_regions(image.regions);
    for (auto& [name, weights] : image.regions) weights = rows_reversed(weights, count_u);
    g.name = other_name(g.name);
    g.weights = rows_reversed(g.weights, count_u);
    const double ends = g.knots_u.front() + g.knots_u.back();
    std::reverse(g.knots_u.begin(), g.knots_u.end());
    for (double& k : g.knots_u) k = ends - k;
    if (g.sides) {
      const auto image_of = [&](const SurfaceSide& side) { return SurfaceSide{curve(side.curve), side.to, side.from}; };
      const std::array<SurfaceSide, 4> s = *g.sides;
      g.sides = {image_of(s[0]), image_of(s[3]), image_of(s[2]), image_of(s[1])};
    }
    file_.surfaces.push_back(std::move(image));
  }

 private:
  std::uint32_t node(std::uint32_t index) {
    if (nodes_[index] == kNoIndex) {
      nodes_[index] = index;
      if (node_places_[index].x != 0.0) {
        nodes_[index] = static_cast<std::uint32_t>(file_.nodes.size());
        file_.nodes.push_back(other_name(file_.nodes[index]));
      }
    }
    return nodes_[index];
  }

  // Cycles and curves that are not there are build_seams()'s to refuse.
  std::uint32_t curve(std::uint32_t index) {
    if (index >= curves_.size()) return index;
    if (curves_[index] != kNoIndex) return curves_[index];
    curves_[index] = index;
    if (on_midline(file_.curves[index].points)) {
      auto& regions = file_.curves[index].regions;
      for (const auto& [name, weights] : other_regions(regions)) regions.emplace(name, weights);
      return index;
    }
    FaceFileCurve image = file_.curves[index];
    image.curve.name = other_name(image.curve.name);
    image.points = mirrored_points(image.points);
    image.regions = other_regions(image.regions);
    for (CurveEnd& end : image.curve.ends) {
      if (end.node != kNoIndex) end.node = node(end.node);
      if (end.curve != kNoIndex) end.curve = curve(end.curve);
    }
    curves_[index] = static_cast<std::uint32_t>(file_.curves.size());
    file_.curves.push_back(std::move(image));
    return curves_[index];
  }

  FaceFile& file_;
  std::vector<std::uint32_t> nodes_;   // the image of each
  std::vector<std::uint32_t> curves_;  // the same
  std::vector<glm::dvec3> node_places_;
};

bool is_mirror(const glm::dmat4& m) {
  glm::dmat4 expected(1.0);
  expected[0][0] = -1.0;
  return m == expected;
}

}  // namespace

bool write_out_halves(FaceScene& scene) {
  const auto plain = [&](const glm::dmat4& m) { return m == glm::dmat4(1.0) || is_mirror(m); };
  if (!std::all_of(scene.transforms.begin(), scene.transforms.end(), plain)) return false;
  Halves halves(scene.file);
  std::vector<SurfaceUse> uses;
  for (const SurfaceUse& use : scene.uses) {
    if (!is_mirror(scene.transforms[use.transform])) {
      uses.push_back({use.surface, 0});
      continue;
    }
    halves.add_surface(use.surface);
    uses.push_back({scene.file.surfaces.size() - 1, 0});
  }
  scene.transforms = {glm::dmat4(1.0)};
  scene.uses = std::move(uses);
  return true;
}

}  // namespace nms::runtime
