#include <nms/runtime/face_x3d.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

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
#include "face_x3d_color.h"
#include "vrml_read.h"

namespace nms::runtime {

namespace {

using program::Failure;
using Maybe = std::optional<Failure>;

constexpr int kMaxDepth = 64;
constexpr std::size_t kMaxVisits = 200'000;
constexpr std::size_t kNoChild = static_cast<std::size_t>(-1);
constexpr std::uint32_t kMaxSamples = 64;

class SceneReader {
 public:
  SceneReader(std::string_view name, const FaceLimits& limits) : name_(name), limits_(limits) {}

  tl::expected<FaceScene, Failure> run(std::string_view text, NurbsText encoding) {
    if (text.size() > limits_.bytes) {
      return tl::unexpected(too_large(fmt::format("it has {} bytes", text.size())));
    }
    pugi::xml_document document;
    if (encoding == NurbsText::vrml) {
      if (auto failure = read_vrml(text, name_, document)) return tl::unexpected(std::move(*failure));
      return read_document(document);
    }
    const pugi::xml_parse_result parsed =
        document.load_buffer(text.data(), text.size(), pugi::parse_default, pugi::encoding_utf8);
    if (!parsed) {
      return tl::unexpected(Failure{"face_not_xml", fmt::format("{}: byte {}", name_, parsed.offset),
                                    fmt::format("this is not XML: {}", parsed.description()),
                                    "save the face as X3D in its XML form (.x3d)"});
    }
    return read_document(document);
  }

 private:
  tl::expected<FaceScene, Failure> read_document(const pugi::xml_document& document) {
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
      const bool length = std::strcmp(u.attribute("category").value(), "length") == 0;
      if (!length && std::strcmp(u.attribute("category").value(), "angle") != 0) continue;
      std::vector<double> factor;
      if (auto f = numbers(u, "conversionFactor", 1, factor)) return tl::unexpected(std::move(*f));
      if (factor.size() != 1 || !(factor[0] > 0.0)) continue;
      if (length) {
        for (int k = 0; k < 3; ++k) unit[k][k] = factor[0];
      } else {
        angle_unit_ = factor[0];
      }
    }
    collect_names(scene);
    if (auto f = read_curves(scene)) return tl::unexpected(std::move(*f));
    if (auto f = walk(scene, unit, 0)) return tl::unexpected(std::move(*f));
    if (out_.uses.empty()) {
      return tl::unexpected(
          Failure{"face_empty", std::string(name_), "there is no NurbsPatchSurface in a Shape",
                  "give the face at least one surface; what prototypes and scripts make is not read"});
    }
    return std::move(out_);
  }

  Failure too_large(const std::string& cause) const {
    return {"face_too_large", std::string(name_), cause, "a face of a megabyte is plenty: simplify it"};
  }

  std::string place(const pugi::xml_node& node) const {
    const char* def = node.attribute("DEF").value();
    if (*def != '\0') return fmt::format("{}: {} '{}'", name_, node.name(), def);
    if (const pugi::xml_attribute line = node.attribute(kVrmlLine))
      return fmt::format("{}:{}: {}", name_, line.value(), node.name());
    return fmt::format("{}: {} at byte {}", name_, node.name(), node.offset_debug());
  }

  Failure bad_surface(const pugi::xml_node& node, std::string cause, std::string remedy) const {
    return {"face_bad_surface", place(node), std::move(cause), std::move(remedy)};
  }

  // All nodes with a DEF, without recursion.
  void collect_names(const pugi::xml_node& scene) {
    pugi::xml_node at = scene.first_child();
    while (at && at != scene) {
      if (const char* def = at.attribute("DEF").value(); *def != '\0') names_.try_emplace({def, at.name()}, at);
      if (at.first_child()) {
        at = at.first_child();
        continue;
      }
      while (at && at != scene && !at.next_sibling()) at = at.parent();
      if (at && at != scene) at = at.next_sibling();
    }
  }

