#include <nms/runtime/face_x3d.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <set>
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

#include "face_x3d_color.h"

namespace nms::runtime {

namespace {

using program::Failure;

constexpr int kMaxDepth = 64;
constexpr std::size_t kMaxVisits = 200'000;
constexpr double kSeamTolerance = 2e-5;  // m; a control point printed with five digits still passes
constexpr std::uint32_t kMaxSamples = 64;

// ---- names under a mirror ------------------------------------------------------------------------------------------

bool ends_with(std::string_view text, std::string_view tail) {
  return text.size() >= tail.size() && text.substr(text.size() - tail.size()) == tail;
}

std::string mirrored_name(const std::string& name) {
  if (ends_with(name, "_left")) return name.substr(0, name.size() - 5) + "_right";
  if (ends_with(name, "_right")) return name.substr(0, name.size() - 6) + "_left";
  return name;
}

// ---- X3D text to FaceFile ------------------------------------------------------------------------------------------

struct SurfaceUse {
  std::size_t surface = 0;
  std::size_t transform = 0;
};

struct Scene {
  FaceFile file;
  std::vector<glm::dmat4> transforms;  // distinct
  std::vector<SurfaceUse> uses;
};

using Maybe = std::optional<Failure>;

class SceneReader {
 public:
  SceneReader(std::string_view name, const FaceLimits& limits) : name_(name), limits_(limits) {}

  tl::expected<Scene, Failure> run(std::string_view text) {
    if (text.size() > limits_.bytes) {
      return tl::unexpected(too_large(fmt::format("it has {} bytes", text.size())));
    }
    pugi::xml_document document;
    const pugi::xml_parse_result parsed =
        document.load_buffer(text.data(), text.size(), pugi::parse_default, pugi::encoding_utf8);
    if (!parsed) {
      return tl::unexpected(Failure{"face_not_xml", fmt::format("{}: byte {}", name_, parsed.offset),
                                    fmt::format("this is not XML: {}", parsed.description()),
                                    "save the face as X3D in its XML form (.x3d)"});
    }
    const pugi::xml_node root = document.child("X3D");
    const pugi::xml_node scene = root.child("Scene");
    if (!scene) {
      return tl::unexpected(Failure{"face_not_x3d", std::string(name_), "there is no X3D element with a Scene in it",
                                    "save the face as X3D in its XML form (.x3d)"});
    }
    for (const pugi::xml_node& meta : root.child("head").children("meta")) {
      if (std::strcmp(meta.attribute("name").value(), "title") == 0) {
        out_.file.title = meta.attribute("content").value();
      }
    }
    glm::dmat4 unit{1.0};
    for (const pugi::xml_node& u : root.child("head").children("unit")) {
      if (std::strcmp(u.attribute("category").value(), "length") != 0) continue;
      std::vector<double> factor;
      if (auto f = numbers(u, "conversionFactor", 1, factor)) return tl::unexpected(std::move(*f));
      if (factor.size() == 1 && factor[0] > 0.0) {
        for (int k = 0; k < 3; ++k) unit[k][k] = factor[0];
      }
    }
    collect_names(scene);
    if (auto f = read_curves(scene)) return tl::unexpected(std::move(*f));
    if (auto f = walk(scene, unit, 0)) return tl::unexpected(std::move(*f));
    if (out_.uses.empty()) {
      return tl::unexpected(Failure{"face_empty", std::string(name_), "there is no NurbsPatchSurface in a Shape",
                                    "give the face at least one surface"});
    }
    return std::move(out_);
  }

 private:
  Failure too_large(const std::string& cause) const {
    return {"face_too_large", std::string(name_), cause, "a face of a megabyte is plenty: simplify it"};
  }

  std::string place(const pugi::xml_node& node) const {
    const char* def = node.attribute("DEF").value();
    if (*def != '\0') return fmt::format("{}: {} '{}'", name_, node.name(), def);
    return fmt::format("{}: {} at byte {}", name_, node.name(), node.offset_debug());
  }

