#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <nms/runtime/sparse_matrix.h>

namespace nms::runtime {

/// The rigid frame a mesh rides on. `torso` carries the bust, `head` turns on the torso, the others turn in the head.
enum class Frame : std::uint8_t { torso, head, jaw, eye_left, eye_right };

/// A surface's look; glTF's metallic-roughness model.
struct Material {
  std::string name;
  glm::vec4 base_color{1.0F};  ///< linear RGBA, [0, 1]
  float roughness = 0.6F;      ///< [0, 1]
  float metallic = 0.0F;       ///< [0, 1]
  bool double_sided = false;
};

/// Triangles of one material; indices into the vertices of the mesh that holds it, counter-clockwise from outside.
struct Primitive {
  std::uint32_t material = 0;  ///< index into Face::materials
  std::vector<std::uint32_t> triangles;
};

/// The face's deformable skin: positions = T x + offset.
///
/// `x` are the independent points: what muscles move, and nothing else. Seams cannot open, because a vertex on a seam
/// is one row of T. A polygon face is the same thing with T = 1.
struct Skin {
  std::vector<glm::dvec3> points;     ///< P independent points at rest                              [m]
  SparseMatrix surface;               ///< T, V x P, each row sums to 1
  std::vector<glm::vec3> offsets;     ///< V, added to T x (a brow's shell stands off the skin)       [m]
  std::vector<glm::vec3> colors;      ///< V, linear RGB factor on the material's colour, or empty    [0, 1]
  std::vector<Primitive> primitives;  ///< share the V vertices
};

/// A part that rides on a frame: an eyeball, a row of teeth. The tongue is one too, and the only one that bends.
struct RigidMesh {
  std::string name;
  Frame frame = Frame::head;
  std::vector<glm::vec3> positions;  ///< at rest, in the face's coordinates  [m]
  std::vector<glm::vec3> normals;    ///< unit
  std::vector<glm::vec3> colors;     ///< as Skin::colors
  std::vector<Primitive> primitives;
};

/// A face without its muscles: geometry at rest, and the places on it that its geometry tells.
///
/// Metres, +x the subject's left, +y up, +z forward (glTF 2.0, 3.4). Owns everything; immutable once read.
struct Face {
  Skin skin;
  std::vector<RigidMesh> rigid;
  std::vector<Material> materials;

  /// Named weights over the independent points, P each, in [0, 1]: "lip_upper", "lid_lower_left", "lining" ...
  /// A muscle may be held to a region, or kept out of one, where position alone cannot tell (lips touch at rest).
  std::map<std::string, std::vector<float>> regions;

  /// Landmarks by name, where the geometry says where they are: vertices, places on surfaces, centres of eyeballs.
  /// They go before a program's own positions.  [m]
  std::map<std::string, glm::dvec3, std::less<>> landmarks;
};

}  // namespace nms::runtime
