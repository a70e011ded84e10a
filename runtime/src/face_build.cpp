#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <set>
#include <tuple>
#include <unordered_map>
#include <utility>

#include <fast_float/fast_float.h>
#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>
#include <pugixml.hpp>

#include <nms/runtime/nurbs.h>
#include <nms/runtime/trigonometry.h>

#include "face_scene.h"

namespace nms::runtime {

namespace {

using program::Failure;
using Maybe = std::optional<Failure>;

constexpr double kSeamTolerance = 2e-5;  // m; a control point printed with five digits still passes

bool ends_with(std::string_view text, std::string_view tail) {
  return text.size() >= tail.size() && text.substr(text.size() - tail.size()) == tail;
}

glm::dvec3 apply(const glm::dmat4& m, const glm::dvec3& p) { return glm::dvec3(m * glm::dvec4(p, 1.0)); }

// The point of triangle abc nearest to p, as weights (Ericson, Real-Time Collision Detection, 5.1.5).
glm::dvec3 nearest_on_triangle(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
  const glm::dvec3 ab = b - a, ac = c - a, ap = p - a;
  const double d1 = glm::dot(ab, ap), d2 = glm::dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
  const glm::dvec3 bp = p - b;
  const double d3 = glm::dot(ab, bp), d4 = glm::dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    const double v = d1 - d3 > 0 ? d1 / (d1 - d3) : 0.0;
    return {1 - v, v, 0};
  }
  const glm::dvec3 cp = p - c;
  const double d5 = glm::dot(ab, cp), d6 = glm::dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    const double w = d2 - d6 > 0 ? d2 / (d2 - d6) : 0.0;
    return {1 - w, 0, w};
  }
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const double sum = (d4 - d3) + (d5 - d6);
    const double w = sum > 0 ? (d4 - d3) / sum : 0.0;
    return {0, 1 - w, w};
  }
  const double denominator = 1.0 / (va + vb + vc);
  const double v = vb * denominator;
  const double w = vc * denominator;
  return {1 - v - w, v, w};
}

class FaceBuilder {
 public:
  FaceBuilder(const FaceScene& scene, std::string_view name, const TessellationSettings& settings)
      : scene_(scene), file_(scene.file), name_(name), settings_(settings) {}

  tl::expected<Face, Failure> run() {
    face_.materials = file_.materials;
    if (auto f = make_net()) return tl::unexpected(std::move(*f));
    number_points();
    add_skin();
    if (auto f = add_shells()) return tl::unexpected(std::move(*f));
    if (auto f = add_rigid()) return tl::unexpected(std::move(*f));
    add_regions();
    finish();
    return std::move(face_);
  }

 private:
  Failure too_large(double count) const {
    return {"face_too_large", std::string(name_), fmt::format("it needs about {:.0f} vertices", count),
            fmt::format("lower the density; at most {} are made", settings_.max_vertices)};
  }

  SurfaceSamples samples_of(const FaceFileSurface& s) const {
    const auto scaled = [&](std::uint32_t n) {
      return static_cast<std::uint32_t>(std::clamp(std::floor(n * settings_.density + 0.5), 1.0, 1024.0));
    };
    return {scaled(s.samples.u), scaled(s.samples.v)};
  }

  Maybe make_net() {
    std::vector<SurfaceSamples> samples;
    net_index_.assign(file_.surfaces.size(), kNoIndex);
    net_.node_count = static_cast<std::uint32_t>(file_.nodes.size());
    for (const FaceFileCurve& c : file_.curves) net_.curves.push_back(c.curve);
    for (std::size_t s = 0; s < file_.surfaces.size(); ++s) {
      const FaceFileSurface& surface = file_.surfaces[s];
      if (!surface.frame.empty() || !surface.rides.empty()) continue;
      net_index_[s] = static_cast<std::uint32_t>(net_.surfaces.size());
      file_index_.push_back(s);
      net_.surfaces.push_back(surface.geometry);
      samples.push_back(samples_of(surface));
    }
    const double bound = vertex_bound(net_, samples);
    if (!(bound <= 8.0 * settings_.max_vertices)) return too_large(bound);
    auto seams = build_seams(net_);
    if (!seams) {
      Failure f = std::move(seams).error();
      f.place = fmt::format("{}: {}", name_, f.place);
      return f;
    }
    seams_ = std::move(*seams);
    if (auto f = rest_points()) return f;
    mesh_ = tessellate(net_, seams_, samples, rest_);
    if (mesh_.vertices.size() > settings_.max_vertices) return too_large(static_cast<double>(mesh_.vertices.size()));
    return std::nullopt;
  }