  Failure bad_surface(const pugi::xml_node& node, std::string cause, std::string remedy) const {
    return {"face_bad_surface", place(node), std::move(cause), std::move(remedy)};
  }

  // All nodes with a DEF, without recursion.
  void collect_names(const pugi::xml_node& scene) {
    pugi::xml_node at = scene.first_child();
    while (at && at != scene) {
      if (const char* def = at.attribute("DEF").value(); *def != '\0') names_.try_emplace(def, at);
      if (at.first_child()) {
        at = at.first_child();
        continue;
      }
      while (at && at != scene && !at.next_sibling()) at = at.parent();
      if (at && at != scene) at = at.next_sibling();
    }
  }

  // The node itself, or the one its USE names.
  tl::expected<pugi::xml_node, Failure> resolve(const pugi::xml_node& node) const {
    const char* use = node.attribute("USE").value();
    if (*use == '\0') return node;
    const auto found = names_.find(use);
    if (found == names_.end()) {
      return tl::unexpected(Failure{"face_bad_reference", place(node), fmt::format("nothing is called '{}'", use),
                                    "give the node that is meant this DEF"});
    }
    return found->second;
  }

  Maybe numbers(const pugi::xml_node& node, const char* attribute, std::size_t most, std::vector<double>& out) const {
    out.clear();
    const char* at = node.attribute(attribute).value();
    const char* end = at + std::strlen(at);
    const auto blank = [](char c) { return c == ' ' || c == ',' || c == '\t' || c == '\n' || c == '\r'; };
    for (;;) {
      while (at != end && blank(*at)) ++at;
      if (at == end) return std::nullopt;
      if (*at == '+') ++at;
      double value = 0.0;
      const auto result = fast_float::from_chars(at, end, value);
      if (result.ec != std::errc() || !std::isfinite(value) || std::abs(value) > 1e12) {
        const std::string seen(at, std::min<std::size_t>(static_cast<std::size_t>(end - at), 16));
        return Failure{"face_bad_number", place(node), fmt::format("{} holds '{}', no number", attribute, seen),
                       "write plain finite numbers with blanks between them"};
      }
      if (out.size() >= most) {
        return Failure{"face_bad_number", place(node), fmt::format("{} holds more than {} numbers", attribute, most),
                       "leave out what is too much"};
      }
      out.push_back(value);
      at = result.ptr;
    }
  }

  Maybe integer(const pugi::xml_node& node, const char* attribute, std::size_t low, std::size_t high,
                std::size_t& out) const {
    std::vector<double> n;
    if (auto f = numbers(node, attribute, 1, n)) return f;
    if (n.size() != 1 || n[0] != std::floor(n[0]) || n[0] < static_cast<double>(low) ||
        n[0] > static_cast<double>(high)) {
      return bad_surface(node, fmt::format("{} is not a whole number from {} to {}", attribute, low, high), "give it");
    }
    out = static_cast<std::size_t>(n[0]);
    return std::nullopt;
  }

  static pugi::xml_node metadata_set(const pugi::xml_node& node, const char* set) {
    for (const pugi::xml_node& m : node.children("MetadataSet")) {
      if (std::strcmp(m.attribute("name").value(), set) == 0) return m;
    }
    return {};
  }

  static pugi::xml_node metadata(const pugi::xml_node& set, std::string_view key) {
    for (const pugi::xml_node& m : set.children()) {
      if (key == m.attribute("name").value()) return m;
    }
    return {};
  }

  // X3D's MFString: "one" "two"
  static std::vector<std::string> strings(const pugi::xml_node& node) {
    std::vector<std::string> out;
    const std::string_view text = node.attribute("value").value();
    std::size_t at = 0;
    while (out.size() < 16) {
      const std::size_t open = text.find('"', at);
      if (open == std::string_view::npos) break;
      const std::size_t close = text.find('"', open + 1);
      if (close == std::string_view::npos) break;
      out.emplace_back(text.substr(open + 1, close - open - 1));
      at = close + 1;
    }
    if (out.empty() && !text.empty() && text.find('"') == std::string_view::npos) out.emplace_back(text);
    return out;
  }

