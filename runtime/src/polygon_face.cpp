// Polygons to a face: which triangles are which part, where the landmarks are, eyeballs, what rides on the skin.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <nms/program/enum_names.h>
#include <nms/runtime/face_file.h>
#include <nms/runtime/muscle.h>
#include <nms/runtime/rig.h>

#include "eyeball.h"
#include "face_regions.h"
#include "sphere_fit.h"
#include "surface_graph.h"

namespace nms::runtime {

namespace {

using program::FacePartKind;
using program::Failure;
using Maybe = std::optional<Failure>;

constexpr std::uint32_t kNone = program::kNone;

/// How a part looks where its file does not say, and the frame it rides on.
struct PartLook {
  const char* material;
  glm::vec4 color;  // linear
  float roughness;
  Frame frame;
};

PartLook look_of(FacePartKind kind) {
  switch (kind) {
    case FacePartKind::skin:
      return {"skin", {0.62F, 0.37F, 0.27F, 1.0F}, 0.55F, Frame::head};
    case FacePartKind::lashes:
      return {"lashes", {0.03F, 0.02F, 0.015F, 1.0F}, 0.7F, Frame::head};
    case FacePartKind::brows:
      return {"brow", {0.05F, 0.031F, 0.021F, 1.0F}, 0.7F, Frame::head};
    case FacePartKind::eye_left:
      return {"sclera", {0.78F, 0.76F, 0.73F, 1.0F}, 0.25F, Frame::eye_left};
    case FacePartKind::eye_right:
      return {"sclera", {0.78F, 0.76F, 0.73F, 1.0F}, 0.25F, Frame::eye_right};
    case FacePartKind::teeth_upper:
      return {"teeth", {0.75F, 0.70F, 0.60F, 1.0F}, 0.3F, Frame::head};
    case FacePartKind::gums_upper:
      return {"gums", {0.45F, 0.14F, 0.13F, 1.0F}, 0.4F, Frame::head};
    case FacePartKind::teeth_lower:
      return {"teeth", {0.75F, 0.70F, 0.60F, 1.0F}, 0.3F, Frame::jaw};
    case FacePartKind::gums_lower:
      return {"gums", {0.45F, 0.14F, 0.13F, 1.0F}, 0.4F, Frame::jaw};
    case FacePartKind::tongue:
      return {"tongue", {0.50F, 0.17F, 0.16F, 1.0F}, 0.45F, Frame::jaw};
    case FacePartKind::head:
      return {"hair", {0.035F, 0.021F, 0.014F, 1.0F}, 0.7F, Frame::head};
  }
  return {"skin", glm::vec4(1.0F), 0.6F, Frame::head};
}

// Lashes and brows look for the skin next to them; more pairs than this take too long.
constexpr double kMostPairs = 2e9;

bool is_eye(FacePartKind kind) { return kind == FacePartKind::eye_left || kind == FacePartKind::eye_right; }
bool deforms(FacePartKind kind) {
  return kind == FacePartKind::skin || kind == FacePartKind::lashes || kind == FacePartKind::brows;
}

using Triangle = std::array<std::uint32_t, 3>;

class PolygonFace {
 public:
  PolygonFace(const PolygonMesh& mesh, std::string_view name, const FaceForm& form)
      : mesh_(mesh), name_(name), form_(form), point_(mesh.positions.size(), kNone) {}

