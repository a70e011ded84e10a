#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include <tl/expected.hpp>

#include <nms/picture/image.h>

/// Triangles to pixels: rays on the CPU (Embree), no window and no graphics card. Nothing here knows what a face is.
namespace nms::picture {

/// A surface of one colour. Owns its arrays; indices are checked by `render`.
struct Mesh {
  std::vector<glm::vec3> positions;      ///< V                                                        [m]
  std::vector<glm::vec3> normals;        ///< V, unit
  std::vector<glm::vec3> colors;         ///< V linear RGB factors on `color`, or empty                [0, 1]
  std::vector<std::uint32_t> triangles;  ///< 3 for each triangle, counter-clockwise from outside
  glm::vec3 color{0.8F};                 ///< linear RGB                                               [0, 1]
  float roughness = 0.6F;                ///< of the highlight, as in glTF                             [0, 1]
  bool two_sided = false;                ///< seen, and lit, from behind too
  float translucence = 0.0F;             ///< how far light wraps round it, as it does in skin         [0, 1]
};

/// Where the picture is taken from: a long lens, turned about the target.
struct Camera {
  glm::vec3 target{0.0F};  ///< middle of the picture                                                 [m]
  float height_m = 0.3F;   ///< what the picture's height shows at the target                         [m]
  float yaw_rad = 0.0F;    ///< 0 looks along -z; + shows the side that +x points to
  float pitch_rad = 0.0F;  ///< + looks down from above
};

struct RenderOptions {
  int width = 360;    ///< [px]
  int height = 450;   ///< [px]
  int threads = 1;    ///< the picture is the same for any number
  int sky_rays = 32;  ///< for each vertex, over the hemisphere: what is near darkens it. Most of the work.
  int key_rays = 12;  ///< for each vertex, over the key light's disc: soft shadows. Below 65535
};

/// Why there is no picture.
struct RenderFailure {
  std::string cause;
  std::string remedy = "make the pictures smaller";
};

/// One scene seen by several cameras: light, and how much of it reaches each vertex that is seen, is worked out once.
///
/// Key light from the upper left of the picture of a face seen from the front, a wide fill from the front, a rim
/// from behind, and a sky darkened by what surrounds a point (ambient occlusion over 50 mm). Shadows are soft: each
/// vertex looks at points over the discs of key and fill. Nine rays a pixel.
///
/// Failures: an index past the vertices, arrays of different lengths, a picture without pixels, Embree not installed,
/// Embree's own. Deterministic on one machine; the last bits of a pixel may differ between processors.
[[nodiscard]] tl::expected<std::vector<Image>, RenderFailure> render(const std::vector<Mesh>& meshes,
                                                                     const std::vector<Camera>& cameras,
                                                                     const RenderOptions& options);

}  // namespace nms::picture