  static std::string string_of(const pugi::xml_node& set, std::string_view key) {
    const auto all = strings(metadata(set, key));
    return all.empty() ? std::string() : all.front();
  }

  Maybe points(const pugi::xml_node& node, std::size_t count, std::vector<glm::dvec3>& out) {
    pugi::xml_node coordinate = node.child("Coordinate");
    if (!coordinate) coordinate = node.child("CoordinateDouble");
    if (!coordinate) {
      return bad_surface(node, "there are no control points", "put a Coordinate with containerField='controlPoint' in");
    }
    auto target = resolve(coordinate);
    if (!target) return std::move(target).error();
    std::vector<double> n;
    if (auto f = numbers(*target, "point", 3 * limits_.control_points, n)) return f;
    if (n.size() != 3 * count) {
      return bad_surface(node, fmt::format("{} coordinates stand for {} control points", n.size(), count),
                         "give three coordinates for each of the control points");
    }
    points_read_ += count;
    if (points_read_ > limits_.control_points)
      return too_large(fmt::format("more than {} control points", limits_.control_points));
    out.reserve(count);
    for (std::size_t i = 0; i < count; ++i) out.emplace_back(n[3 * i], n[3 * i + 1], n[3 * i + 2]);
    return std::nullopt;
  }

  Maybe knots(const pugi::xml_node& node, const char* attribute, int degree, std::size_t count,
              std::vector<double>& out) const {
    if (auto f = numbers(node, attribute, count + 32, out)) return f;
    if (out.empty()) out = clamped_uniform_knots(degree, count - static_cast<std::size_t>(degree));
    if (auto fault = knot_fault(out, degree, count)) {
      return bad_surface(node, fmt::format("{}: {}", attribute, *fault),
                         "give control points + order knots that never fall");
    }
    return std::nullopt;
  }

  Maybe regions(const pugi::xml_node& node, const pugi::xml_node& set, std::size_t count,
                std::map<std::string, std::vector<float>>& out) const {
    for (const pugi::xml_node& m : set.children()) {
      const std::string_view key = m.attribute("name").value();
      if (key.substr(0, 7) != "region:" || key.size() == 7) continue;
      if (out.size() >= 64) return bad_surface(node, "there are more than 64 regions", "leave some out");
      std::vector<double> n;
      if (auto f = numbers(m, "value", count, n)) return f;
      if (n.size() == 1) n.assign(count, n[0]);
      if (n.size() != count) {
        return bad_surface(node, fmt::format("{} has {} weights for {} control points", key, n.size(), count),
                           "give one weight for each control point, or one for all");
      }
      std::vector<float>& weights = out[std::string(key.substr(7))];
      weights.clear();
      for (const double w : n) weights.push_back(static_cast<float>(std::clamp(w, 0.0, 1.0)));
    }
    return std::nullopt;
  }

