#include "surface_through.h"

#include <vector>

#include <Eigen/Dense>

#include <nms/runtime/nurbs.h>

namespace nms::fit_face {

namespace {

double abscissa(const std::vector<double>& knots, std::size_t point) {
  return (knots[point + 1] + knots[point + 2] + knots[point + 3]) / 3;
}

// From values at the Greville points to control points.
Eigen::MatrixXd interpolation(const std::vector<double>& knots, std::size_t count) {
  const auto n = static_cast<Eigen::Index>(count);
  Eigen::MatrixXd m = Eigen::MatrixXd::Zero(n, n);
  for (std::size_t i = 0; i < count; ++i) {
    const runtime::BasisValues b = runtime::basis(knots, 3, abscissa(knots, i));
    for (std::size_t j = 0; j <= 3; ++j)
      m(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(b.first + j)) = b.value[j];
  }
  return m.inverse();
}

}  // namespace

runtime::FaceFileSurface surface_through(const std::string& name, std::size_t spans_u, std::size_t spans_v,
                                         const Shape& shape) {
  runtime::FaceFileSurface s;
  s.geometry.name = name;
  s.geometry.knots_u = runtime::clamped_uniform_knots(3, spans_u);
  s.geometry.knots_v = runtime::clamped_uniform_knots(3, spans_v);
  s.mirrored = true;
  const std::vector<double>& ku = s.geometry.knots_u;
  const std::vector<double>& kv = s.geometry.knots_v;
  const std::size_t nu = s.geometry.count_u();
  const std::size_t nv = s.geometry.count_v();
  const Eigen::MatrixXd in_u = interpolation(ku, nu);
  const Eigen::MatrixXd in_v = interpolation(kv, nv);
  s.points.resize(nu * nv);
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::MatrixXd places(static_cast<Eigen::Index>(nu), static_cast<Eigen::Index>(nv));
    for (std::size_t i = 0; i < nu; ++i) {
      for (std::size_t j = 0; j < nv; ++j) {
        places(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
            shape(abscissa(ku, i) / ku.back(), abscissa(kv, j) / kv.back())[axis];
      }
    }
    const Eigen::MatrixXd points = in_u * places * in_v.transpose();
    for (std::size_t j = 0; j < nv; ++j) {
      for (std::size_t i = 0; i < nu; ++i) {
        s.points[j * nu + i][axis] = points(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) / 1000.0;  // m
      }
    }
  }
  return s;
}

}  // namespace nms::fit_face