  glm::dvec3 at(const Row& row) const {
    glm::dvec3 p{0.0};
    for (const RowEntry& e : row) p += e.weight * rest_[e.point];
    return p;
  }

  // x from the file's control points, and proof that the file's other control points are S x.
  Maybe rest_points() {
    std::vector<glm::dvec3> nodes(file_.nodes.size(), glm::dvec3(0.0));
    for (const FaceFileCurve& c : file_.curves) {
      if (c.curve.ends[0].node != kNoIndex) nodes[c.curve.ends[0].node] = c.points.front();
      if (c.curve.ends[1].node != kNoIndex) nodes[c.curve.ends[1].node] = c.points.back();
    }
    for (const PointOwner& o : seams_.points) {
      switch (o.kind) {
        case PointOwner::Kind::node:
          rest_.push_back(nodes[o.owner]);
          break;
        case PointOwner::Kind::curve:
          rest_.push_back(file_.curves[o.owner].points[o.index]);
          break;
        case PointOwner::Kind::surface:
          rest_.push_back(file_.surfaces[file_index_[o.owner]].points[o.index]);
          break;
      }
    }
    const auto apart = [&](const std::string& what, const std::vector<Row>& rows,
                           const std::vector<glm::dvec3>& points) -> Maybe {
      for (std::size_t i = 0; i < rows.size(); ++i) {
        const double gap = glm::length(at(rows[i]) - points[i]);
        if (gap <= kSeamTolerance) continue;
        return Failure{"face_seam_apart", fmt::format("{}: {}", name_, what),
                       fmt::format("control point {} lies {:.3f} mm from where its border puts it", i, gap * 1e3),
                       "move the border curve, not the copy of it in the surface"};
      }
      return std::nullopt;
    };
    for (std::size_t c = 0; c < file_.curves.size(); ++c) {
      if (auto f = apart(fmt::format("curve '{}'", net_.curves[c].name), seams_.curves[c], file_.curves[c].points))
        return f;
    }
    for (std::size_t s = 0; s < net_.surfaces.size(); ++s) {
      if (auto f = apart(fmt::format("surface '{}'", net_.surfaces[s].name), seams_.surfaces[s],
                         file_.surfaces[file_index_[s]].points)) {
        return f;
      }
    }
    return std::nullopt;
  }

  bool mirrors(std::size_t transform) const { return glm::determinant(glm::dmat3(scene_.transforms[transform])) < 0.0; }