  Maybe read_curves(const pugi::xml_node& scene) {
    // Every NurbsCurve with our metadata, wherever it stands; it is a border, not something to see.
    std::vector<pugi::xml_node> nodes;
    for (const auto& [def, node] : names_) {
      if (std::strcmp(node.name(), "NurbsCurve") == 0 && metadata_set(node, "curve")) nodes.push_back(node);
    }
    (void)scene;
    std::sort(nodes.begin(), nodes.end(),
              [](const pugi::xml_node& a, const pugi::xml_node& b) { return a.offset_debug() < b.offset_debug(); });
    for (const pugi::xml_node& node : nodes) {
      curve_index_[node.attribute("DEF").value()] = static_cast<std::uint32_t>(out_.file.curves.size());
      FaceFileCurve c;
      c.curve.name = node.attribute("DEF").value();
      std::size_t order = 3;
      if (node.attribute("order")) {
        if (auto f = integer(node, "order", 2, kMaxNurbsDegree + 1, order)) return f;
      }
      c.curve.degree = static_cast<int>(order) - 1;
      std::vector<double> k;
      if (auto f = numbers(node, "knot", limits_.control_points, k)) return f;
      if (k.size() < 2 * order) {
        return bad_surface(node, "a border curve has too few knots", "give control points + order knots");
      }
      c.curve.knots = std::move(k);
      const std::size_t count = c.curve.knots.size() - order;
      if (auto fault = knot_fault(c.curve.knots, c.curve.degree, count)) {
        return bad_surface(node, *fault, "give control points + order knots that never fall");
      }
      if (auto f = points(node, count, c.points)) return f;
      if (auto f = regions(node, metadata_set(node, "curve"), count, c.regions)) return f;
      out_.file.curves.push_back(std::move(c));
    }
    std::map<std::string, std::uint32_t> node_index;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      const pugi::xml_node set = metadata_set(nodes[i], "curve");
      for (std::size_t e = 0; e < 2; ++e) {
        const char* key = e == 0 ? "start" : "end";
        const auto words = strings(metadata(set, key));
        CurveEnd& end = out_.file.curves[i].curve.ends[e];
        if (words.size() == 2 && words[0] == "node") {
          const auto [found, fresh] =
              node_index.try_emplace(words[1], static_cast<std::uint32_t>(out_.file.nodes.size()));
          if (fresh) out_.file.nodes.push_back(words[1]);
          end.node = found->second;
        } else if (words.size() == 2 && words[0] == "curve" && curve_index_.count(words[1]) > 0) {
          end.curve = curve_index_[words[1]];
          std::vector<double> at;
          if (auto f = numbers(metadata(set, fmt::format("{}_at", key)), "value", 1, at)) return f;
          if (at.size() != 1) {
            return bad_surface(nodes[i], fmt::format("{}_at is missing", key), "say where on that curve the end lies");
          }
          end.at = at[0];
        } else {
          return bad_surface(nodes[i], fmt::format("its {} hangs on nothing that is here", key),
                             "write \"node\" \"name\", or \"curve\" \"name\" and the place on it");
        }
      }
    }
    return std::nullopt;
  }

  tl::expected<std::uint32_t, Failure> material_of(const pugi::xml_node& shape, bool solid) {
    pugi::xml_node node;
    if (const pugi::xml_node appearance = shape.child("Appearance")) {
      auto target = resolve(appearance);
      if (!target) return tl::unexpected(std::move(target).error());
      if (const pugi::xml_node material = target->child("Material")) {
        auto resolved = resolve(material);
        if (!resolved) return tl::unexpected(std::move(resolved).error());
        node = *resolved;
      }
    }
    const auto key = std::pair{node.internal_object(), solid};
    if (const auto found = materials_.find(key); found != materials_.end()) return found->second;
    Material m;
    m.name = node.attribute("DEF").value();
    if (m.name.empty()) m.name = fmt::format("material_{}", out_.file.materials.size());
    m.double_sided = !solid;
    std::array<double, 3> color{0.8, 0.8, 0.8};
    std::vector<double> n;
    if (node) {
      if (auto f = numbers(node, "diffuseColor", 3, n)) return tl::unexpected(std::move(*f));
      if (n.size() == 3) color = {n[0], n[1], n[2]};
      if (auto f = numbers(node, "transparency", 1, n)) return tl::unexpected(std::move(*f));
      if (n.size() == 1) m.base_color.a = static_cast<float>(1.0 - std::clamp(n[0], 0.0, 1.0));
      const pugi::xml_node look = metadata_set(node, "look");
      if (auto f = numbers(metadata(look, "roughness"), "value", 1, n)) return tl::unexpected(std::move(*f));
      if (n.size() == 1) m.roughness = static_cast<float>(std::clamp(n[0], 0.0, 1.0));
    }
    for (int k = 0; k < 3; ++k) {
      m.base_color[k] = static_cast<float>(linear_of(std::clamp(color[static_cast<std::size_t>(k)], 0.0, 1.0)));
    }
    const auto index = static_cast<std::uint32_t>(out_.file.materials.size());
    out_.file.materials.push_back(std::move(m));
    materials_[key] = index;
    return index;
  }

