#pragma once

#include <cstddef>

#include <nms/runtime/face.h>

#include "layout.h"
#include "scan.h"

namespace nms::fit_face {

/// Distances of many places to the nearest point of the other thing. [mm]
struct Distances {
  std::size_t count = 0;
  double mean = 0.0;
  double p99 = 0.0;
  double max = 0.0;
};

/// How far a face is from the scan that it was fitted to. The half x >= 0 is measured, both ways: scan to surface finds
/// missing detail, surface to scan finds folds and twists.
struct Figures {
  Distances scan_to_surface;  ///< vertices 0 to 9408 of the scan: face, ears, nostrils, inner lips
  Distances surface_to_scan;  ///< the skin's vertices, without the bust's last ring
};

/// Left out both ways: the lids' backs, built by rule, and the eyes' sockets. Shells (brows, hair) are no skin.
/// @param face  tessellated finely: see kMeasuringDensity
Figures measure(const Scan& scan, const Layout& layout, const runtime::Face& face);

/// Factor on the samples of a face that is measured: chords then lie less than 0.02 mm off the surface.
inline constexpr double kMeasuringDensity = 3.0;

/// Triangles of the skin that face away from the normals at their corners (cosine with the mean below 0): where the
/// surface folds, or the mesh has slivers turned over.
std::size_t count_folds(const runtime::Face& face);

}  // namespace nms::fit_face