  tl::expected<Face, Failure> run() {
    const glm::dmat4 turn = file_to_face(form_);
    for (const glm::dvec3& p : mesh_.positions) places_.emplace_back(turn * glm::dvec4(p, 1.0));
    if (auto failure = choose()) return tl::unexpected(std::move(*failure));
    if (auto failure = find_landmarks()) return tl::unexpected(std::move(*failure));
    add_deforming(FacePartKind::skin);
    finish_skin();
    for (const auto& [kind, pieces] : chosen_)
      if (!deforms(kind)) add_rigid(kind);
    Landmarks all;
    for (const FaceForm::Place& place : form_.landmarks)
      if (place.vertex == kNone && place.surface.empty()) all[place.name] = place.position;
    for (const auto& [landmark, p] : face_.landmarks) all[landmark] = p;
    add_regions(face_, all);
    paint(all);
    for (const FacePartKind kind : {FacePartKind::lashes, FacePartKind::brows})
      if (auto failure = ride_on_skin(kind)) return tl::unexpected(std::move(*failure));
    return std::move(face_);
  }

 private:
  struct Chosen {
    const PolygonMesh::Piece* piece = nullptr;
    std::vector<Triangle> triangles;
  };

  std::uint32_t one(std::uint32_t v) const { return mesh_.same_place.empty() ? v : mesh_.same_place[v]; }

  bool within(const Triangle& t) const {
    if (!form_.bounded) return true;
    for (const std::uint32_t v : t)
      for (int k = 0; k < 3; ++k)
        if (places_[v][k] < form_.low[k] || places_[v][k] > form_.high[k]) return false;
    return true;
  }

  static bool named(const FaceForm::Part& part, const PolygonMesh::Piece& piece) {
    // What has no name is part of "all" too.
    return part.name.empty() || part.name == "*" || std::any_of(piece.names.begin(), piece.names.end(),
                                            [&](const std::string& n) { return fits(part.name, n); });
  }

  /// Every triangle to the first part that it fits.
  Maybe choose() {
    std::vector<bool> found(form_.parts.size(), false);
    for (const PolygonMesh::Piece& piece : mesh_.pieces) {
      std::vector<std::size_t> open;
      for (std::size_t i = 0; i < form_.parts.size(); ++i)
        if (named(form_.parts[i], piece)) open.push_back(i);
      for (const Triangle& t : piece.triangles) {
        FacePartKind kind = FacePartKind::skin;
        if (!form_.parts.empty()) {
          const auto fit = std::find_if(open.begin(), open.end(), [&](std::size_t i) {
            const FaceForm::Part& p = form_.parts[i];
            return std::all_of(t.begin(), t.end(), [&](std::uint32_t v) { return v >= p.first && v <= p.last; });
          });
          if (fit == open.end()) continue;
          found[*fit] = true;
          kind = form_.parts[*fit].kind;
        }
        const Triangle u{one(t[0]), one(t[1]), one(t[2])};
        if (u[0] == u[1] || u[1] == u[2] || u[0] == u[2]) continue;
        if (deforms(kind) && !within(u)) {
          for (const std::uint32_t v : u) {
            outside_low_ = glm::min(outside_low_, places_[v]);
            outside_high_ = glm::max(outside_high_, places_[v]);
          }
          continue;
        }
        std::vector<Chosen>& pieces = chosen_[kind];
        if (pieces.empty() || pieces.back().piece != &piece) pieces.push_back({&piece, {}});
        pieces.back().triangles.push_back(u);
      }
    }
    for (std::size_t i = 0; i < found.size(); ++i) {
      if (found[i]) continue;
      const FaceForm::Part& p = form_.parts[i];
      return Failure{"face_no_part", fmt::format("{}: part {}", name_, program::enum_name(p.kind)),
                     p.name.empty() ? fmt::format("no triangle has its vertices from {} to {}", p.first, p.last)
                                    : fmt::format("the file has nothing named \"{}\" there", p.name),
                     fmt::format("its names are: {}", known_names())};
    }
    if (chosen_[FacePartKind::skin].empty()) {
      if (outside_low_.x <= outside_high_.x) {
        const glm::dvec3 a = 1e3 * outside_low_, b = 1e3 * outside_high_;
        return Failure{"face_no_part", std::string(name_),
                       fmt::format("no skin is left: it lies from ({:.0f}mm, {:.0f}mm, {:.0f}mm) to ({:.0f}mm, "
                                   "{:.0f}mm, {:.0f}mm), not in `within`",
                                   a.x, a.y, a.z, b.x, b.y, b.z),
                       "see that `unit`, `up`, `forward` and `origin` fit the file: a head is some 230mm high"};
      }
      return Failure{"face_no_part", std::string(name_), "no skin is left", "say which part is the skin"};
    }
    return std::nullopt;
  }