  Maybe transform_of(const pugi::xml_node& node, glm::dmat4& out) const {
    std::vector<double> t, r, s, c;
    if (auto f = numbers(node, "translation", 3, t)) return f;
    if (auto f = numbers(node, "rotation", 4, r)) return f;
    if (auto f = numbers(node, "scale", 3, s)) return f;
    if (auto f = numbers(node, "center", 3, c)) return f;
    const auto vec = [](const std::vector<double>& n, double otherwise) {
      return n.size() == 3 ? glm::dvec3(n[0], n[1], n[2]) : glm::dvec3(otherwise);
    };
    glm::dmat3 linear{1.0};
    if (r.size() == 4 && r[3] != 0.0) {
      const double length = std::sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2]);
      if (length > 0.0 && std::abs(r[3]) < 1e5) {
        const glm::dvec3 a = glm::dvec3(r[0], r[1], r[2]) / length;
        const double co = cosine(r[3]);
        const double si = sine(r[3]);
        linear[0] = {co + a.x * a.x * (1 - co), a.x * a.y * (1 - co) + a.z * si, a.x * a.z * (1 - co) - a.y * si};
        linear[1] = {a.x * a.y * (1 - co) - a.z * si, co + a.y * a.y * (1 - co), a.y * a.z * (1 - co) + a.x * si};
        linear[2] = {a.x * a.z * (1 - co) + a.y * si, a.y * a.z * (1 - co) - a.x * si, co + a.z * a.z * (1 - co)};
      }
    }
    const glm::dvec3 scale = vec(s, 1.0);
    for (int k = 0; k < 3; ++k) linear[k] *= scale[k];
    const glm::dvec3 center = vec(c, 0.0);
    glm::dmat4 m{linear};
    m[3] = glm::dvec4(vec(t, 0.0) + center - linear * center, 1.0);
    out = out * m;
    return std::nullopt;
  }

  Maybe walk(const pugi::xml_node& parent, const glm::dmat4& transform, int depth) {
    if (depth > kMaxDepth) {
      return Failure{"face_bad_reference", place(parent), "groups are nested without end",
                     "a group must not USE what it stands in"};
    }
    for (const pugi::xml_node& child : parent.children()) {
      if (child.type() != pugi::node_element) continue;
      if (++visits_ > kMaxVisits) return too_large(fmt::format("more than {} nodes are shown", kMaxVisits));
      const std::string_view kind = child.name();
      if (kind == "Switch") continue;  // borders and what else is not shown
      if (kind != "Shape" && kind != "Transform" && kind != "Group" && kind != "Collision" && kind != "Anchor" &&
          kind != "NurbsSet" && kind != "StaticGroup") {
        continue;
      }
      auto target = resolve(child);
      if (!target) return std::move(target).error();
      if (kind == "Shape") {
        if (auto f = shape(*target, transform)) return f;
        continue;
      }
      glm::dmat4 inner = transform;
      if (std::strcmp(target->name(), "Transform") == 0) {
        if (auto f = transform_of(*target, inner)) return f;
      }
      if (auto f = walk(*target, inner, depth + 1)) return f;
    }
    return std::nullopt;
  }

  Maybe shape(const pugi::xml_node& shape_node, const glm::dmat4& transform) {
    const pugi::xml_node geometry = shape_node.child("NurbsPatchSurface");
    if (!geometry) return std::nullopt;
    auto node = resolve(geometry);
    if (!node) return std::move(node).error();
    const auto key = std::pair{node->internal_object(), shape_node.internal_object()};
    auto found = surfaces_.find(key);
    if (found == surfaces_.end()) {
      FaceFileSurface surface;
      if (auto f = read_surface(*node, surface)) return f;
      const std::string_view solid = node->attribute("solid").value();
      auto material = material_of(shape_node, solid != "false");
      if (!material) return std::move(material).error();
      surface.material = *material;
      found = surfaces_.emplace(key, out_.file.surfaces.size()).first;
      out_.file.surfaces.push_back(std::move(surface));
    }
    if (out_.uses.size() >= limits_.surface_uses) {
      return too_large(fmt::format("more than {} surfaces are shown", limits_.surface_uses));
    }
    std::size_t t = 0;
    while (t < out_.transforms.size() && out_.transforms[t] != transform) ++t;
    if (t == out_.transforms.size()) {
      const double det = glm::determinant(glm::dmat3(transform));
      if (!std::isfinite(det) || det == 0.0) {
        return bad_surface(*node, "it is scaled to nothing", "give every Transform a scale other than 0");
      }
      out_.transforms.push_back(transform);
    }
    out_.uses.push_back({found->second, t});
    return std::nullopt;
  }

  Maybe read_surface(const pugi::xml_node& node, FaceFileSurface& s) {
    NetSurface& g = s.geometry;
    g.name = node.attribute("DEF").value();
    if (g.name.empty()) g.name = fmt::format("surface_{}", out_.file.surfaces.size());
    std::size_t nu = 0;
    std::size_t nv = 0;
    std::size_t order_u = 3;
    std::size_t order_v = 3;
    if (auto f = integer(node, "uDimension", 2, limits_.control_points, nu)) return f;
    if (auto f = integer(node, "vDimension", 2, limits_.control_points, nv)) return f;
    if (node.attribute("uOrder")) {
      if (auto f = integer(node, "uOrder", 2, kMaxNurbsDegree + 1, order_u)) return f;
    }
    if (node.attribute("vOrder")) {
      if (auto f = integer(node, "vOrder", 2, kMaxNurbsDegree + 1, order_v)) return f;
    }
    if (nu < order_u || nv < order_v) {
      return bad_surface(node, "there are fewer control points than the order",
                         "raise the dimension or lower the order");
    }
    if (nu * nv > limits_.control_points) return too_large(fmt::format("{} x {} control points", nu, nv));
    g.degree_u = static_cast<int>(order_u) - 1;
    g.degree_v = static_cast<int>(order_v) - 1;
    if (auto f = points(node, nu * nv, s.points)) return f;
    if (auto f = knots(node, "uKnot", g.degree_u, nu, g.knots_u)) return f;
    if (auto f = knots(node, "vKnot", g.degree_v, nv, g.knots_v)) return f;
    if (auto f = numbers(node, "weight", nu * nv, g.weights)) return f;
    if (!g.weights.empty() && g.weights.size() != nu * nv) {
      return bad_surface(node, "weights and control points differ in number", "give one weight for each, or none");
    }
    if (std::any_of(g.weights.begin(), g.weights.end(), [](double w) { return !(w > 1e-9); })) {
      return bad_surface(node, "a weight is not above 0", "give positive weights");
    }
    if (std::all_of(g.weights.begin(), g.weights.end(), [](double w) { return w == 1.0; })) g.weights.clear();
    return read_metadata(node, s);
  }

  Maybe read_metadata(const pugi::xml_node& node, FaceFileSurface& s) {
    NetSurface& g = s.geometry;
    const std::size_t count = s.points.size();
    const pugi::xml_node set = metadata_set(node, "surface");
    if (!set) return std::nullopt;
    if (auto part = string_of(set, "part"); !part.empty()) s.part = std::move(part);
    s.frame = string_of(set, "frame");
    s.rides = string_of(set, "rides");
    if (!s.frame.empty() && !frame_of(s.frame)) {
      return bad_surface(node, fmt::format("there is no frame '{}'", s.frame),
                         "take torso, head, jaw, eye_left or eye_right");
    }
    std::vector<double> n;
    if (auto f = numbers(metadata(set, "samples"), "value", 2, n)) return f;
    if (n.size() == 2) {
      if (!(n[0] >= 1.0 && n[1] >= 1.0 && n[0] <= kMaxSamples && n[1] <= kMaxSamples)) {
        return bad_surface(node, fmt::format("samples lie outside 1 to {}", kMaxSamples), "take 1, 2 or 3 a span");
      }
      s.samples = {static_cast<std::uint32_t>(n[0]), static_cast<std::uint32_t>(n[1])};
    }
    if (auto f = numbers(metadata(set, "tint"), "value", 3 * count, n)) return f;
    if (!n.empty()) {
      if (n.size() != 3 * count)
        return bad_surface(node, "tint and control points differ in number", "give three numbers for each");
      for (std::size_t i = 0; i < count; ++i) {
        s.tint.emplace_back(static_cast<float>(std::clamp(n[3 * i], 0.0, 1.0)),
                            static_cast<float>(std::clamp(n[3 * i + 1], 0.0, 1.0)),
                            static_cast<float>(std::clamp(n[3 * i + 2], 0.0, 1.0)));
      }
    }
    if (auto f = regions(node, set, count, s.regions)) return f;
    const pugi::xml_node sides_node = metadata(set, "sides");
    if (!sides_node) return std::nullopt;
    if (!g.weights.empty())
      return bad_surface(node, "a surface with border curves is rational", "leave its weights out");
    const auto words = strings(sides_node);
    std::vector<double> from, to;
    if (auto f = numbers(metadata(set, "side_from"), "value", 4, from)) return f;
    if (auto f = numbers(metadata(set, "side_to"), "value", 4, to)) return f;
    if (words.size() != 4 || from.size() != 4 || to.size() != 4) {
      return bad_surface(node, "its four sides are not all given", "give sides, side_from and side_to, four each");
    }
    g.sides.emplace();
    for (std::size_t k = 0; k < 4; ++k) {
      const auto found = curve_index_.find(words[k]);
      if (found == curve_index_.end()) {
        return Failure{"face_bad_reference", place(node), fmt::format("there is no border curve '{}'", words[k]),
                       "give a NurbsCurve with metadata this DEF"};
      }
      (*g.sides)[k] = {found->second, from[k], to[k]};
    }
    return std::nullopt;
  }

 public:
  static std::optional<Frame> frame_of(std::string_view name) {
    if (name == "torso") return Frame::torso;
    if (name == "head") return Frame::head;
    if (name == "jaw") return Frame::jaw;
    if (name == "eye_left") return Frame::eye_left;
    if (name == "eye_right") return Frame::eye_right;
    return std::nullopt;
  }

 private:
  std::string_view name_;
  const FaceLimits& limits_;
  std::map<std::string, pugi::xml_node> names_;
  std::map<std::string, std::uint32_t> curve_index_;
  std::map<std::pair<void*, bool>, std::uint32_t> materials_;
  std::map<std::pair<void*, void*>, std::size_t> surfaces_;
  std::size_t visits_ = 0;
  std::size_t points_read_ = 0;
  Scene out_;
};