  // Independent points of the whole face. Those that one transform leaves where the first put them are shared; they
  // come first, so that a row and its mirror image run in the same order and sum to the same bits.
  void number_points() {
    const std::size_t transforms = scene_.transforms.size();
    std::vector<std::vector<char>> used(transforms, std::vector<char>(seams_.points.size(), 0));
    shown_.assign(transforms, std::vector<char>(mesh_.vertices.size(), 0));
    for (const SurfaceUse& use : scene_.uses) {
      const std::uint32_t s = net_index_[use.surface];
      if (s == kNoIndex) continue;
      for (const std::uint32_t v : mesh_.triangles[s]) {
        if (shown_[use.transform][v]) continue;
        shown_[use.transform][v] = 1;
        for (const RowEntry& e : mesh_.vertices[v]) used[use.transform][e.point] = 1;
      }
    }
    point_id_.assign(transforms, std::vector<std::uint32_t>(seams_.points.size(), kNoIndex));
    shared_.assign(seams_.points.size(), 0);
    const auto add = [&](std::size_t t, std::size_t p) {
      face_.skin.points.push_back(apply(scene_.transforms[t], rest_[p]));
      return static_cast<std::uint32_t>(face_.skin.points.size() - 1);
    };
    first_ = transforms;
    for (std::size_t t = 0; t < transforms && first_ == transforms; ++t) {
      if (std::any_of(used[t].begin(), used[t].end(), [](char c) { return c != 0; })) first_ = t;
    }
    if (first_ == transforms) return;
    for (std::size_t p = 0; p < seams_.points.size(); ++p) {
      if (!used[first_][p]) continue;
      for (std::size_t t = first_ + 1; t < transforms; ++t) {
        if (!used[t][p] || apply(scene_.transforms[t], rest_[p]) != apply(scene_.transforms[first_], rest_[p]))
          continue;
        if (point_id_[first_][p] == kNoIndex) point_id_[first_][p] = add(first_, p);
        point_id_[t][p] = point_id_[first_][p];
        shared_[p] = 1;
      }
    }
    for (std::size_t t = 0; t < transforms; ++t) {
      for (std::size_t p = 0; p < seams_.points.size(); ++p) {
        if (used[t][p] && point_id_[t][p] == kNoIndex) point_id_[t][p] = add(t, p);
      }
    }
  }

  bool is_shared(const Row& row, std::size_t t) const {
    for (const RowEntry& e : row) {
      if (point_id_[t][e.point] != point_id_[first_][e.point]) return false;
    }
    return true;
  }

