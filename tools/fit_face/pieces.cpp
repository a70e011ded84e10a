#include "pieces.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <fmt/format.h>
#include <Eigen/Sparse>
#include <Eigen/SparseLU>
#include <glm/geometric.hpp>

namespace nms::fit_face {

namespace {

// More passes move a path across its neighbours and fold the surface; the ear's seam lies free on the skull.
constexpr int kPasses = 2;
constexpr int kEarPasses = 5;
// Parameters nearer than this are one; knots are whole numbers.
constexpr double kSameParameter = 1e-9;

std::pair<std::uint32_t, std::uint32_t> edge(std::uint32_t a, std::uint32_t b) { return std::minmax(a, b); }

// The sides of the same surface seen from its other face.
std::array<LayoutSurface::Side, 4> turned(const std::array<LayoutSurface::Side, 4>& s) {
  const auto back = [](const LayoutSurface::Side& a) { return LayoutSurface::Side{a.curve, a.to, a.from}; };
  return {back(s[3]), back(s[2]), back(s[1]), back(s[0])};
}

double spans(const LayoutSurface& s, std::size_t side) {
  return std::max(std::abs(s.sides[side].to - s.sides[side].from),
                  std::abs(s.sides[side + 2].to - s.sides[side + 2].from));
}

}  // namespace

Pieces::Pieces(const Scan& scan, Layout& layout) : scan_(scan), layout_(layout) {
  cut();
  smooth_paths();
  set_parameters();
  make_pieces();
  for (auto& [s, piece] : pieces_) parametrise(layout_.surfaces[s], piece);
}

// A quad that a curve crosses is split along the curve, another along its shorter diagonal.
void Pieces::cut() {
  for (const auto& c : layout_.curves) {
    for (std::size_t i = 0; i + 1 < c.vertices.size(); ++i) cut_edges_.insert(edge(c.vertices[i], c.vertices[i + 1]));
  }
  const auto& p = scan_.positions;
  for (const auto& q : scan_.quads) {
    if (std::any_of(q.begin(), q.end(), [&](std::uint32_t v) { return p[v].x < -1e-9; })) continue;
    const bool first = cut_edges_.count(edge(q[0], q[2])) > 0;
    const bool second = cut_edges_.count(edge(q[1], q[3])) > 0;
    const bool by_first = first || (!second && glm::length(p[q[0]] - p[q[2]]) <= glm::length(p[q[1]] - p[q[3]]));
    if (by_first) {
      triangles_.push_back({q[0], q[1], q[2]});
      triangles_.push_back({q[0], q[2], q[3]});
    } else {
      triangles_.push_back({q[1], q[2], q[3]});
      triangles_.push_back({q[1], q[3], q[0]});
    }
  }
  std::vector<Triangle> all;
  for (const auto& q : scan_.quads) {
    all.push_back({q[0], q[1], q[2]});
    all.push_back({q[0], q[2], q[3]});
  }
  tree_ = std::make_unique<TriangleTree>(p, all);
}

// Paths drawn along edges have corners; smoothed, they stay on the scan.
void Pieces::smooth_paths() {
  place_ = scan_.positions;
  for (const auto& c : layout_.curves) {
    if (c.feature) continue;
    std::set<std::uint32_t> nodes;
    for (const auto& k : c.knots) nodes.insert(k.first);
    const int passes = c.name == "EO" ? kEarPasses : kPasses;
    for (int pass = 0; pass < passes; ++pass) {
      const auto old = place_;
      for (std::size_t i = 1; i + 1 < c.vertices.size(); ++i) {
        const std::uint32_t v = c.vertices[i];
        if (nodes.count(v) > 0) continue;
        const glm::dvec3 q = 0.25 * old[c.vertices[i - 1]] + 0.5 * old[v] + 0.25 * old[c.vertices[i + 1]];
        if (c.midline) {
          place_[v] = {0.0, q.y, q.z};
          continue;
        }
        place_[v] = tree_->nearest(q).point;
      }
    }
  }
}

// Chord length between nodes, so that a node keeps its knot.
void Pieces::set_parameters() {
  for (const auto& c : layout_.curves) {
    std::vector<double> t(c.vertices.size(), 0.0);
    std::size_t from = 0;
    for (std::size_t k = 0; k + 1 < c.knots.size(); ++k) {
      std::size_t to = from + 1;
      while (c.vertices[to] != c.knots[k + 1].first) ++to;
      if (k + 2 == c.knots.size()) to = c.vertices.size() - 1;
      std::vector<double> length(to - from + 1, 0.0);
      for (std::size_t i = from; i < to; ++i) {
        length[i - from + 1] = length[i - from] + glm::length(place_[c.vertices[i + 1]] - place_[c.vertices[i]]);
      }
      for (std::size_t i = from; i <= to; ++i) {
        t[i] = c.knots[k].second + (c.knots[k + 1].second - c.knots[k].second) * length[i - from] / length.back();
      }
      from = to;
    }
    at_[c.name] = t;
  }
}

const LayoutCurve& Pieces::layout_curve(const std::string& name) const {
  for (const auto& c : layout_.curves) {
    if (c.name == name) return c;
  }
  fail("no curve " + name);
}

std::vector<std::pair<std::uint32_t, double>> Pieces::side_vertices(const LayoutSurface::Side& side) const {
  const LayoutCurve& c = layout_curve(side.curve);
  const auto& t = at_.at(side.curve);
  std::vector<std::pair<std::uint32_t, double>> out;
  const double low = std::min(side.from, side.to) - kSameParameter,
               high = std::max(side.from, side.to) + kSameParameter;
  for (std::size_t i = 0; i < t.size(); ++i) {
    if (t[i] >= low && t[i] <= high) out.emplace_back(c.vertices[i], t[i]);
  }
  if (side.from > side.to) std::reverse(out.begin(), out.end());
  return out;
}

std::vector<std::uint32_t> Pieces::surface_loop(const LayoutSurface& s) const {
  std::vector<std::uint32_t> loop;
  for (const auto& side : s.sides) {
    const auto vertices = side_vertices(side);
    for (std::size_t i = 0; i + 1 < vertices.size(); ++i) loop.push_back(vertices[i].first);
  }
  return loop;
}

// Triangles joined across edges that no curve runs along.
std::vector<std::vector<std::uint32_t>> Pieces::flood(const TrianglesByEdge& by_edge) const {
  std::vector<char> seen(triangles_.size(), 0);
  std::vector<std::vector<std::uint32_t>> floods;
  for (std::uint32_t seed = 0; seed < triangles_.size(); ++seed) {
    if (seen[seed]) continue;
    floods.emplace_back();
    std::vector<std::uint32_t> stack{seed};
    seen[seed] = 1;
    while (!stack.empty()) {
      const std::uint32_t t = stack.back();
      stack.pop_back();
      floods.back().push_back(t);
      for (std::size_t k = 0; k < 3; ++k) {
        const Edge e = edge(triangles_[t][k], triangles_[t][(k + 1) % 3]);
        if (cut_edges_.count(e) > 0) continue;
        for (const std::uint32_t other : by_edge.at(e)) {
          if (seen[other]) continue;
          seen[other] = 1;
          stack.push_back(other);
        }
      }
    }
    std::sort(floods.back().begin(), floods.back().end());
  }
  return floods;
}

// Local vertices are corners joined across inner edges, so a cut doubles the vertices along it.
Piece Pieces::piece_of(const std::vector<std::uint32_t>& member, const TrianglesByEdge& by_edge) const {
  std::map<std::uint32_t, std::uint32_t> slot;
  for (std::uint32_t i = 0; i < member.size(); ++i) slot[member[i]] = i;
  std::vector<std::uint32_t> parent(member.size() * 3);
  std::iota(parent.begin(), parent.end(), 0U);
  const auto find = [&](std::uint32_t a) {
    while (parent[a] != a) a = parent[a] = parent[parent[a]];
    return a;
  };
  for (std::uint32_t i = 0; i < member.size(); ++i) {
    const Triangle& t = triangles_[member[i]];
    for (std::size_t k = 0; k < 3; ++k) {
      const auto e = edge(t[k], t[(k + 1) % 3]);
      if (cut_edges_.count(e) > 0) continue;
      for (const std::uint32_t o : by_edge.at(e)) {
        if (slot.count(o) == 0 || o == member[i]) continue;
        const Triangle& other = triangles_[o];
        for (std::uint32_t a = 0; a < 3; ++a) {
          for (std::uint32_t b = 0; b < 3; ++b) {
            if (t[a] == other[b] && (t[a] == e.first || t[a] == e.second))
              parent[find(3 * i + a)] = find(3 * slot[o] + b);
          }
        }
      }
    }
  }
  Piece r;
  std::map<std::uint32_t, std::uint32_t> local;
  for (std::uint32_t i = 0; i < member.size(); ++i) {
    Triangle t{};
    for (std::uint32_t k = 0; k < 3; ++k) {
      const auto [found, fresh] = local.try_emplace(find(3 * i + k), static_cast<std::uint32_t>(r.vertex.size()));
      if (fresh) r.vertex.push_back(triangles_[member[i]][k]);
      t[k] = found->second;
    }
    r.triangles.push_back(t);
  }
  std::set<std::pair<std::uint32_t, std::uint32_t>> directed;
  for (const auto& t : r.triangles) {
    for (std::size_t k = 0; k < 3; ++k) directed.insert({t[k], t[(k + 1) % 3]});
  }
  std::map<std::uint32_t, std::uint32_t> next;
  for (const auto& e : directed) {
    if (directed.count({e.second, e.first}) == 0) next[e.first] = e.second;
  }
  if (!next.empty()) {
    std::uint32_t v = next.begin()->first;
    do {
      r.loop.push_back(v);
      v = next.count(v) > 0 ? next[v] : next.begin()->first;
    } while (v != next.begin()->first && r.loop.size() <= next.size());
  }
  return r;
}

// Whether the piece's border is the surface's four sides; then its loop starts at the surface's first corner.
bool Pieces::claim(LayoutSurface& surface, Piece& piece) const {
  std::vector<std::uint32_t> loop;
  for (const auto l : piece.loop) loop.push_back(piece.vertex[l]);
  const std::array<LayoutSurface::Side, 4> original = surface.sides;
  for (const auto& sides : {original, turned(original)}) {
    surface.sides = sides;
    const std::vector<std::uint32_t> wanted = surface_loop(surface);
    if (wanted.size() != loop.size()) break;
    for (std::size_t shift = 0; shift < loop.size(); ++shift) {
      bool same = true;
      for (std::size_t i = 0; i < loop.size() && same; ++i) same = loop[(i + shift) % loop.size()] == wanted[i];
      if (!same) continue;
      std::rotate(piece.loop.begin(), piece.loop.begin() + static_cast<std::ptrdiff_t>(shift), piece.loop.end());
      return true;
    }
  }
  surface.sides = original;
  return false;
}

void Pieces::make_pieces() {
  TrianglesByEdge by_edge;
  for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) by_edge[edge(triangles_[t][k], triangles_[t][(k + 1) % 3])].push_back(t);
  }
  const auto floods = flood(by_edge);
  for (const auto& member : floods) {
    Piece piece = piece_of(member, by_edge);
    for (std::uint32_t s = 0; s < layout_.surfaces.size(); ++s) {
      if (pieces_.count(s) > 0 || !claim(layout_.surfaces[s], piece)) continue;
      pieces_[s] = std::move(piece);
      break;
    }
  }
  for (std::uint32_t s = 0; s < layout_.surfaces.size(); ++s) {
    if (pieces_.count(s) == 0) fail("no piece of the scan is bordered by surface " + layout_.surfaces[s].name);
  }
  fmt::print("{} pieces of the scan, {} surfaces\n", floods.size(), pieces_.size());
}