  // The node itself, or the one its USE names: of its own kind, if several share the name.
  tl::expected<pugi::xml_node, Failure> resolve(const pugi::xml_node& node) const {
    const char* use = node.attribute("USE").value();
    if (*use == '\0') return node;
    auto found = names_.find({use, node.name()});
    if (found == names_.end()) found = names_.lower_bound({use, ""});
    if (found == names_.end() || found->first.first != use) {
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
    for (const auto& [name, node] : names_) {
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

  /// The turn of an SFRotation: axis and angle.
  glm::dmat3 turn_of(const std::vector<double>& r) const {
    const double angle = r.size() == 4 ? r[3] * angle_unit_ : 0.0;
    const double length = angle == 0.0 ? 0.0 : std::sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2]);
    if (length <= 0.0 || std::abs(angle) >= 1e5) return glm::dmat3(1.0);
    const glm::dvec3 a = glm::dvec3(r[0], r[1], r[2]) / length;
    const double co = cosine(angle);
    const double si = sine(angle);
    return {{co + a.x * a.x * (1 - co), a.x * a.y * (1 - co) + a.z * si, a.x * a.z * (1 - co) - a.y * si},
            {a.x * a.y * (1 - co) - a.z * si, co + a.y * a.y * (1 - co), a.y * a.z * (1 - co) + a.x * si},
            {a.x * a.z * (1 - co) + a.y * si, a.y * a.z * (1 - co) - a.x * si, co + a.z * a.z * (1 - co)}};
  }

  /// P' = T C R SR S -SR -C P (ISO/IEC 19775-1, 10.4.4).
  Maybe transform_of(const pugi::xml_node& node, glm::dmat4& out) const {
    std::vector<double> t, r, s, o, c;
    if (auto f = numbers(node, "translation", 3, t)) return f;
    if (auto f = numbers(node, "rotation", 4, r)) return f;
    if (auto f = numbers(node, "scale", 3, s)) return f;
    if (auto f = numbers(node, "scaleOrientation", 4, o)) return f;
    if (auto f = numbers(node, "center", 3, c)) return f;
    const auto vec = [](const std::vector<double>& n, double otherwise) {
      return n.size() == 3 ? glm::dvec3(n[0], n[1], n[2]) : glm::dvec3(otherwise);
    };
    const glm::dmat3 stretched = turn_of(o);
    const glm::dvec3 scale = vec(s, 1.0);
    glm::dmat3 linear = turn_of(r) * stretched;
    for (int k = 0; k < 3; ++k) linear[k] *= scale[k];
    linear = linear * glm::transpose(stretched);
    const glm::dvec3 center = vec(c, 0.0);
    glm::dmat4 m{linear};
    m[3] = glm::dvec4(vec(t, 0.0) + center - linear * center, 1.0);
    out = out * m;
    return std::nullopt;
  }

  static bool groups(std::string_view kind) {
    constexpr std::string_view kGroups[] = {"Transform",   "Group",    "Collision",   "Anchor",  "NurbsSet",
                                            "StaticGroup", "Switch",   "LOD",         "Layer",   "LayerSet",
                                            "Billboard",   "CADLayer", "CADAssembly", "CADPart", "CADFace"};
    return std::find(std::begin(kGroups), std::end(kGroups), kind) != std::end(kGroups);
  }

  /// Which of its children a group shows: a Switch the one chosen, an LOD the finest.
  Maybe chosen_of(const pugi::xml_node& group, std::optional<std::size_t>& only) const {
    const std::string_view kind = group.name();
    if (kind == "LOD") only = 0;
    if (kind != "Switch") return std::nullopt;
    std::vector<double> choice;
    if (auto f = numbers(group, "whichChoice", 1, choice)) return f;
    only = choice.empty() || !(choice[0] >= 0.0 && choice[0] < 1e6) ? kNoChild : static_cast<std::size_t>(choice[0]);
    return std::nullopt;
  }

  /// @param only  of the children: this one alone
  Maybe walk(const pugi::xml_node& parent, const glm::dmat4& transform, int depth,
             std::optional<std::size_t> only = std::nullopt) {
    if (depth > kMaxDepth) {
      return Failure{"face_bad_reference", place(parent), "groups are nested without end",
                     "a group must not USE what it stands in"};
    }
    std::size_t at = 0;
    for (const pugi::xml_node& child : parent.children()) {
      const std::string_view kind = child.name();
      if (child.type() != pugi::node_element || kind.starts_with("Metadata")) continue;
      if (++visits_ > kMaxVisits) return too_large(fmt::format("more than {} nodes are shown", kMaxVisits));
      if (only && at++ != *only) continue;
      if (kind != "Shape" && !groups(kind)) continue;
      auto target = resolve(child);
      if (!target) return std::move(target).error();
      if (std::strcmp(target->attribute("visible").value(), "false") == 0) continue;
      if (kind == "Shape") {
        if (auto f = shape(*target, transform)) return f;
        continue;
      }
      glm::dmat4 inner = transform;
      const std::string_view what = target->name();
      if (what == "Transform" || what == "CADPart") {
        if (auto f = transform_of(*target, inner)) return f;
      }
      std::optional<std::size_t> shown;
      if (auto f = chosen_of(*target, shown)) return f;
      if (auto f = walk(*target, inner, depth + 1, shown)) return f;
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
      if (surface.geometry.name.empty()) surface.geometry.name = name_around(shape_node);
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

  /// Modellers name the shape, or the transform about it, and not the surface.
  std::string name_around(const pugi::xml_node& shape_node) const {
    for (pugi::xml_node at = shape_node; at && std::strcmp(at.name(), "Scene") != 0; at = at.parent())
      if (const char* def = at.attribute("DEF").value(); *def != '\0') return def;
    return fmt::format("surface_{}", out_.file.surfaces.size());
  }

  Maybe read_surface(const pugi::xml_node& node, FaceFileSurface& s) {
    NetSurface& g = s.geometry;
    g.name = node.attribute("DEF").value();
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
    if (!s.frame.empty() && !frame_named(s.frame)) {
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

  std::string_view name_;
  const FaceLimits& limits_;
  std::map<std::pair<std::string, std::string>, pugi::xml_node> names_;  // DEF, kind of node
  std::map<std::string, std::uint32_t> curve_index_;
  std::map<std::pair<void*, bool>, std::uint32_t> materials_;
  std::map<std::pair<void*, void*>, std::size_t> surfaces_;
  double angle_unit_ = 1.0;  // [rad]
  std::size_t visits_ = 0;
  std::size_t points_read_ = 0;
  FaceScene out_;
};

}  // namespace

tl::expected<FaceScene, Failure> read_scene_x3d(std::string_view text, std::string_view name, NurbsText encoding,
                                                const FaceLimits& limits) {
  return SceneReader(name, limits).run(text, encoding);
}

tl::expected<Face, program::Failure> read_face_x3d(std::string_view text, std::string_view name,
                                                   const TessellationSettings& settings, const FaceLimits& limits) {
  if (!(settings.density > 0.0 && settings.density <= 16.0)) {
    return tl::unexpected(Failure{"face_bad_number", std::string(name), "the density lies outside 0 to 16", "take 1"});
  }
  const auto scene = read_scene_x3d(text, name, NurbsText::xml, limits);
  if (!scene) return tl::unexpected(scene.error());
  return build_face(*scene, name, settings);
}

}  // namespace nms::runtime
