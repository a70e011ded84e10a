#include "model.h"

#include <algorithm>

#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>
#include <glm/geometric.hpp>

namespace nms::fit_face {

using runtime::Row;
using runtime::RowEntry;

namespace {

// Keeps a point that nothing is asked of where the equations can be solved; far below any wish.
constexpr double kRidge = 1e-10;

}  // namespace

std::uint32_t Model::curve(const std::string& name) const {
  for (std::uint32_t i = 0; i < net.curves.size(); ++i) {
    if (net.curves[i].name == name) return i;
  }
  fail("no curve " + name);
}

std::uint32_t Model::surface(const std::string& name) const {
  for (std::uint32_t i = 0; i < net.surfaces.size(); ++i) {
    if (net.surfaces[i].name == name) return i;
  }
  fail("no surface " + name);
}

glm::dvec3 Model::at(const Row& row) const {
  glm::dvec3 p{0.0};
  for (const RowEntry& e : row) p += e.weight * x[e.point];
  return p;
}

double greville(const std::vector<double>& knots, std::size_t point) {
  return (knots[point + 1] + knots[point + 2] + knots[point + 3]) / 3 / knots.back();
}

double smooth_step(double low, double high, double x) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

Beside beside(const Model& model, const runtime::NetSurface& surface, const std::string& curve, double u, double v) {
  if (!surface.sides) return {};
  const double across[] = {v, 1 - u, 1 - v, u};
  const double along[] = {u, v, 1 - u, 1 - v};
  for (std::size_t k = 0; k < 4; ++k) {
    const runtime::SurfaceSide& side = (*surface.sides)[k];
    if (model.net.curves[side.curve].name == curve) {
      return {across[k], side.from + (side.to - side.from) * along[k]};
    }
  }
  return {};
}

double seam_gap(const Model& m) {
  constexpr int kPlaces = 64;  // on each side
  double gap = 0;
  for (std::uint32_t s = 0; s < m.net.surfaces.size(); ++s) {
    const runtime::NetSurface& surface = m.net.surfaces[s];
    if (!surface.sides) continue;
    for (std::size_t k = 0; k < 4; ++k) {
      const runtime::SurfaceSide& side = (*surface.sides)[k];
      for (int i = 0; i <= kPlaces; ++i) {
        const double share = static_cast<double>(i) / kPlaces;
        const double along = k >= 2 ? 1 - share : share;
        const double u = k % 2 == 0 ? along : (k == 1 ? 1.0 : 0.0);
        const double v = k % 2 == 1 ? along : (k == 2 ? 1.0 : 0.0);
        const glm::dvec3 on_surface = m.surface_point(s, u * surface.knots_u.back(), v * surface.knots_v.back());
        const glm::dvec3 on_curve = m.curve_point(side.curve, side.from + (side.to - side.from) * share);
        gap = std::max(gap, kMillimetres * glm::length(on_surface - on_curve));
      }
    }
  }
  return gap;
}

void PointSolver::solve() {
  using Matrix = Eigen::SparseMatrix<double>;
  std::vector<Eigen::Triplet<double>> triplets;
  Eigen::MatrixXd rhs(static_cast<Eigen::Index>(wants_.size()), 3);
  for (std::size_t i = 0; i < wants_.size(); ++i) {
    glm::dvec3 target = wants_[i].target;
    for (const RowEntry& e : wants_[i].row) {
      if (free_[e.point] < 0)
        target -= e.weight * model_.x[e.point];
      else
        triplets.emplace_back(static_cast<int>(i), free_[e.point], e.weight * wants_[i].weight);
    }
    for (int k = 0; k < 3; ++k) rhs(static_cast<Eigen::Index>(i), k) = target[k] * wants_[i].weight;
  }
  Matrix a(static_cast<Eigen::Index>(wants_.size()), count_);
  a.setFromTriplets(triplets.begin(), triplets.end());
  Matrix normal = a.transpose() * a;
  for (int i = 0; i < count_; ++i) normal.coeffRef(i, i) += kRidge;
  Eigen::SimplicialLDLT<Matrix> solver(normal);
  const Eigen::MatrixXd y = solver.solve(a.transpose() * rhs);
  for (std::size_t p = 0; p < free_.size(); ++p) {
    if (free_[p] >= 0) model_.x[p] = {y(free_[p], 0), y(free_[p], 1), y(free_[p], 2)};
  }
}

}  // namespace nms::fit_face
