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

// Quads inside the left lids' edges: flooded from where the lids' backs end.
std::vector<char> socket_quads(const Scan& scan, const Layout& layout) {
  std::set<Edge> lids;
  std::set<std::uint32_t> deep;
  for (const LayoutCurve& c : layout.curves) {
    if (c.name == "Du" || c.name == "Dl") deep.insert(c.vertices.begin(), c.vertices.end());
    if (c.name != "Lu" && c.name != "Ll") continue;
    for (std::size_t i = 0; i + 1 < c.vertices.size(); ++i) lids.insert(edge(c.vertices[i], c.vertices[i + 1]));
  }
  std::map<Edge, std::vector<std::uint32_t>> by_edge;
  std::vector<std::uint32_t> stack;
  std::vector<char> inside(scan.quads.size(), 0);
  for (std::uint32_t q = 0; q < scan.quads.size(); ++q) {
    for (std::size_t k = 0; k < 4; ++k) by_edge[edge(scan.quads[q][k], scan.quads[q][(k + 1) % 4])].push_back(q);
    if (std::any_of(scan.quads[q].begin(), scan.quads[q].end(), [&](std::uint32_t v) { return deep.count(v) > 0; })) {
      inside[q] = 1;
      stack.push_back(q);
    }
  }
  while (!stack.empty()) {
    const auto quad = scan.quads[stack.back()];
    stack.pop_back();
    for (std::size_t k = 0; k < 4; ++k) {
      const Edge e = edge(quad[k], quad[(k + 1) % 4]);
      if (lids.count(e) > 0) continue;
      for (const std::uint32_t next : by_edge[e]) {
        if (inside[next]) continue;
        inside[next] = 1;
        stack.push_back(next);
      }
    }
  }
  return inside;
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

  const std::vector<char> socket = socket_quads(scan, layout);
  const std::set<std::uint32_t> bust = border(scan);
  std::vector<Triangle> scan_triangles;
  std::vector<char> left_out;
  std::vector<char> outside(scan.positions.size(), 0);
  for (std::uint32_t q = 0; q < scan.quads.size(); ++q) {
    const auto& quad = scan.quads[q];
    const bool at_bust = std::any_of(quad.begin(), quad.end(), [&](std::uint32_t v) { return bust.count(v) > 0; });
    for (const std::size_t k : {std::size_t{1}, std::size_t{2}}) {
      scan_triangles.push_back({quad[0], quad[k], quad[k + 1]});
      left_out.push_back(socket[q] || at_bust);
    }
    if (!socket[q]) {
      for (const std::uint32_t v : quad) outside[v] = 1;
    }
  }
  const TriangleTree original(scan.positions, scan_triangles);

  Figures f;
  std::vector<double> distances;
  for (std::uint32_t v = 0; v < std::min<std::size_t>(kFaceVertices, scan.positions.size()); ++v) {
    if (!outside[v] || scan.positions[v].x < kMidline) continue;
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
