#pragma once

#include <string>

#include <glm/vec3.hpp>

#include <nms/runtime/face_x3d.h>

#include "model.h"

namespace nms::fit_face {

/// Weights of the regions that muscles ask for, at control points: lip_upper, lip_lower, lining, lid_upper_left,
/// lid_lower_left, jaw, neck, nostril, ear.
///
/// Around the mouth and the eyes the layout says which lip or lid a point is of, since position cannot; everywhere else
/// the weights are ramps in space.
class Regions {
 public:
  explicit Regions(const Model& model);

  /// Fill `regions`; the points are there already.
  void add_to(runtime::FaceFileCurve& curve) const;
  void add_to(runtime::FaceFileSurface& surface) const;

 private:
  struct Weights;
  /// A control point of a curve (v = 0) or surface, u and v from 0 to 1, at p [mm].
  Weights weights(const std::string& name, const runtime::NetSurface* surface, double u, double v,
                  const glm::dvec3& p) const;
  void around_mouth(const std::string& name, const runtime::NetSurface* surface, double u, double v, Weights& w) const;
  void around_eye(const std::string& name, const runtime::NetSurface* surface, double u, double v, Weights& w) const;

  const Model& model_;
  double mouth_corner_;
};

}  // namespace nms::fit_face
