#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include <nms/runtime/nurbs.h>
#include <nms/runtime/seams.h>

namespace nms::runtime {

struct TessellationSettings {
  double density = 1.0;                  ///< factor on every surface's own samples per span, (0, 16]
  std::uint32_t max_vertices = 400'000;  ///< a file that asks for more is refused
};

/// Samples per knot span, at least 1.
struct SurfaceSamples {
  std::uint32_t u = 2;
  std::uint32_t v = 2;
};

/// Where a vertex was first made.
struct VertexPlace {
  std::uint32_t surface = 0;
  double u = 0.0;
  double v = 0.0;
};

/// Triangles of a net. Vertices are rows over the independent points: T = B S.
///
/// A vertex on a curve is made once, from the curve, and shared by index by all surfaces there; inside each surface
/// lies a regular grid, and a zipper strip joins its rim to the curves' vertices, so neighbours may differ in density.
struct NetMesh {
  std::vector<Row> vertices;
  std::vector<VertexPlace> places;                    ///< one for each vertex
  std::vector<std::vector<std::uint32_t>> triangles;  ///< [surface], counter-clockwise seen from cross(du, dv)
};

/// How many vertices tessellate() makes at most; cheap, and safe for any numbers.
double vertex_bound(const SurfaceNet& net, const std::vector<SurfaceSamples>& samples);

/// Deterministic: the same net gives the same bits.
/// @param points  the independent points at rest, or empty: then edges across follow the parameters, with them the
///                shorter is taken
/// @pre seams = build_seams(net); one entry of `samples` for each surface
NetMesh tessellate(const SurfaceNet& net, const Seams& seams, const std::vector<SurfaceSamples>& samples,
                   std::span<const glm::dvec3> points = {});

/// Parameters of the grid lines: every span cut into `samples` equal parts, both ends included.
std::vector<double> grid_lines(const std::vector<double>& knots, int degree, std::uint32_t samples);

}  // namespace nms::runtime