// Floater's mean value coordinates: every inner vertex a convex combination of its neighbours.
void Pieces::parametrise(const LayoutSurface& surface, Piece& r) const {
  const double spans_u = spans(surface, 0), spans_v = spans(surface, 1);
  const std::size_t n = r.vertex.size();
  r.u.assign(n, -1.0);
  r.v.assign(n, -1.0);
  std::vector<char> fixed(n, 0);
  std::size_t at = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    const auto side = side_vertices(surface.sides[k]);
    for (std::size_t i = 0; i + 1 < side.size(); ++i, ++at) {
      double f = (side[i].second - surface.sides[k].from) / (surface.sides[k].to - surface.sides[k].from);
      if (k >= 2) f = 1.0 - f;
      const std::uint32_t l = r.loop[at];
      r.u[l] = (k == 0 || k == 2 ? f : (k == 1 ? 1.0 : 0.0)) * spans_u;
      r.v[l] = (k == 1 || k == 3 ? f : (k == 2 ? 1.0 : 0.0)) * spans_v;
      fixed[l] = 1;
    }
  }
  std::vector<std::map<std::uint32_t, double>> weight(n);
  const auto p = [&](std::uint32_t l) { return fixed[l] ? place_[r.vertex[l]] : scan_.positions[r.vertex[l]]; };
  for (const auto& t : r.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t i = t[k], a = t[(k + 1) % 3], b = t[(k + 2) % 3];
      const glm::dvec3 x = p(a) - p(i), y = p(b) - p(i);
      const double half = 0.5 * std::atan2(glm::length(glm::cross(x, y)), glm::dot(x, y));
      weight[i][a] += std::tan(half) / std::max(glm::length(x), 1e-9);
      weight[i][b] += std::tan(half) / std::max(glm::length(y), 1e-9);
    }
  }
  std::vector<int> unknown(n, -1);
  int count = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (!fixed[i]) unknown[i] = count++;
  }
  std::vector<Eigen::Triplet<double>> triplets;
  Eigen::MatrixXd rhs = Eigen::MatrixXd::Zero(count, 2);
  for (std::size_t i = 0; i < n; ++i) {
    if (fixed[i]) continue;
    double sum = 0.0;
    for (const auto& [j, w] : weight[i]) sum += w;
    triplets.emplace_back(unknown[i], unknown[i], 1.0);
    for (const auto& [j, w] : weight[i]) {
      if (fixed[j]) {
        rhs(unknown[i], 0) += w / sum * r.u[j];
        rhs(unknown[i], 1) += w / sum * r.v[j];
      } else {
        triplets.emplace_back(unknown[i], unknown[j], -w / sum);
      }
    }
  }
  if (count == 0) return;
  Eigen::SparseMatrix<double> a(count, count);
  a.setFromTriplets(triplets.begin(), triplets.end());
  Eigen::SparseLU<Eigen::SparseMatrix<double>> lu(a);
  const Eigen::MatrixXd y = lu.solve(rhs);
  for (std::size_t i = 0; i < n; ++i) {
    if (fixed[i]) continue;
    r.u[i] = y(unknown[i], 0);
    r.v[i] = y(unknown[i], 1);
  }
}

}  // namespace nms::fit_face
