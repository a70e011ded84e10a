#include "measure.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>

#include "triangle_tree.h"

namespace nms::fit_face {

namespace {

// The scan's vertices of the face proper; what follows is the back of the head.
constexpr std::uint32_t kFaceVertices = 9409;
// Vertices on the midline are at 0, not a rounding error to the right of it.
constexpr double kMidline = -1e-9;

Distances summary(std::vector<double> all) {
  Distances d;
  d.count = all.size();
  if (all.empty()) return d;
  std::sort(all.begin(), all.end());
  for (const double x : all) d.mean += x;
  d.mean /= static_cast<double>(all.size());
  d.p99 = all[static_cast<std::size_t>(std::ceil(0.99 * static_cast<double>(all.size()))) - 1];
  d.max = all.back();
  return d;
}

using Edge = std::pair<std::uint32_t, std::uint32_t>;

Edge edge(std::uint32_t a, std::uint32_t b) { return std::minmax(a, b); }

// Curves behind which the face has nothing of the scan's: pockets, closed by parts or by rule.
constexpr std::array<const char*, 5> kPocketRims = {"Lu", "Ll", "margin", "ND", "EC"};

// The quads of the half x >= 0 that the face follows: all that hang together once the pockets' rims are cut.
std::vector<char> followed_quads(const Scan& scan, const Layout& layout) {
  std::set<Edge> rims;
  for (const LayoutCurve& c : layout.curves) {
    if (std::find(kPocketRims.begin(), kPocketRims.end(), c.name) == kPocketRims.end()) continue;
    for (std::size_t i = 0; i + 1 < c.vertices.size(); ++i) rims.insert(edge(c.vertices[i], c.vertices[i + 1]));
  }
  std::map<Edge, std::vector<std::uint32_t>> by_edge;
  std::vector<char> seen(scan.quads.size(), 0);
  for (std::uint32_t q = 0; q < scan.quads.size(); ++q) {
    for (std::size_t k = 0; k < 4; ++k) {
      by_edge[edge(scan.quads[q][k], scan.quads[q][(k + 1) % 4])].push_back(q);
      if (scan.positions[scan.quads[q][k]].x < kMidline) seen[q] = 1;
    }
  }
  std::vector<std::uint32_t> largest;
  for (std::uint32_t seed = 0; seed < scan.quads.size(); ++seed) {
    if (seen[seed]) continue;
    std::vector<std::uint32_t> together{seed};
    seen[seed] = 1;
    for (std::size_t i = 0; i < together.size(); ++i) {
      const auto quad = scan.quads[together[i]];
      for (std::size_t k = 0; k < 4; ++k) {
        const Edge e = edge(quad[k], quad[(k + 1) % 4]);
        if (rims.count(e) > 0) continue;
        for (const std::uint32_t next : by_edge[e]) {
          if (seen[next]) continue;
          seen[next] = 1;
          together.push_back(next);
        }
      }
    }
    if (together.size() > largest.size()) largest = std::move(together);
  }
  std::vector<char> followed(scan.quads.size(), 0);
  for (const std::uint32_t q : largest) followed[q] = 1;
  return followed;
}

// Vertices of the scan's open edges: the cut through the bust.
std::set<std::uint32_t> border(const Scan& scan) {
  std::map<Edge, int> uses;
  for (const auto& q : scan.quads) {
    for (std::size_t k = 0; k < 4; ++k) ++uses[edge(q[k], q[(k + 1) % 4])];
  }
  std::set<std::uint32_t> out;
  for (const auto& [e, count] : uses) {
    if (count == 1) out.insert({e.first, e.second});
  }
  return out;
}

bool is_shell(const runtime::Face& face, const runtime::Primitive& p) {
  const std::string& name = face.materials[p.material].name;
  return name == "brow" || name == "hair";
}

std::vector<glm::dvec3> rest_positions(const runtime::Face& face) {
  const runtime::SparseMatrix& t = face.skin.surface;
  std::vector<glm::dvec3> out(t.rows);
  for (std::uint32_t v = 0; v < t.rows; ++v) {
    glm::dvec3 p(face.skin.offsets[v]);
    for (std::uint32_t i = t.row_begin[v]; i < t.row_begin[v + 1]; ++i) {
      p += static_cast<double>(t.value[i]) * face.skin.points[t.column[i]];
    }
    out[v] = p;
  }
  return out;
}

}  // namespace

Figures measure(const Scan& scan, const Layout& layout, const runtime::Face& face) {
  std::vector<glm::dvec3> skin;
  for (const glm::dvec3& p : rest_positions(face)) skin.push_back(p * 1000.0 / kMillimetres);  // the scan's units
  std::vector<Triangle> triangles;
  std::set<std::uint32_t> used;
  for (const runtime::Primitive& p : face.skin.primitives) {
    if (is_shell(face, p)) continue;
    for (std::size_t i = 0; i + 2 < p.triangles.size(); i += 3) {
      const Triangle t{p.triangles[i], p.triangles[i + 1], p.triangles[i + 2]};
      triangles.push_back(t);
      used.insert(t.begin(), t.end());
    }
  }
  const TriangleTree surface(skin, triangles);

  const std::vector<char> followed = followed_quads(scan, layout);
  const std::set<std::uint32_t> bust = border(scan);
  std::vector<Triangle> scan_triangles;
  std::vector<char> left_out;
  std::vector<char> on_face(scan.positions.size(), 0);
  for (std::uint32_t q = 0; q < scan.quads.size(); ++q) {
    const auto& quad = scan.quads[q];
    const bool at_bust = std::any_of(quad.begin(), quad.end(), [&](std::uint32_t v) { return bust.count(v) > 0; });
    for (const std::size_t k : {std::size_t{1}, std::size_t{2}}) {
      scan_triangles.push_back({quad[0], quad[k], quad[k + 1]});
      left_out.push_back(!followed[q] || at_bust);
    }
    if (followed[q]) {
      for (const std::uint32_t v : quad) on_face[v] = 1;
    }
  }
  const TriangleTree original(scan.positions, scan_triangles);

  Figures f;
  std::vector<double> distances;
  for (std::uint32_t v = 0; v < std::min<std::size_t>(kFaceVertices, scan.positions.size()); ++v) {
    if (!on_face[v] || scan.positions[v].x < kMidline) continue;
    distances.push_back(kMillimetres * surface.nearest(scan.positions[v]).distance);
  }
  f.scan_to_surface = summary(std::move(distances));
  distances.clear();
  for (const std::uint32_t v : used) {
    if (skin[v].x < kMidline) continue;
    const Nearest n = original.nearest(skin[v]);
    if (!left_out[n.triangle]) distances.push_back(kMillimetres * n.distance);
  }
  f.surface_to_scan = summary(std::move(distances));
  return f;
}

std::size_t count_folds(const runtime::Face& face) {
  const std::vector<glm::dvec3> p = rest_positions(face);
  std::vector<glm::dvec3> normals(p.size(), glm::dvec3(0.0));
  const auto each = [&](const auto& use) {
    for (const runtime::Primitive& primitive : face.skin.primitives) {
      if (is_shell(face, primitive)) continue;
      const std::vector<std::uint32_t>& t = primitive.triangles;
      for (std::size_t i = 0; i + 2 < t.size(); i += 3) {
        use(t[i], t[i + 1], t[i + 2], glm::cross(p[t[i + 1]] - p[t[i]], p[t[i + 2]] - p[t[i]]));
      }
    }
  };
  each([&](std::uint32_t a, std::uint32_t b, std::uint32_t c, const glm::dvec3& area) {
    for (const std::uint32_t v : {a, b, c}) normals[v] += area;
  });
  std::size_t folds = 0;
  each([&](std::uint32_t a, std::uint32_t b, std::uint32_t c, const glm::dvec3& area) {
    const glm::dvec3 mean = glm::normalize(normals[a]) + glm::normalize(normals[b]) + glm::normalize(normals[c]);
    if (glm::dot(mean, area) < 0) ++folds;
  });
  return folds;
}

}  // namespace nms::fit_face