// ---- FaceFile to Face ----------------------------------------------------------------------------------------------

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
  FaceBuilder(const Scene& scene, std::string_view name, const TessellationSettings& settings)
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
    mesh_ = tessellate(net_, seams_, samples);
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

  Maybe add_shells() {
    std::map<std::size_t, Shell> shells;
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
        const VertexPlace& place = shell.mesh.places[v];
        ids.push_back(add_vertex(shell.rows[v], use.transform, offset, tint_at(surface, place.u, place.v)));
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
      const Frame frame = *SceneReader::frame_of(flip ? mirrored_name(surface.frame) : surface.frame);
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
    for (RigidMesh& mesh : face_.rigid) smooth(mesh);
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

  const Scene& scene_;
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

tl::expected<Face, program::Failure> read_face_x3d(std::string_view text, std::string_view name,
                                                   const TessellationSettings& settings, const FaceLimits& limits) {
  if (!(settings.density > 0.0 && settings.density <= 16.0)) {
    return tl::unexpected(Failure{"face_bad_number", std::string(name), "the density lies outside 0 to 16", "take 1"});
  }
  auto scene = SceneReader(name, limits).run(text);
  if (!scene) return tl::unexpected(std::move(scene).error());
  return FaceBuilder(*scene, name, settings).run();
}

}  // namespace nms::runtime
