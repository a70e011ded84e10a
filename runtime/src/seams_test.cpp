#include <map>
#include <random>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <nms/runtime/nurbs.h>
#include <nms/runtime/seams.h>
#include <nms/runtime/tessellate.h>

namespace nms::runtime {
namespace {

// Two patches that share the curve "mid"; the lower one is finer, and meets only a part of it.
//
//   n3 --top-- n2      upper: bottom side = all of mid
//   |           |
//   n0 --mid-- n1      lower: top side = mid from 0 to 2, its right border ends in the middle of mid
//   |    |
//   n4 --n5
SurfaceNet two_patches() {
  SurfaceNet net;
  net.node_count = 6;
  const auto curve = [&](const char* name, std::size_t spans, CurveEnd a, CurveEnd b) {
    net.curves.push_back({name, 3, clamped_uniform_knots(3, spans), {a, b}});
  };
  const auto node = [](std::uint32_t n) { return CurveEnd{n, kNoIndex, 0.0}; };
  curve("mid", 4, node(0), node(1));
  curve("right", 2, node(1), node(2));
  curve("top", 2, node(3), node(2));
  curve("left", 2, node(0), node(3));
  curve("low_left", 2, node(0), node(4));
  curve("bottom", 2, node(4), node(5));
  curve("low_right", 2, node(5), CurveEnd{kNoIndex, 0, 2.0});
  NetSurface upper{"upper", 3, 3, clamped_uniform_knots(3, 4), clamped_uniform_knots(3, 2), {}, {}};
  upper.sides = {{{0, 0, 4}, {1, 0, 2}, {2, 2, 0}, {3, 2, 0}}};
  NetSurface lower{"lower", 3, 3, clamped_uniform_knots(3, 8), clamped_uniform_knots(3, 4), {}, {}};
  lower.sides = {{{0, 2, 0}, {4, 0, 2}, {5, 0, 2}, {6, 0, 2}}};
  net.surfaces = {upper, lower};
  return net;
}

glm::dvec3 at(const Row& row, const std::vector<glm::dvec3>& x) {
  glm::dvec3 p{0.0};
  for (const RowEntry& e : row) p += e.weight * x[e.point];
  return p;
}

TEST(Seams, StayShutHoweverPointsMove) {
  const SurfaceNet net = two_patches();
  const auto seams = build_seams(net);
  ASSERT_TRUE(seams) << seams.error().cause;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> any(-0.1, 0.1);
  std::vector<glm::dvec3> x(seams->points.size());
  for (auto& p : x) p = {any(random), any(random), any(random)};
  for (int i = 0; i <= 32; ++i) {
    const double f = i / 32.0;
    // u of "upper" runs along mid; lower's first side runs mid from 2 back to 0.
    const glm::dvec3 on_curve = at(curve_row(net, *seams, 0, 2.0 * f), x);
    EXPECT_LT(glm::length(at(surface_row(net, *seams, 0, 2.0 * f, 0.0), x) - on_curve), 1e-14);
    EXPECT_LT(glm::length(at(surface_row(net, *seams, 1, 8.0 * (1.0 - f), 0.0), x) - on_curve), 1e-14);
  }
}

TEST(Seams, RowsSumToOneAndMeshIsOneSheet) {
  const SurfaceNet net = two_patches();
  const auto seams = build_seams(net);
  ASSERT_TRUE(seams);
  for (const auto& surface : seams->surfaces) {
    for (const Row& row : surface) {
      double sum = 0.0;
      for (const RowEntry& e : row) sum += e.weight;
      EXPECT_NEAR(sum, 1.0, 1e-12);
    }
  }
  for (const std::uint32_t density : {1U, 2U, 3U}) {
    const NetMesh mesh = tessellate(net, *seams, {{1, 2}, {density, 3}});
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    for (const auto& triangles : mesh.triangles) {
      for (std::size_t i = 0; i < triangles.size(); i += 3) {
        for (std::size_t k = 0; k < 3; ++k) {
          EXPECT_EQ(++edges[std::pair(triangles[i + k], triangles[i + (k + 1) % 3])], 1);
        }
      }
    }
    std::map<std::uint32_t, std::uint32_t> open;
    for (const auto& [edge, n] : edges) {
      if (edges.count({edge.second, edge.first}) == 0) open[edge.first] = edge.second;
    }
    std::size_t length = 0;  // one border loop and no other
    std::uint32_t v = open.begin()->first;
    do {
      v = open.at(v);
      ++length;
    } while (v != open.begin()->first && length <= open.size());
    EXPECT_EQ(length, open.size());
  }
}

TEST(Seams, ContradictionsAreRefused) {
  SurfaceNet net = two_patches();
  net.curves[0].ends[0] = {kNoIndex, 6, 0.0};  // mid hangs on low_right, which hangs on mid
  EXPECT_EQ(build_seams(net).error().kind, "curve_cycle");
  net = two_patches();
  net.surfaces[1].knots_u = clamped_uniform_knots(3, 3);
  EXPECT_EQ(build_seams(net).error().kind, "knots_not_nested");
  net = two_patches();
  (*net.surfaces[1].sides)[1].from = 1;
  EXPECT_EQ(build_seams(net).error().kind, "open_border");
  net = two_patches();
  net.curves[2].ends[0] = {};
  EXPECT_EQ(build_seams(net).error().kind, "missing_curve");
}

}  // namespace
}  // namespace nms::runtime