  std::string known_names() const {
    constexpr std::size_t kMost = 12;
    std::vector<std::string> names;
    for (const PolygonMesh::Piece& piece : mesh_.pieces)
      for (const std::string& n : piece.names)
        if (names.size() <= kMost && std::find(names.begin(), names.end(), n) == names.end()) names.push_back(n);
    const bool many = names.size() > kMost;
    if (many) names.pop_back();
    return names.empty() ? "none" : fmt::format("{}{}", fmt::join(names, ", "), many ? ", ..." : "");
  }

  Maybe find_landmarks() {
    for (const FaceForm::Place& place : form_.landmarks) {
      if (!place.surface.empty()) {
        return Failure{"face_bad_landmark", fmt::format("{}: landmark {}", name_, place.name),
                       "polygons have no surfaces to count u and v on", "say its vertex, or its position"};
      }
      if (place.vertex == kNone) continue;
      if (place.vertex >= places_.size()) {
        return Failure{"face_bad_landmark", fmt::format("{}: landmark {}", name_, place.name),
                       fmt::format("there is no vertex {}: the last is {}", place.vertex, places_.size() - 1),
                       "vertices count from 0, in the file's order"};
      }
      face_.landmarks[place.name] = places_[place.vertex];
    }
    return std::nullopt;
  }

  std::uint32_t material(FacePartKind kind, const PolygonMesh::Piece& piece) {
    const PartLook look = look_of(kind);
    Material made{look.material, piece.color.value_or(look.color), look.roughness, 0.0F, kind == FacePartKind::lashes};
    for (std::uint32_t i = 0; i < face_.materials.size(); ++i)
      if (face_.materials[i].name == made.name && face_.materials[i].base_color == made.base_color) return i;
    face_.materials.push_back(made);
    return static_cast<std::uint32_t>(face_.materials.size() - 1);
  }

  static std::vector<std::uint32_t>& triangles_of(std::vector<Primitive>& primitives, std::uint32_t material) {
    for (Primitive& p : primitives)
      if (p.material == material) return p.triangles;
    primitives.push_back({material, {}});
    return primitives.back().triangles;
  }

  void add_deforming(FacePartKind kind) {
    const auto at = chosen_.find(kind);
    if (at == chosen_.end()) return;
    // In the file's order, so that indices go up with its own.
    std::vector<std::uint32_t> used;
    for (const Chosen& c : at->second)
      for (const Triangle& t : c.triangles) used.insert(used.end(), t.begin(), t.end());
    std::sort(used.begin(), used.end());
    used.erase(std::unique(used.begin(), used.end()), used.end());
    Skin& skin = face_.skin;
    for (const std::uint32_t v : used) {
      point_[v] = static_cast<std::uint32_t>(skin.points.size());
      skin.points.push_back(places_[v]);
    }
    for (const Chosen& c : at->second) {
      painted_by_file_ = painted_by_file_ || (kind == FacePartKind::skin && c.piece->color.has_value());
      std::vector<std::uint32_t>& out = triangles_of(skin.primitives, material(kind, *c.piece));
      for (const Triangle& t : c.triangles) out.insert(out.end(), {point_[t[0]], point_[t[1]], point_[t[2]]});
    }
  }

