#include <nms/runtime/tessellate.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace nms::runtime {

namespace {

constexpr double kSameKnot = 1e-9;
// Steps of the wider chain by which an edge across may lead.
constexpr double kAhead = 2.0;
// A quad is cut the other way where that is shorter by more than rounding.
constexpr double kShorter = 1.0 - 1e-6;

// A curve's vertices and a grid's lines, both as numbers from 0 to 1 along a side.
struct Chain {
  std::vector<std::uint32_t> vertices;
  std::vector<double> at;
};

double squared(const glm::dvec3& v) { return v.x * v.x + v.y * v.y + v.z * v.z; }

class Tessellator {
 public:
  Tessellator(const SurfaceNet& net, const Seams& seams, const std::vector<SurfaceSamples>& samples,
              std::span<const glm::dvec3> points)
      : net_(net), seams_(seams), samples_(samples), points_(points) {}

  NetMesh run() {
    sample_curves();
    mesh_.triangles.resize(net_.surfaces.size());
    for (std::uint32_t s = 0; s < net_.surfaces.size(); ++s) {
      if (net_.surfaces[s].sides)
        with_sides(s);
      else
        plain(s);
    }
    return std::move(mesh_);
  }

 private:
  // Parameters of every curve's vertices: as dense as the densest surface on each span, and wherever something ends.
  void sample_curves() {
    std::vector<std::vector<double>> borders(net_.curves.size());
    std::vector<std::vector<std::uint32_t>> density(net_.curves.size());
    curve_at_.resize(net_.curves.size());
    for (std::size_t c = 0; c < net_.curves.size(); ++c) {
      borders[c] = span_borders(net_.curves[c].knots, net_.curves[c].degree);
      density[c].assign(borders[c].size() - 1, 1);
      for (const CurveEnd& end : net_.curves[c].ends) {
        if (end.curve != kNoIndex) curve_at_[end.curve].push_back(end.at);
      }
    }
    for (std::size_t s = 0; s < net_.surfaces.size(); ++s) {
      const NetSurface& surface = net_.surfaces[s];
      if (!surface.sides) continue;
      for (std::size_t k = 0; k < 4; ++k) {
        const SurfaceSide& side = (*surface.sides)[k];
        const bool along_u = k % 2 == 0;
        const auto& knots = along_u ? surface.knots_u : surface.knots_v;
        const std::size_t spans = span_borders(knots, along_u ? surface.degree_u : surface.degree_v).size() - 1;
        const double low = std::min(side.from, side.to);
        const double high = std::max(side.from, side.to);
        curve_at_[side.curve].push_back(low);
        curve_at_[side.curve].push_back(high);
        const double lines = static_cast<double>(spans * (along_u ? samples_[s].u : samples_[s].v));
        const auto& b = borders[side.curve];
        for (std::size_t i = 0; i + 1 < b.size(); ++i) {
          const double share = (std::min(b[i + 1], high) - std::max(b[i], low)) / (high - low);
          if (share <= 0.0) continue;
          const auto n = static_cast<std::uint32_t>(std::ceil(lines * share - kSameKnot));
          density[side.curve][i] = std::max(density[side.curve][i], n);
        }
      }
    }
    for (std::size_t c = 0; c < net_.curves.size(); ++c) {
      std::vector<double>& at = curve_at_[c];
      for (std::size_t i = 0; i + 1 < borders[c].size(); ++i) {
        const double n = density[c][i];
        for (std::uint32_t j = 0; j <= density[c][i]; ++j) {
          at.push_back(borders[c][i] + (borders[c][i + 1] - borders[c][i]) * (j / n));
        }
      }
      std::sort(at.begin(), at.end());
      at.erase(std::unique(at.begin(), at.end(), [](double a, double b) { return b - a <= kSameKnot; }), at.end());
    }
  }

  std::uint32_t add(Row row, VertexPlace place) {
    if (!points_.empty()) {
      glm::dvec3 p(0.0);
      for (const RowEntry& e : row) p += e.weight * points_[e.point];
      rest_.push_back(p);
    }
    mesh_.vertices.push_back(std::move(row));
    mesh_.places.push_back(place);
    return static_cast<std::uint32_t>(mesh_.vertices.size() - 1);
  }

  std::uint32_t on_curve(std::uint32_t curve, double t, VertexPlace place) {
    const CurveEnd owner = canonical_place(net_, curve, t);
    double key = 0.0;
    if (owner.curve != kNoIndex) {  // the curve's own vertex there, not one a rounding error away
      const auto& at = curve_at_[owner.curve];
      key = *std::lower_bound(at.begin(), at.end(), owner.at - kSameKnot);
    }
    const auto [found, fresh] = made_.try_emplace({owner.node, owner.curve, key}, 0);
    if (fresh) {
      found->second =
          add(owner.curve == kNoIndex ? Row{{owner.node, 1.0}} : curve_row(net_, seams_, owner.curve, key), place);
    }
    return found->second;
  }

