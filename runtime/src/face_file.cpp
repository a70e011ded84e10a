#include <nms/runtime/face_file.h>

#include <limits>
#include <string>

#include <glm/geometric.hpp>

#include <nms/runtime/face_x3d.h>

#include "face_regions.h"
#include "face_scene.h"

namespace nms::runtime {

namespace {

using program::Failure;

enum class Format { unknown, x3d, vrml, obj, gltf };

bool starts_with(std::string_view text, std::string_view head) { return text.substr(0, head.size()) == head; }

bool ends_with(std::string_view text, std::string_view tail) {
  if (text.size() < tail.size()) return false;
  text.remove_prefix(text.size() - tail.size());
  for (std::size_t i = 0; i < tail.size(); ++i) {
    const char c = text[i];
    if ((c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c) != tail[i]) return false;
  }
  return true;
}

Format format_of(std::string_view bytes, std::string_view name) {
  if (starts_with(bytes, "\xEF\xBB\xBF")) bytes.remove_prefix(3);
  if (starts_with(bytes, "glTF")) return Format::gltf;
  if (starts_with(bytes, "#VRML") || starts_with(bytes, "#X3D")) return Format::vrml;
  if (ends_with(name, ".x3dv") || ends_with(name, ".wrl") || ends_with(name, ".vrml")) return Format::vrml;
  if (ends_with(name, ".obj")) return Format::obj;
  if (ends_with(name, ".gltf") || ends_with(name, ".glb")) return Format::gltf;
  if (ends_with(name, ".x3d") || ends_with(name, ".xml") || starts_with(bytes, "<")) return Format::x3d;
  return Format::unknown;
}

}  // namespace

tl::expected<Face, Failure> read_face(std::string_view bytes, std::string_view name, const FaceForm& form) {
  switch (format_of(bytes, name)) {
    case Format::x3d:
      return read_nurbs_face(bytes, name, NurbsText::xml, form);
    case Format::vrml:
      return read_nurbs_face(bytes, name, NurbsText::vrml, form);
    case Format::obj: {
      const auto mesh = read_obj(bytes, name);
      if (!mesh) return tl::unexpected(mesh.error());
      return make_polygon_face(*mesh, name, form);
    }
    case Format::gltf: {
      const auto mesh = read_gltf_mesh(bytes, name);
      if (!mesh) return tl::unexpected(mesh.error());
      return make_polygon_face(*mesh, name, form);
    }
    case Format::unknown:
      break;
  }
  return tl::unexpected(Failure{"face_unknown_format", std::string(name), "it is none of the kinds of file read",
                                "give .x3d, .x3dv or .wrl with NURBS surfaces, or .obj, .gltf or .glb with polygons"});
}

Landmarks landmarks_of(const Face& face, const program::Program& program) {
  Landmarks all;
  for (const program::Landmark& l : program.landmarks) {
    if (l.vertex == program::kNone && l.surface == program::StringId{})
      all[std::string(program.string(l.name))] = {l.position[0], l.position[1], l.position[2]};
  }
  for (const auto& [name, p] : face.landmarks) all[name] = p;
  return all;
}

std::string nearest_landmark(const Landmarks& landmarks, const glm::dvec3& place) {
  std::string nearest = "face";
  double least = std::numeric_limits<double>::max();
  for (const auto& [name, landmark] : landmarks) {
    const double away = glm::distance(landmark, place);
    if (away >= least) continue;
    least = away;
    nearest = name;
  }
  return nearest;
}

}  // namespace nms::runtime