  void finish_skin() {
    Skin& skin = face_.skin;
    const auto count = static_cast<std::uint32_t>(skin.points.size());
    skin.surface.rows = skin.surface.columns = count;
    skin.surface.value.assign(count, 1.0F);
    skin.surface.row_begin.clear();
    skin.surface.column.clear();
    for (std::uint32_t i = 0; i <= count; ++i) skin.surface.row_begin.push_back(i);
    for (std::uint32_t i = 0; i < count; ++i) skin.surface.column.push_back(i);
    skin.offsets.assign(count, glm::vec3(0.0F));
  }

  void add_rigid(FacePartKind kind) {
    const PartLook look = look_of(kind);
    RigidMesh mesh;
    mesh.name = std::string(program::enum_name(kind));
    mesh.frame = look.frame;
    std::map<std::uint32_t, std::uint32_t> index;
    for (const Chosen& c : chosen_[kind]) {
      std::vector<std::uint32_t>& out = triangles_of(mesh.primitives, material(kind, *c.piece));
      for (const Triangle& t : c.triangles) {
        for (const std::uint32_t v : t) {
          const auto [found, fresh] = index.try_emplace(v, static_cast<std::uint32_t>(mesh.positions.size()));
          if (fresh) mesh.positions.emplace_back(places_[v]);
          out.push_back(found->second);
        }
      }
    }
    mesh.normals.resize(mesh.positions.size());
    area_weighted_normals(mesh.primitives, mesh.positions, mesh.normals);
    if (is_eye(kind)) {
      const std::string landmark = kind == FacePartKind::eye_left ? "eye_centre_L" : "eye_centre_R";
      const auto sphere = fit_sphere(mesh.positions);
      if (sphere) face_.landmarks.try_emplace(landmark, sphere->centre);
      // A ball of one look, or a clear shell about another, has no iris to see: it gets one.
      if (sphere && !painted_by_file_) mesh = make_eyeball(*sphere, mesh.name, mesh.frame, face_.materials);
    }
    face_.rigid.push_back(std::move(mesh));
  }

  // Skin of one colour shows neither lips nor brows, which is what a face is read by: they are painted on, as factors
  // on the skin's colour.
  void paint(const Landmarks& all) {
    constexpr glm::vec3 kRed(0.76F, 0.47F, 0.55F);
    constexpr glm::vec3 kLining(0.45F, 0.17F, 0.20F);
    constexpr glm::vec3 kThroat(0.10F, 0.03F, 0.04F);  // little light comes there
    constexpr double kThroatFrom = 0.008;              // behind the lips [m], times the face's size
    constexpr double kThroatAll = 0.050;
    constexpr glm::vec3 kHair(0.16F, 0.15F, 0.16F);
    constexpr double kBrowFull = 0.0022;  // half the height of a brow [m], times the face's size
    constexpr double kBrowEdge = 0.0050;
    if (painted_by_file_) return;
    Skin& skin = face_.skin;
    skin.colors.assign(skin.points.size(), glm::vec3(1.0F));
    const auto red = face_.regions.find("vermilion");
    const auto lining = face_.regions.find("lining");
    const auto lips = all.find("stomion");
    const double size = face_scale(all).length;
    std::vector<std::pair<glm::dvec3, glm::dvec3>> strokes;
    for (const char* side : {"_L", "_R"}) {
      const glm::dvec3* before = nullptr;
      for (const char* name : {"brow_inner", "brow_mid", "brow_outer"}) {
        const auto at = all.find(std::string(name) + side);
        if (at == all.end()) continue;
        if (before != nullptr) strokes.emplace_back(*before, at->second);
        before = &at->second;
      }
    }
    if (chosen_.contains(FacePartKind::brows)) strokes.clear();
    if (lips != all.end()) shade_tongue(lips->second.z, size);
    for (std::size_t i = 0; i < skin.points.size(); ++i) {
      if (red != face_.regions.end() && lining != face_.regions.end()) {
        const double deep = lips == all.end() ? 0.0 : (lips->second.z - skin.points[i].z) / size;
        const glm::vec3 inside =
            glm::mix(kLining, kThroat, static_cast<float>(smooth_rise(kThroatFrom, kThroatAll, deep)));
        skin.colors[i] = glm::mix(glm::vec3(1.0F), glm::mix(kRed, inside, lining->second[i]), red->second[i]);
      }
      double nearest = kBrowEdge * size;
      for (const auto& [a, b] : strokes) nearest = std::min(nearest, to_stroke(skin.points[i], a, b));
      const double hair = smooth_fall((nearest / size - kBrowFull) / (kBrowEdge - kBrowFull));
      skin.colors[i] = glm::mix(skin.colors[i], kHair, static_cast<float>(hair));
    }
  }