  // Vertices along side k, from its first corner to its last.
  Chain side_chain(std::uint32_t s, std::size_t k) {
    const NetSurface& surface = net_.surfaces[s];
    const SurfaceSide& side = (*surface.sides)[k];
    const double low = std::min(side.from, side.to);
    const double high = std::max(side.from, side.to);
    std::vector<double> at;
    for (const double t : curve_at_[side.curve]) {
      if (t >= low - kSameKnot && t <= high + kSameKnot) at.push_back(t);
    }
    if (side.from > side.to) std::reverse(at.begin(), at.end());
    Chain chain;
    for (const double t : at) {
      const double share = std::clamp((t - side.from) / (side.to - side.from), 0.0, 1.0);
      const double along = k >= 2 ? 1.0 - share : share;
      VertexPlace place{s, 0.0, 0.0};
      const auto on = [&](const std::vector<double>& knots, double f) {
        return knots.front() + f * (knots.back() - knots.front());
      };
      place.u = on(surface.knots_u, k % 2 == 0 ? along : (k == 1 ? 1.0 : 0.0));
      place.v = on(surface.knots_v, k % 2 == 1 ? along : (k == 2 ? 1.0 : 0.0));
      chain.vertices.push_back(on_curve(side.curve, t, place));
      chain.at.push_back(share);
    }
    return chain;
  }

  void with_sides(std::uint32_t s) {
    const NetSurface& surface = net_.surfaces[s];
    std::vector<double> lines_u = grid_lines(surface.knots_u, surface.degree_u, samples_[s].u);
    std::vector<double> lines_v = grid_lines(surface.knots_v, surface.degree_v, samples_[s].v);
    if (lines_u.size() < 3) lines_u.insert(lines_u.begin() + 1, 0.5 * (lines_u.front() + lines_u.back()));
    if (lines_v.size() < 3) lines_v.insert(lines_v.begin() + 1, 0.5 * (lines_v.front() + lines_v.back()));
    std::array<Chain, 4> sides;
    for (std::size_t k = 0; k < 4; ++k) sides[k] = side_chain(s, k);
    const std::size_t nu = lines_u.size() - 2;  // inner lines
    const std::size_t nv = lines_v.size() - 2;
    std::vector<std::uint32_t> grid(nu * nv);
    for (std::size_t v = 0; v < nv; ++v) {
      for (std::size_t u = 0; u < nu; ++u) {
        const double pu = lines_u[u + 1];
        const double pv = lines_v[v + 1];
        grid[u + nu * v] = add(surface_row(net_, seams_, s, pu, pv), {s, pu, pv});
      }
    }
    std::vector<std::uint32_t>& triangles = mesh_.triangles[s];
    quads(grid, nu, nv, triangles);
    const auto share = [](const std::vector<double>& lines, std::size_t i) {
      return (lines[i] - lines.front()) / (lines.back() - lines.front());
    };
    std::array<Chain, 4> rims;
    for (std::size_t u = 0; u < nu; ++u) {
      rims[0].vertices.push_back(grid[u]);
      rims[0].at.push_back(share(lines_u, u + 1));
      rims[2].vertices.push_back(grid[nu - 1 - u + nu * (nv - 1)]);
      rims[2].at.push_back(1.0 - share(lines_u, nu - u));
    }
    for (std::size_t v = 0; v < nv; ++v) {
      rims[1].vertices.push_back(grid[nu - 1 + nu * v]);
      rims[1].at.push_back(share(lines_v, v + 1));
      rims[3].vertices.push_back(grid[nu * (nv - 1 - v)]);
      rims[3].at.push_back(1.0 - share(lines_v, nv - v));
    }
    for (std::size_t k = 0; k < 4; ++k) zip(sides[k], rims[k], triangles);
  }

  void plain(std::uint32_t s) {
    const NetSurface& surface = net_.surfaces[s];
    const auto lines_u = grid_lines(surface.knots_u, surface.degree_u, samples_[s].u);
    const auto lines_v = grid_lines(surface.knots_v, surface.degree_v, samples_[s].v);
    std::vector<std::uint32_t> grid;
    for (const double v : lines_v) {
      for (const double u : lines_u) grid.push_back(add(surface_row(net_, seams_, s, u, v), {s, u, v}));
    }
    quads(grid, lines_u.size(), lines_v.size(), mesh_.triangles[s]);
  }

