#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include <nms/runtime/nurbs.h>
#include <nms/runtime/seams.h>

#include "layout.h"
#include "scan.h"

namespace nms::fit_face {

/// The fitted half x >= 0: a net, its seams, and the independent points (units of 10 mm).
struct Model {
  Layout layout;
  runtime::SurfaceNet net;
  std::vector<std::string> nodes;
  runtime::Seams seams;
  std::vector<glm::dvec3> x;

  /// Indices by name; a name that is not there ends the program.
  std::uint32_t curve(const std::string& name) const;
  std::uint32_t surface(const std::string& name) const;

  glm::dvec3 at(const runtime::Row& row) const;
  glm::dvec3 curve_point(std::uint32_t c, double t) const { return at(runtime::curve_row(net, seams, c, t)); }
  glm::dvec3 surface_point(std::uint32_t s, double u, double v) const {
    return at(runtime::surface_row(net, seams, s, u, v));
  }
};

/// Where a place of a surface lies as seen from one of its sides.
struct Beside {
  double across = 0.0;  ///< 0 on that side, 1 on the opposite one
  double along = 0.0;   ///< the side's curve's parameter
};

/// The place (u, v), both from 0 to 1, seen from the side that `curve` owns; {0, 0} where no side is of that curve.
Beside beside(const Model& model, const runtime::NetSurface& surface, const std::string& curve, double u, double v);

/// Greville abscissa of a cubic's control point, from 0 to 1: where on the surface that point pulls most.
double greville(const std::vector<double>& knots, std::size_t point);

/// Rises from 0 at `low` to 1 at `high`, level at both ends.
double smooth_step(double low, double high, double x);

/// Largest distance between a surface's side and the border curve that owns it. [mm]
double seam_gap(const Model& model);

/// Least squares over chosen points, the others held.
class PointSolver {
 public:
  explicit PointSolver(Model& model) : model_(model), free_(model.x.size(), -1) {}
  void release(std::uint32_t point) {
    if (free_[point] < 0) free_[point] = count_++;
  }
  void want(const runtime::Row& row, const glm::dvec3& target, double weight) {
    wants_.push_back({row, target, weight});
  }
  void solve();

 private:
  struct Want {
    runtime::Row row;
    glm::dvec3 target;
    double weight;
  };
  Model& model_;
  std::vector<int> free_;
  int count_ = 0;
  std::vector<Want> wants_;
};

}  // namespace nms::fit_face