  std::uint32_t add_vertex(const Row& row, std::size_t t, const glm::dvec3& offset, const glm::vec3& tint) {
    std::vector<std::pair<std::uint32_t, double>> entries;
    for (const RowEntry& e : row) entries.emplace_back(point_id_[t][e.point], e.weight);
    std::stable_sort(entries.begin(), entries.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    SparseMatrix& m = face_.skin.surface;
    const std::size_t begin = m.value.size();
    std::size_t largest = begin;
    for (const auto& [column, weight] : entries) {
      const auto value = static_cast<float>(weight);
      if (value == 0.0F) continue;
      m.column.push_back(column);
      m.value.push_back(value);
      if (std::abs(value) > std::abs(m.value[largest])) largest = m.value.size() - 1;
    }
    double rest = 1.0;
    for (std::size_t i = begin; i < m.value.size(); ++i) {
      if (i != largest) rest -= static_cast<double>(m.value[i]);
    }
    m.value[largest] = static_cast<float>(rest);  // rounding to single precision must not move the face
    m.row_begin.push_back(static_cast<std::uint32_t>(m.value.size()));
    face_.skin.offsets.emplace_back(glm::vec3(offset));
    face_.skin.colors.push_back(tint);
    return static_cast<std::uint32_t>(face_.skin.offsets.size() - 1);
  }

  glm::vec3 tint_at(const FaceFileSurface& s, double u, double v) const {
    if (s.tint.empty()) return glm::vec3(1.0F);
    const BasisValues bu = basis(s.geometry.knots_u, s.geometry.degree_u, u);
    const BasisValues bv = basis(s.geometry.knots_v, s.geometry.degree_v, v);
    glm::dvec3 sum{0.0};
    for (int j = 0; j <= bv.degree; ++j) {
      for (int i = 0; i <= bu.degree; ++i) {
        const std::size_t k =
            bu.first + static_cast<std::size_t>(i) + s.geometry.count_u() * (bv.first + static_cast<std::size_t>(j));
        sum += bu.value[i] * bv.value[j] * glm::dvec3(s.tint[k]);
      }
    }
    return glm::clamp(glm::vec3(sum), 0.0F, 1.0F);
  }

  void add_triangles(std::uint32_t material, const std::vector<std::uint32_t>& triangles,
                     const std::vector<std::uint32_t>& id, bool flip, std::vector<Primitive>& primitives) const {
    auto found =
        std::find_if(primitives.begin(), primitives.end(), [&](const Primitive& p) { return p.material == material; });
    if (found == primitives.end()) {
      primitives.push_back({material, {}});
      found = primitives.end() - 1;
    }
    for (std::size_t i = 0; i + 2 < triangles.size(); i += 3) {
      const std::uint32_t a = id[triangles[i]];
      const std::uint32_t b = id[triangles[i + (flip ? 2 : 1)]];
      const std::uint32_t c = id[triangles[i + (flip ? 1 : 2)]];
      if (a == b || b == c || a == c) continue;
      found->triangles.insert(found->triangles.end(), {a, b, c});
    }
  }

  void add_skin() {
    face_.skin.surface.row_begin.push_back(0);
    vertex_id_.assign(scene_.transforms.size(), std::vector<std::uint32_t>(mesh_.vertices.size(), kNoIndex));
    for (std::size_t t = first_; t < scene_.transforms.size(); ++t) {
      for (std::size_t v = 0; v < mesh_.vertices.size(); ++v) {
        if (!shown_[t][v]) continue;
        if (t != first_ && shown_[first_][v] && is_shared(mesh_.vertices[v], t)) {
          vertex_id_[t][v] = vertex_id_[first_][v];
          continue;
        }
        const VertexPlace& place = mesh_.places[v];
        vertex_id_[t][v] = add_vertex(mesh_.vertices[v], t, glm::dvec3(0.0),
                                      tint_at(file_.surfaces[file_index_[place.surface]], place.u, place.v));
      }
    }
    for (const SurfaceUse& use : scene_.uses) {
      const std::uint32_t s = net_index_[use.surface];
      if (s == kNoIndex) continue;
      add_triangles(file_.surfaces[use.surface].material, mesh_.triangles[s], vertex_id_[use.transform],
                    mirrors(use.transform), face_.skin.primitives);
    }
  }

  struct Shell {
    NetMesh mesh;
    std::vector<Row> rows;             // over the net's points
    std::vector<glm::dvec3> offsets;   // in the net's own coordinates
    std::vector<std::uint32_t> first;  // vertices under the first transform
  };

  Maybe make_shell(const SurfaceUse& use, Shell& shell) const {
    const FaceFileSurface& surface = file_.surfaces[use.surface];
    SurfaceNet net;
    net.surfaces.push_back(surface.geometry);
    net.surfaces[0].sides.reset();
    const std::vector<SurfaceSamples> samples{samples_of(surface)};
    if (const double bound = vertex_bound(net, samples); !(bound <= 8.0 * settings_.max_vertices))
      return too_large(bound);
    auto seams = build_seams(net);
    if (!seams) return std::move(seams).error();
    shell.mesh = tessellate(net, *seams, samples);

    std::vector<std::array<std::uint32_t, 3>> base;
    for (const SurfaceUse& other : scene_.uses) {
      const std::uint32_t s = net_index_[other.surface];
      if (s == kNoIndex || other.transform != use.transform || file_.surfaces[other.surface].part != surface.rides)
        continue;
      const auto& t = mesh_.triangles[s];
      for (std::size_t i = 0; i + 2 < t.size(); i += 3) base.push_back({t[i], t[i + 1], t[i + 2]});
    }
    const std::string place = fmt::format("{}: surface '{}'", name_, surface.geometry.name);
    if (base.empty()) {
      return Failure{"face_bad_reference", place, fmt::format("it rides on '{}', which is not there", surface.rides),
                     "name the part of a skin surface under the same transform"};
    }
    if (static_cast<double>(base.size()) * static_cast<double>(shell.mesh.vertices.size()) > 2e9) {
      return too_large(static_cast<double>(shell.mesh.vertices.size()));
    }
    std::vector<glm::dvec3> positions;
    for (const Row& row : mesh_.vertices) positions.push_back(at(row));
    std::vector<glm::dvec3> low, high;
    for (const auto& t : base) {
      low.push_back(glm::min(positions[t[0]], glm::min(positions[t[1]], positions[t[2]])));
      high.push_back(glm::max(positions[t[0]], glm::max(positions[t[1]], positions[t[2]])));
    }
    std::size_t hint = 0;
    for (const Row& row : shell.mesh.vertices) {
      glm::dvec3 p{0.0};
      for (const RowEntry& e : row) p += e.weight * surface.points[e.point];
      double best = 1e300;
      glm::dvec3 weights{0.0};
      const auto attempt = [&](std::size_t i) {
        const glm::dvec3 w =
            nearest_on_triangle(p, positions[base[i][0]], positions[base[i][1]], positions[base[i][2]]);
        const glm::dvec3 d =
            w.x * positions[base[i][0]] + w.y * positions[base[i][1]] + w.z * positions[base[i][2]] - p;
        if (glm::dot(d, d) < best) {
          best = glm::dot(d, d);
          weights = w;
          hint = i;
        }
      };
      attempt(hint);
      for (std::size_t i = 0; i < base.size(); ++i) {
        const glm::dvec3 gap = glm::max(glm::max(low[i] - p, p - high[i]), glm::dvec3(0.0));
        if (glm::dot(gap, gap) < best) attempt(i);
      }
      const Row* rows[3] = {};
      double share[3] = {};
      for (int k = 0; k < 3; ++k) {
        rows[k] = &mesh_.vertices[base[hint][static_cast<std::size_t>(k)]];
        share[k] = weights[k] < 1e-9 ? 0.0 : weights[k];
      }
      shell.rows.push_back(combine(rows, share));
      shell.offsets.push_back(p - at(shell.rows.back()));
    }
    return std::nullopt;
  }

  // Where the shells of two surfaces touch, as halves do at the midline, they are one: no crease between them.
  using ShellPlace = std::tuple<std::size_t, std::uint32_t, std::int64_t, std::int64_t, std::int64_t>;

  static ShellPlace shell_place(std::size_t transform, std::uint32_t material, const glm::dvec3& p) {
    const auto part = [](double x) { return static_cast<std::int64_t>(std::llround(std::clamp(x, -1e6, 1e6) * 1e6)); };
    return {transform, material, part(p.x), part(p.y), part(p.z)};
  }

  Maybe add_shells() {
    std::map<std::size_t, Shell> shells;
    std::map<ShellPlace, std::uint32_t> made;  // by surfaces before
    for (const SurfaceUse& use : scene_.uses) {
      const FaceFileSurface& surface = file_.surfaces[use.surface];
      if (surface.rides.empty() || !surface.frame.empty()) continue;
      const auto [found, fresh] = shells.try_emplace(use.surface);
      Shell& shell = found->second;
      if (fresh) {
        if (auto f = make_shell(use, shell)) return f;
      }
      const glm::dmat3 turn(scene_.transforms[use.transform]);
      const glm::dmat3 first_turn(scene_.transforms[first_]);
      std::vector<std::uint32_t> ids;
      for (std::size_t v = 0; v < shell.rows.size(); ++v) {
        for (const RowEntry& e : shell.rows[v]) {
          if (point_id_[use.transform][e.point] == kNoIndex) {
            return Failure{"face_bad_reference", fmt::format("{}: surface '{}'", name_, surface.geometry.name),
                           "it is shown where the skin it rides on is not", "show both under the same transforms"};
          }
        }
        const glm::dvec3 offset = turn * shell.offsets[v];
        if (!shell.first.empty() && is_shared(shell.rows[v], use.transform) &&
            offset == first_turn * shell.offsets[v]) {
          ids.push_back(shell.first[v]);
          continue;
        }
        const glm::dvec3 at_rest = at(shell.rows[v]) + shell.offsets[v];
        const auto touched = made.find(shell_place(use.transform, surface.material, at_rest));
        if (touched != made.end()) {
          ids.push_back(touched->second);
          continue;
        }
        const VertexPlace& place = shell.mesh.places[v];
        ids.push_back(add_vertex(shell.rows[v], use.transform, offset, tint_at(surface, place.u, place.v)));
      }
      for (std::size_t v = 0; v < ids.size(); ++v) {
        const glm::dvec3 at_rest = at(shell.rows[v]) + shell.offsets[v];
        made.emplace(shell_place(use.transform, surface.material, at_rest), ids[v]);
      }
      if (use.transform == first_) shell.first = ids;
      add_triangles(surface.material, shell.mesh.triangles[0], ids, mirrors(use.transform), face_.skin.primitives);
      if (face_.skin.offsets.size() > settings_.max_vertices)
        return too_large(static_cast<double>(face_.skin.offsets.size()));
    }
    return std::nullopt;
  }

  Maybe add_rigid() {
    double total = 0.0;
    for (const SurfaceUse& use : scene_.uses) {
      const FaceFileSurface& surface = file_.surfaces[use.surface];
      if (surface.frame.empty()) continue;
      const bool flip = mirrors(use.transform);
      const Frame frame = *frame_named(flip ? mirrored_name(surface.frame) : surface.frame);
      const std::string part = flip ? mirrored_name(surface.part) : surface.part;
      auto mesh = std::find_if(face_.rigid.begin(), face_.rigid.end(),
                               [&](const RigidMesh& m) { return m.name == part && m.frame == frame; });
      if (mesh == face_.rigid.end()) {
        face_.rigid.push_back({});
        mesh = face_.rigid.end() - 1;
        mesh->name = part;
        mesh->frame = frame;
      }
      const NetSurface& g = surface.geometry;
      const NurbsSurface nurbs{g.degree_u, g.degree_v, g.count_u(),    g.count_v(),
                               g.knots_u,  g.knots_v,  surface.points, g.weights};
      const SurfaceSamples n = samples_of(surface);
      total += (static_cast<double>(g.count_u()) * n.u + 1) * (static_cast<double>(g.count_v()) * n.v + 1);
      if (!(total <= settings_.max_vertices)) return too_large(total);
      const auto lines_u = grid_lines(g.knots_u, g.degree_u, n.u);
      const auto lines_v = grid_lines(g.knots_v, g.degree_v, n.v);
      std::vector<std::uint32_t> ids;
      for (const double v : lines_v) {
        for (const double u : lines_u) {
          ids.push_back(static_cast<std::uint32_t>(mesh->positions.size()));
          mesh->positions.emplace_back(glm::vec3(apply(scene_.transforms[use.transform], evaluate(nurbs, u, v).point)));
          mesh->colors.push_back(tint_at(surface, u, v));
        }
      }
      std::vector<std::uint32_t> triangles;
      const auto width = static_cast<std::uint32_t>(lines_u.size());
      for (std::uint32_t v = 0; v + 1 < lines_v.size(); ++v) {
        for (std::uint32_t u = 0; u + 1 < width; ++u) {
          const std::uint32_t a = u + width * v;
          triangles.insert(triangles.end(), {a, a + 1, a + 1 + width, a, a + 1 + width, a + width});
        }
      }
      add_triangles(surface.material, triangles, ids, flip, mesh->primitives);
    }
    for (RigidMesh& mesh : face_.rigid) {
      smooth(mesh);
      const bool plain =
          std::all_of(mesh.colors.begin(), mesh.colors.end(), [](const glm::vec3& c) { return c == glm::vec3(1.0F); });
      if (plain) mesh.colors.clear();
    }
    return std::nullopt;
  }

  // Normals weighted by area over all triangles that meet in one place; triangles without area (poles) go.
  static void smooth(RigidMesh& mesh) {
    const auto place = [&](std::uint32_t v) {
      const glm::vec3& p = mesh.positions[v];
      return std::array<long long, 3>{std::llround(p.x * 1e7), std::llround(p.y * 1e7), std::llround(p.z * 1e7)};
    };
    std::map<std::array<long long, 3>, glm::dvec3> sums;
    for (Primitive& primitive : mesh.primitives) {
      std::vector<std::uint32_t> kept;
      for (std::size_t i = 0; i + 2 < primitive.triangles.size(); i += 3) {
        const std::uint32_t* t = &primitive.triangles[i];
        const glm::dvec3 a = mesh.positions[t[0]], b = mesh.positions[t[1]], c = mesh.positions[t[2]];
        const glm::dvec3 area = glm::cross(b - a, c - a);
        if (glm::dot(area, area) < 1e-24) continue;
        kept.insert(kept.end(), t, t + 3);
        for (int k = 0; k < 3; ++k) sums.try_emplace(place(t[k]), glm::dvec3(0.0)).first->second += area;
      }
      primitive.triangles = std::move(kept);
    }
    for (std::uint32_t v = 0; v < mesh.positions.size(); ++v) {
      const auto found = sums.find(place(v));
      const glm::dvec3 n = found == sums.end() ? glm::dvec3(0.0) : found->second;
      const double length = glm::length(n);
      mesh.normals.emplace_back(length > 0.0 ? glm::vec3(n / length) : glm::vec3(0.0F, 0.0F, 1.0F));
    }
  }

  void add_regions() {
    for (std::size_t t = 0; t < scene_.transforms.size(); ++t) {
      const bool flip = mirrors(t);
      const auto put = [&](const std::string& name, std::uint32_t point, float weight) {
        if (point_id_.empty() || point_id_[t][point] == kNoIndex) return;
        std::vector<float>& region = face_.regions[flip ? mirrored_name(name) : name];
        region.resize(face_.skin.points.size(), 0.0F);
        float& w = region[point_id_[t][point]];
        w = std::max(w, weight);
      };
      for (std::uint32_t p = 0; p < seams_.points.size(); ++p) {
        const PointOwner& o = seams_.points[p];
        if (o.kind == PointOwner::Kind::node) continue;
        const auto& regions = o.kind == PointOwner::Kind::curve ? file_.curves[o.owner].regions
                                                                : file_.surfaces[file_index_[o.owner]].regions;
        for (const auto& [name, weights] : regions) put(name, p, weights[o.index]);
      }
      for (const FaceFileCurve& c : file_.curves) {
        for (std::size_t e = 0; e < 2; ++e) {
          if (c.curve.ends[e].node == kNoIndex) continue;
          for (const auto& [name, weights] : c.regions)
            put(name, c.curve.ends[e].node, e == 0 ? weights.front() : weights.back());
        }
      }
    }
  }

  void finish() {
    face_.skin.surface.rows = static_cast<std::uint32_t>(face_.skin.offsets.size());
    face_.skin.surface.columns = static_cast<std::uint32_t>(face_.skin.points.size());
    const bool white = std::all_of(face_.skin.colors.begin(), face_.skin.colors.end(),
                                   [](const glm::vec3& c) { return c == glm::vec3(1.0F); });
    if (white) face_.skin.colors.clear();
  }

  const FaceScene& scene_;
  const FaceFile& file_;
  std::string_view name_;
  const TessellationSettings& settings_;
  SurfaceNet net_;
  Seams seams_;
  NetMesh mesh_;
  std::vector<std::uint32_t> net_index_;               // of a file's surface
  std::vector<std::size_t> file_index_;                // of a net's surface
  std::vector<glm::dvec3> rest_;                       // x in the net's own coordinates
  std::vector<std::vector<char>> shown_;               // [transform][net vertex]
  std::vector<std::vector<std::uint32_t>> point_id_;   // [transform][net point]
  std::vector<std::vector<std::uint32_t>> vertex_id_;  // [transform][net vertex]
  std::vector<char> shared_;
  std::size_t first_ = 0;
  Face face_;
};

}  // namespace

std::string mirrored_name(const std::string& name) {
  if (ends_with(name, "_left")) return name.substr(0, name.size() - 5) + "_right";
  if (ends_with(name, "_right")) return name.substr(0, name.size() - 6) + "_left";
  return name;
}

std::optional<Frame> frame_named(std::string_view name) {
  if (name == "torso") return Frame::torso;
  if (name == "head") return Frame::head;
  if (name == "jaw") return Frame::jaw;
  if (name == "eye_left") return Frame::eye_left;
  if (name == "eye_right") return Frame::eye_right;
  return std::nullopt;
}

tl::expected<Face, Failure> build_face(const FaceScene& scene, std::string_view name,
                                       const TessellationSettings& settings) {
  return FaceBuilder(scene, name, settings).run();
}

}  // namespace nms::runtime