  // Two chains that start and end opposite one another; `outer` has the surface's inside on its left.
  void zip(const Chain& outer, const Chain& inner, std::vector<std::uint32_t>& triangles) const {
    std::size_t i = 0;
    std::size_t j = 0;
    while (i + 1 < outer.vertices.size() || j + 1 < inner.vertices.size()) {
      const bool outer_left = i + 1 < outer.vertices.size();
      const bool inner_left = j + 1 < inner.vertices.size();
      const bool take_outer = outer_left && (!inner_left || outer_is_next(outer, i, inner, j));
      const std::uint32_t a = outer.vertices[i];
      const std::uint32_t b = inner.vertices[j];
      const std::uint32_t c = take_outer ? outer.vertices[++i] : inner.vertices[++j];
      if (a == b || b == c || a == c) continue;
      triangles.insert(triangles.end(), {a, c, b});
    }
  }

  bool outer_is_next(const Chain& outer, std::size_t i, const Chain& inner, std::size_t j) const {
    // Where the next vertex comes first; the middle of an edge decides, so both chains keep pace.
    const bool in_pace = outer.at[i] + outer.at[i + 1] <= inner.at[j] + inner.at[j + 1];
    if (points_.empty()) return in_pace;
    // Of the two edges across, the shorter: chains of unequal pace make slivers. None may run ahead.
    const double step = std::max(outer.at[i + 1] - outer.at[i], inner.at[j + 1] - inner.at[j]);
    const double ahead = in_pace ? inner.at[j + 1] - outer.at[i] : outer.at[i + 1] - inner.at[j];
    if (ahead > kAhead * step) return in_pace;
    const double by_outer = squared(rest_[outer.vertices[i + 1]] - rest_[inner.vertices[j]]);
    const double by_inner = squared(rest_[outer.vertices[i]] - rest_[inner.vertices[j + 1]]);
    return by_outer == by_inner ? in_pace : by_outer < by_inner;
  }

  void quads(const std::vector<std::uint32_t>& grid, std::size_t nu, std::size_t nv,
             std::vector<std::uint32_t>& triangles) const {
    for (std::size_t v = 0; v + 1 < nv; ++v) {
      for (std::size_t u = 0; u + 1 < nu; ++u) {
        const std::uint32_t a = grid[u + nu * v];
        const std::uint32_t b = grid[u + 1 + nu * v];
        const std::uint32_t c = grid[u + 1 + nu * (v + 1)];
        const std::uint32_t d = grid[u + nu * (v + 1)];
        if (!points_.empty() && squared(rest_[d] - rest_[b]) < kShorter * squared(rest_[c] - rest_[a])) {
          triangles.insert(triangles.end(), {a, b, d, b, c, d});
        } else {
          triangles.insert(triangles.end(), {a, b, c, a, c, d});
        }
      }
    }
  }

  const SurfaceNet& net_;
  const Seams& seams_;
  const std::vector<SurfaceSamples>& samples_;
  std::span<const glm::dvec3> points_;
  std::vector<glm::dvec3> rest_;  // of the vertices, where points are given
  std::vector<std::vector<double>> curve_at_;
  std::map<std::tuple<std::uint32_t, std::uint32_t, double>, std::uint32_t> made_;
  NetMesh mesh_;
};

}  // namespace

std::vector<double> grid_lines(const std::vector<double>& knots, int degree, std::uint32_t samples) {
  const std::vector<double> borders = span_borders(knots, degree);
  std::vector<double> lines{borders.front()};
  for (std::size_t i = 0; i + 1 < borders.size(); ++i) {
    for (std::uint32_t j = 1; j < samples; ++j) {
      lines.push_back(borders[i] + (borders[i + 1] - borders[i]) * (static_cast<double>(j) / samples));
    }
    lines.push_back(borders[i + 1]);
  }
  return lines;
}

double vertex_bound(const SurfaceNet& net, const std::vector<SurfaceSamples>& samples) {
  double sum = 0.0;
  for (std::size_t s = 0; s < net.surfaces.size(); ++s) {
    const NetSurface& surface = net.surfaces[s];
    const double nu = static_cast<double>(surface.knots_u.size()) * samples[s].u + 2.0;
    const double nv = static_cast<double>(surface.knots_v.size()) * samples[s].v + 2.0;
    sum += nu * nv;
  }
  // Curves are at most as dense as the surfaces on them, each counted twice.
  return 2.0 * sum + static_cast<double>(net.curves.size());
}

NetMesh tessellate(const SurfaceNet& net, const Seams& seams, const std::vector<SurfaceSamples>& samples,
                   std::span<const glm::dvec3> points) {
  return Tessellator(net, seams, samples, points).run();
}

}  // namespace nms::runtime
