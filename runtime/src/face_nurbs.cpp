// A face of NURBS surfaces by its declaration: units and axes, parts by the surfaces' names, places on surfaces.
#include <algorithm>
#include <cmath>
#include <string>

#include <fmt/format.h>
#include <glm/mat3x3.hpp>

#include <nms/program/enum_names.h>
#include <nms/runtime/face_file.h>
#include <nms/runtime/nurbs.h>

#include "face_regions.h"
#include "face_scene.h"
#include "sphere_fit.h"

namespace nms::runtime {

namespace {

using program::FacePartKind;
using program::Failure;
using Maybe = std::optional<Failure>;

/// The frame of a part's surfaces; empty: they deform.
std::string frame_of(FacePartKind kind) {
  switch (kind) {
    case FacePartKind::skin:
    case FacePartKind::lashes:
    case FacePartKind::brows:
      return {};
    case FacePartKind::eye_left:
      return "eye_left";
    case FacePartKind::eye_right:
      return "eye_right";
    case FacePartKind::teeth_upper:
    case FacePartKind::gums_upper:
    case FacePartKind::head:
      return "head";
    case FacePartKind::teeth_lower:
    case FacePartKind::gums_lower:
    case FacePartKind::tongue:
      return "jaw";
  }
  return {};
}

Failure no_part(std::string_view file, const FaceForm::Part& part, const FaceScene& scene) {
  std::string names;
  for (std::size_t i = 0; i < scene.file.surfaces.size() && i < 12; ++i)
    names += (names.empty() ? "" : ", ") + scene.file.surfaces[i].geometry.name;
  return {"face_no_part", fmt::format("{}: part {}", file, program::enum_name(part.kind)),
          fmt::format("no surface is named \"{}\"", part.name), fmt::format("its surfaces are: {}", names)};
}

Maybe name_parts(FaceScene& scene, std::string_view file, const FaceForm& form) {
  if (form.parts.empty()) return std::nullopt;
  std::vector<bool> kept(scene.file.surfaces.size(), false);
  std::vector<bool> found(form.parts.size(), false);
  for (std::size_t s = 0; s < scene.file.surfaces.size(); ++s) {
    FaceFileSurface& surface = scene.file.surfaces[s];
    for (std::size_t i = 0; i < form.parts.size(); ++i) {
      const FaceForm::Part& part = form.parts[i];
      if (!part.name.empty() && !fits(part.name, surface.geometry.name)) continue;
      found[i] = kept[s] = true;
      surface.frame = frame_of(part.kind);
      surface.part = std::string(program::enum_name(part.kind));
      break;
    }
  }
  for (std::size_t i = 0; i < found.size(); ++i)
    if (!found[i]) return no_part(file, form.parts[i], scene);
  scene.uses.erase(
      std::remove_if(scene.uses.begin(), scene.uses.end(), [&](const SurfaceUse& use) { return !kept[use.surface]; }),
      scene.uses.end());
  return std::nullopt;
}

/// Of several uses of a surface, the one whose place lies furthest to the side wanted.
Maybe place_on_surface(const FaceScene& scene, std::string_view file, const FaceForm::Place& place, Face& face) {
  const bool right = place.name.ends_with("_R");
  bool found = false;
  glm::dvec3 best(0.0);
  for (const SurfaceUse& use : scene.uses) {
    const FaceFileSurface& surface = scene.file.surfaces[use.surface];
    const NetSurface& g = surface.geometry;
    if (g.name != place.surface) continue;
    const NurbsSurface nurbs{g.degree_u, g.degree_v, g.count_u(),    g.count_v(),
                             g.knots_u,  g.knots_v,  surface.points, g.weights};
    const auto at = [](const std::vector<double>& knots, int degree, std::size_t count, double share) {
      const double low = knots[static_cast<std::size_t>(degree)];
      return low + share * (knots[count] - low);
    };
    const glm::dvec3 p = evaluate(nurbs, at(g.knots_u, g.degree_u, g.count_u(), place.position.x),
                                  at(g.knots_v, g.degree_v, g.count_v(), place.position.y))
                             .point;
    const glm::dvec3 here(scene.transforms[use.transform] * glm::dvec4(p, 1.0));
    if (!found || (right ? here.x < best.x : here.x > best.x)) best = here;
    found = true;
  }
  if (!found) {
    return Failure{"face_bad_landmark", fmt::format("{}: landmark {}", file, place.name),
                   fmt::format("no surface is named \"{}\"", place.surface),
                   "name a surface by its DEF, or say the place's position"};
  }
  face.landmarks[place.name] = best;
  return std::nullopt;
}

void find_eyeballs(Face& face) {
  for (const RigidMesh& mesh : face.rigid) {
    if (mesh.frame != Frame::eye_left && mesh.frame != Frame::eye_right) continue;
    if (const auto sphere = fit_sphere(mesh.positions))
      face.landmarks.try_emplace(mesh.frame == Frame::eye_left ? "eye_centre_L" : "eye_centre_R", sphere->centre);
  }
}

}  // namespace

tl::expected<Face, Failure> read_nurbs_face(std::string_view text, std::string_view name, NurbsText encoding,
                                            const FaceForm& form) {
  auto scene = read_scene_x3d(text, name, encoding, FaceLimits{});
  if (!scene) return tl::unexpected(scene.error());
  const glm::dmat4 turn = file_to_face(form);
  if (turn != glm::dmat4(1.0))
    for (glm::dmat4& t : scene->transforms) t = turn * t;
  if (auto failure = name_parts(*scene, name, form)) return tl::unexpected(std::move(*failure));
  auto face = build_face(*scene, name, TessellationSettings{});
  if (!face) return face;
  for (const FaceForm::Place& place : form.landmarks) {
    if (place.vertex != program::kNone) {
      return tl::unexpected(Failure{"face_bad_landmark", fmt::format("{}: landmark {}", name, place.name),
                                    "a surface has no vertices that its file numbers",
                                    "say the place's position, or where it is on a surface"});
    }
    if (place.surface.empty()) continue;
    if (auto failure = place_on_surface(*scene, name, place, *face)) return tl::unexpected(std::move(*failure));
  }
  if (!form.parts.empty()) find_eyeballs(*face);
  if (!face->regions.empty()) return face;
  Landmarks all = face->landmarks;
  for (const FaceForm::Place& place : form.landmarks)
    if (place.surface.empty()) all[place.name] = place.position;
  add_regions(*face, all);
  return face;
}

}  // namespace nms::runtime
