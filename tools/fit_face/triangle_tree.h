#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

namespace nms::fit_face {

using Triangle = std::array<std::uint32_t, 3>;

struct Nearest {
  double distance = 1e300;
  glm::dvec3 point{0.0};
  std::uint32_t triangle = 0;
};

/// Nearest points on a triangle mesh: boxes over halves of the triangles, split along the longest side.
class TriangleTree {
 public:
  TriangleTree(std::vector<glm::dvec3> positions, std::vector<Triangle> triangles)
      : positions_(std::move(positions)), triangles_(std::move(triangles)) {
    order_.resize(triangles_.size());
    for (std::uint32_t i = 0; i < order_.size(); ++i) order_[i] = i;
    if (!order_.empty()) build(0, order_.size());
  }

  Nearest nearest(const glm::dvec3& p) const {
    Nearest best;
    if (!nodes_.empty()) search(0, p, best);
    return best;
  }

  const std::vector<Triangle>& triangles() const { return triangles_; }
  const std::vector<glm::dvec3>& positions() const { return positions_; }

 private:
  struct Node {
    glm::dvec3 low{1e300}, high{-1e300};
    std::size_t begin = 0, end = 0, right = 0;
  };

  std::size_t build(std::size_t begin, std::size_t end) {
    const std::size_t index = nodes_.size();
    nodes_.emplace_back();
    Node n;
    n.begin = begin;
    n.end = end;
    for (std::size_t i = begin; i < end; ++i) {
      for (const auto v : triangles_[order_[i]]) {
        n.low = glm::min(n.low, positions_[v]);
        n.high = glm::max(n.high, positions_[v]);
      }
    }
    if (end - begin > 6) {
      const glm::dvec3 d = n.high - n.low;
      const int axis = d.x > d.y ? (d.x > d.z ? 0 : 2) : (d.y > d.z ? 1 : 2);
      const auto key = [&](std::uint32_t t) {
        const auto& q = triangles_[t];
        return positions_[q[0]][axis] + positions_[q[1]][axis] + positions_[q[2]][axis];
      };
      const auto first = order_.begin() + static_cast<std::ptrdiff_t>(begin);
      const auto last = order_.begin() + static_cast<std::ptrdiff_t>(end);
      std::stable_sort(first, last, [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); });
      const std::size_t mid = (begin + end) / 2;
      build(begin, mid);
      n.right = build(mid, end);
    }
    nodes_[index] = n;
    return index;
  }

  static double gap(const Node& n, const glm::dvec3& p) {
    const glm::dvec3 d = glm::max(glm::max(n.low - p, p - n.high), glm::dvec3(0.0));
    return glm::dot(d, d);
  }

  void search(std::size_t index, const glm::dvec3& p, Nearest& best) const {
    const Node& n = nodes_[index];
    if (gap(n, p) >= best.distance * best.distance) return;
    if (n.right == 0) {
      for (std::size_t i = n.begin; i < n.end; ++i) {
        const auto& t = triangles_[order_[i]];
        const glm::dvec3 q = on_triangle(p, positions_[t[0]], positions_[t[1]], positions_[t[2]]);
        const double d = glm::length(q - p);
        if (d < best.distance) best = {d, q, order_[i]};
      }
      return;
    }
    const std::size_t left = index + 1;
    const bool left_first = gap(nodes_[left], p) <= gap(nodes_[n.right], p);
    search(left_first ? left : n.right, p, best);
    search(left_first ? n.right : left, p, best);
  }

  // Ericson, Real-Time Collision Detection, 5.1.5.
  static glm::dvec3 on_triangle(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
    const glm::dvec3 ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
    const double d1 = glm::dot(ab, ap), d2 = glm::dot(ac, ap), d3 = glm::dot(ab, bp), d4 = glm::dot(ac, bp),
                 d5 = glm::dot(ab, cp), d6 = glm::dot(ac, cp);
    if (d1 <= 0 && d2 <= 0) return a;
    if (d3 >= 0 && d4 <= d3) return b;
    if (d6 >= 0 && d5 <= d6) return c;
    const double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + ab * (d1 / (d1 - d3));
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + ac * (d2 / (d2 - d6));
    if (va <= 0 && d4 >= d3 && d5 >= d6) return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    const double f = 1.0 / (va + vb + vc);
    return a + ab * (vb * f) + ac * (vc * f);
  }

  std::vector<glm::dvec3> positions_;
  std::vector<Triangle> triangles_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
};

}  // namespace nms::fit_face
