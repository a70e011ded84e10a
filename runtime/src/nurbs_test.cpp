#include <cmath>
#include <random>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <nms/runtime/nurbs.h>

namespace nms::runtime {
namespace {

const double kHalfRoot = std::sqrt(0.5);

NurbsCurve quarter_circle() {
  return {2, {0, 0, 0, 1, 1, 1}, {{1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {1.0, kHalfRoot, 1.0}};
}

TEST(Nurbs, BasisIsAPartitionOfUnity) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> step(0.0, 1.0);
  for (int degree = 1; degree <= 7; ++degree) {
    for (int trial = 0; trial < 20; ++trial) {
      std::vector<double> knots(static_cast<std::size_t>(degree) + 1, 0.0);
      double at = 0.0;
      for (int i = 0; i < 6; ++i) knots.push_back(at += step(random) < 0.2 ? 0.0 : step(random));
      at += 0.5;
      for (int i = 0; i <= degree; ++i) knots.push_back(at);
      if (knot_fault(knots, degree, knots.size() - static_cast<std::size_t>(degree) - 1)) continue;
      for (int i = 0; i <= 40; ++i) {
        const BasisValues b = basis(knots, degree, at * i / 40.0);
        double sum = 0.0;
        double slope = 0.0;
        for (int r = 0; r <= degree; ++r) {
          EXPECT_GE(b.value[r], 0.0);
          sum += b.value[r];
          slope += b.derivative[r];
        }
        EXPECT_NEAR(sum, 1.0, 1e-12);
        EXPECT_NEAR(slope, 0.0, 1e-9);
      }
    }
  }
}

TEST(Nurbs, QuarterCircleIsExact) {
  const NurbsCurve c = quarter_circle();
  for (int i = 0; i <= 50; ++i) {
    const CurveSample s = evaluate(c, i / 50.0);
    EXPECT_NEAR(glm::length(s.point), 1.0, 1e-14);
    EXPECT_NEAR(glm::dot(s.point, s.tangent), 0.0, 1e-13);
  }
}

TEST(Nurbs, CylinderAndSphereAreExact) {
  NurbsSurface cylinder{2, 1, 3, 2, {0, 0, 0, 1, 1, 1}, {0, 0, 1, 1}, {}, {}};
  for (const double z : {0.0, 2.0}) {
    for (std::size_t i = 0; i < 3; ++i) {
      cylinder.points.push_back(quarter_circle().points[i] + glm::dvec3(0, 0, z));
      cylinder.weights.push_back(quarter_circle().weights[i]);
    }
  }
  NurbsSurface sphere{2, 2, 3, 3, {0, 0, 0, 1, 1, 1}, {0, 0, 0, 1, 1, 1}, {}, {}};
  const NurbsCurve arc = quarter_circle();
  for (std::size_t v = 0; v < 3; ++v) {
    for (std::size_t u = 0; u < 3; ++u) {  // the arc in x and z, turned about z
      const glm::dvec3 q = arc.points[v];
      sphere.points.emplace_back(q.x * arc.points[u].x, q.x * arc.points[u].y, q.y);
      sphere.weights.push_back(arc.weights[u] * arc.weights[v]);
    }
  }
  for (int i = 0; i <= 20; ++i) {
    for (int j = 0; j <= 20; ++j) {
      const SurfaceSample c = evaluate(cylinder, i / 20.0, j / 20.0);
      EXPECT_NEAR(std::hypot(c.point.x, c.point.y), 1.0, 1e-14);
      EXPECT_NEAR(c.point.z, 2.0 * j / 20.0, 1e-14);
      const SurfaceSample s = evaluate(sphere, i / 20.0, j / 20.0);
      EXPECT_NEAR(glm::length(s.point), 1.0, 1e-14);
      EXPECT_NEAR(glm::dot(s.point, s.du), 0.0, 1e-13);
      EXPECT_NEAR(glm::dot(s.point, s.dv), 0.0, 1e-13);
    }
  }
}

TEST(Nurbs, DerivativesMatchDifferences) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(0.2, 2.0);
  NurbsSurface s{3, 2, 7, 5, {0, 0, 0, 0, 0.5, 1.5, 1.6, 3, 3, 3, 3}, {0, 0, 0, 1, 1.2, 2, 2, 2}, {}, {}};
  for (int i = 0; i < 35; ++i) {
    s.points.emplace_back(any(random), any(random), any(random));
    s.weights.push_back(any(random));
  }
  const double h = 1e-6;
  for (const double u : {0.1, 0.7, 1.55, 2.9}) {
    for (const double v : {0.3, 1.1, 1.7}) {
      const SurfaceSample at = evaluate(s, u, v);
      const glm::dvec3 du = (evaluate(s, u + h, v).point - evaluate(s, u - h, v).point) / (2 * h);
      const glm::dvec3 dv = (evaluate(s, u, v + h).point - evaluate(s, u, v - h).point) / (2 * h);
      EXPECT_NEAR(glm::length(at.du - du), 0.0, 1e-7);
      EXPECT_NEAR(glm::length(at.dv - dv), 0.0, 1e-7);
    }
  }
}

TEST(Nurbs, FaultsOfKnotsAreNamed) {
  EXPECT_FALSE(knot_fault(clamped_uniform_knots(3, 4), 3, 7));
  EXPECT_TRUE(knot_fault(clamped_uniform_knots(3, 4), 3, 8));
  EXPECT_TRUE(knot_fault(std::vector<double>{0, 0, 0, 0}, 1, 2));
  EXPECT_TRUE(knot_fault(std::vector<double>{0, 0, 1, 0.5, 2, 2}, 1, 4));
  EXPECT_TRUE(knot_fault(std::vector<double>{0, 0, std::nan(""), 1, 1}, 1, 3));
  EXPECT_TRUE(knot_fault(std::vector<double>{0, 0, 1, 1, 2, 2}, 1, 4));
}

}  // namespace
}  // namespace nms::runtime