  // As the skin of the mouth's depth. The tip comes out into the light.
  void shade_tongue(double lips_z, double size) {
    constexpr float kDark = 0.2F;
    constexpr double kFrom = 0.018;  // behind the lips [m], times the face's size
    constexpr double kAll = 0.060;
    for (RigidMesh& mesh : face_.rigid) {
      if (mesh.name != program::enum_name(FacePartKind::tongue)) continue;
      mesh.colors.clear();
      for (const glm::vec3& p : mesh.positions) {
        const double deep = (lips_z - static_cast<double>(p.z)) / size;
        mesh.colors.emplace_back(1.0F - (1.0F - kDark) * static_cast<float>(smooth_rise(kFrom, kAll, deep)));
      }
    }
  }

  static double to_stroke(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b) {
    const glm::dvec3 way = b - a;
    const double t = std::clamp(glm::dot(p - a, way) / std::max(glm::dot(way, way), 1e-12), 0.0, 1.0);
    return glm::length(p - (a + t * way));
  }

  // Lashes and brows go as the skin next to them does.
  Maybe ride_on_skin(FacePartKind kind) {
    const std::size_t skin = face_.skin.points.size();
    add_deforming(kind);
    const std::size_t riders = face_.skin.points.size() - skin;
    if (riders == 0) return std::nullopt;
    if (static_cast<double>(riders) * static_cast<double>(skin) > kMostPairs) {
      return Failure{"face_too_large", fmt::format("{}: part {}", name_, program::enum_name(kind)),
                     fmt::format("{} vertices ride on {}", riders, skin),
                     "make them part of the skin, or simplify them"};
    }
    finish_skin();
    if (!face_.skin.colors.empty()) face_.skin.colors.resize(face_.skin.points.size(), glm::vec3(1.0F));
    for (auto& [region, weights] : face_.regions) weights.resize(face_.skin.points.size(), 0.0F);
    for (std::size_t i = skin; i < face_.skin.points.size(); ++i) {
      std::size_t best = 0;
      double least = SurfaceGraph::kFar;
      for (std::size_t k = 0; k < skin; ++k) {
        const glm::dvec3 d = face_.skin.points[k] - face_.skin.points[i];
        const double squared = d.x * d.x + d.y * d.y + d.z * d.z;
        if (squared < least) {
          least = squared;
          best = k;
        }
      }
      for (auto& [region, weights] : face_.regions) weights[i] = weights[best];
    }
    return std::nullopt;
  }

  const PolygonMesh& mesh_;
  std::string_view name_;
  const FaceForm& form_;
  std::vector<glm::dvec3> places_;    // by vertex of the file, in the face [m]
  std::vector<std::uint32_t> point_;  // of the skin, by vertex of the file
  std::map<FacePartKind, std::vector<Chosen>> chosen_;
  bool painted_by_file_ = false;  // the file gives the skin a colour of its own
  glm::dvec3 outside_low_{1e9};   // skin that is not in `within` [m]
  glm::dvec3 outside_high_{-1e9};
  Face face_;
};

}  // namespace

tl::expected<Face, Failure> make_polygon_face(const PolygonMesh& mesh, std::string_view name, const FaceForm& form) {
  return PolygonFace(mesh, name, form).run();
}

}  // namespace nms::runtime
