// A face: the file of its geometry, how that file counts, its parts, its landmarks.
#include <algorithm>
#include <iterator>

#include <fmt/format.h>

#include <nms/compiler/diagnostic_kinds.h>
#include <nms/program/enum_names.h>

#include "rig.h"

namespace nms::compiler {

using lang::NodeKind;
using lang::NodeRef;
using lang::Unit;

namespace {

constexpr double kMostVertices = 1e9;

class FaceBuilder {
 public:
  FaceBuilder(const Declaration& face, Evaluator& evaluator, Emitter& emitter)
      : face_(face), evaluator_(evaluator), emitter_(emitter) {
    scope_.file = face.file;
  }

  void build() {
    reference_.name = emitter_.string(face_.name);
    for (NodeRef item : face_.node.children()) {
      if (is_property(item))
        property(item);
      else if (item.is(NodeKind::landmark))
        landmark(item);
    }
    if (!surface_given_)
      evaluator_.report(scope_, face_.node.child(NodeKind::name),
                        MissingProperty{"surface, the file of its geometry", std::string(face_.name)});
    if (!up_given_ && same_axis()) reference_.up = program::Axis::z;
    if (!forward_given_ && same_axis())
      reference_.forward = reference_.up == program::Axis::z ? program::Axis::minus_y : program::Axis::y;
    if (same_axis()) reference_.forward = static_cast<program::Axis>((static_cast<int>(reference_.up) + 1) % 3);
    emitter_.draft.faces.push_back(reference_);
  }

 private:
  void bad(NodeRef p, std::string_view expected) {
    const NodeRef value = p.at(1);
    evaluator_.report(
        scope_, value ? value : p,
        BadProperty{std::string(p.at(0).text()), value ? std::string(value.text()) : "nothing", std::string(expected)});
  }

  void property(NodeRef p) {
    const std::string_view name = p.at(0).text();
    const NodeRef value = p.at(1);
    if (name == "surface") {
      surface_given_ = true;
      if (!value || !value.is(NodeKind::string) || unquoted(value).empty())
        return bad(p, "the name of a file: surface \"ada.x3d\"");
      reference_.surface = emitter_.string(unquoted(value));
    } else if (name == "unit") {
      unit(p);
    } else if (name == "up") {
      axis(p, reference_.up, up_given_);
    } else if (name == "forward") {
      axis(p, reference_.forward, forward_given_);
    } else if (name == "origin") {
      if (!value || !value.is(NodeKind::vector)) return bad(p, "a place: origin (0mm, 1650mm, 20mm)");
      read_place(value, scope_, evaluator_, reference_.origin);
    } else if (name == "within") {
      within(p);
    } else if (name == "part") {
      part(p);
    } else if (name != "source" && name != "licence") {
      evaluator_.report(
          scope_, p.at(0),
          UnknownProperty{std::string(name),
                          "a face",
                          {"surface", "unit", "up", "forward", "origin", "within", "part", "source", "licence"}});
    }
  }

  void unit(NodeRef p) {
    const NodeRef value = p.at(1);
    const auto length = value && value.is(NodeKind::quantity) ? lang::read_quantity(value.text()) : std::nullopt;
    if (!length || length->unit != Unit::length) return bad(p, "a length: unit 1mm");
    if (length->value < 1e-3 || length->value > 1e6) {
      evaluator_.report(scope_, value, OutOfRange{std::string(value.text()), "0.001mm to 1 kilometre"});
      return;
    }
    reference_.unit = static_cast<float>(length->value / 1000.0);
  }

  [[nodiscard]] bool same_axis() const {
    return static_cast<int>(reference_.up) % 3 == static_cast<int>(reference_.forward) % 3;
  }

  void axis(NodeRef p, program::Axis& out, bool& given) {
    const NodeRef value = p.at(1);
    std::string word;
    if (value && value.is(NodeKind::name)) word = value.text();
    if (value && value.is(NodeKind::string)) word = unquoted(value);
    const auto found = program::enum_from<program::Axis>(word);
    if (!found) return bad(p, "x, y or z, or against one of them: \"-y\"");
    out = *found;
    given = true;
    if (up_given_ && forward_given_ && same_axis()) bad(p, "another axis than the other direction's");
  }

  void within(NodeRef p) {
    const NodeRef low = p.at(1);
    const NodeRef high = p.at(2);
    if (!low || !high || !low.is(NodeKind::vector) || !high.is(NodeKind::vector))
      return bad(p, "two places: within (-200mm, -250mm, -200mm) (200mm, 200mm, 200mm)");
    if (!read_place(low, scope_, evaluator_, reference_.low)) return;
    if (!read_place(high, scope_, evaluator_, reference_.high)) return;
    for (int k = 0; k < 3; ++k)
      if (!(reference_.low[k] < reference_.high[k])) return bad(p, "the lower place first, in all three directions");
  }

  /// A vertex' number; nothing: it is not one, and that has been said.
  std::optional<std::uint32_t> vertex(NodeRef at) {
    const auto number = at && at.is(NodeKind::quantity) ? lang::read_quantity(at.text()) : std::nullopt;
    if (number && number->unit == Unit::none && number->value >= 0.0 && number->value < kMostVertices &&
        number->value == static_cast<double>(static_cast<std::uint32_t>(number->value)))
      return static_cast<std::uint32_t>(number->value);
    evaluator_.report(scope_, at, OutOfRange{std::string(at.text()), "a vertex' number: 0 or more, and whole"});
    return std::nullopt;
  }

  void part(NodeRef p) {
    program::FacePart part;
    const NodeRef kind = p.at(1);
    const auto found =
        kind && kind.is(NodeKind::name) ? program::enum_from<program::FacePartKind>(kind.text()) : std::nullopt;
    if (!found) return bad(p, fmt::format("{}", fmt::join(program::EnumNames<program::FacePartKind>::kNames, ", ")));
    part.kind = *found;
    std::uint32_t at = 2;
    if (p.at(at) && p.at(at).is(NodeKind::string)) part.name = emitter_.string(unquoted(p.at(at++)));
    if (p.at(at) && p.at(at).is(NodeKind::quantity)) {
      const auto first = vertex(p.at(at));
      if (!first) return;
      if (!p.at(at + 1)) return bad(p, "a first and a last vertex: part tongue 14062 17038");
      const auto last = vertex(p.at(at + 1));
      if (!last) return;
      if (*last < *first) return bad(p, "the first vertex before the last");
      part.first = *first;
      part.last = *last;
      at += 2;
    }
    if (at == 2) return bad(p, "a name or vertices: part tongue \"helper-tongue\"");
    emitter_.draft.face_parts.push_back(part);
  }

  void landmark(NodeRef item) {
    const NodeRef name = item.child(NodeKind::name);
    if (!name || item.has(lang::kFlagError)) return;
    const bool sided = item.child(NodeKind::sides).exists();
    program::Landmark left;
    program::Landmark right;
    if (const NodeRef place = item.child(NodeKind::vector)) {
      if (!read_place(place, scope_, evaluator_, left.position)) return;
      right = left;
      right.position[0] = -right.position[0];
    } else if (item.child(NodeKind::string)) {
      if (!on_surface(item, left)) return;
      right = left;
    } else if (!at_vertices(item, name, sided, left, right)) {
      return;
    }
    const std::string first = fmt::format("{}{}", name.text(), sided ? "_L" : "");
    if (std::find(names_.begin(), names_.end(), first) != names_.end()) {
      evaluator_.report(scope_, name, DuplicateName{"landmark", std::string(name.text())});
      return;
    }
    names_.push_back(first);
    left.name = emitter_.string(first);
    emitter_.draft.landmarks.push_back(left);
    if (!sided) return;
    right.name = emitter_.string(fmt::format("{}_R", name.text()));
    emitter_.draft.landmarks.push_back(right);
  }

  bool at_vertices(NodeRef item, NodeRef name, bool sided, program::Landmark& left, program::Landmark& right) {
    std::vector<std::uint32_t> vertices;
    for (NodeRef q : item.children()) {
      if (!q.is(NodeKind::quantity)) continue;
      const auto v = vertex(q);
      if (!v) return false;
      vertices.push_back(*v);
    }
    if (vertices.size() != (sided ? 2U : 1U)) {
      evaluator_.report(scope_, name,
                        BadProperty{std::string(name.text()), fmt::format("{} vertices", vertices.size()),
                                    sided ? "two vertices, the left one first" : "one vertex, or sides and two"});
      return false;
    }
    left.vertex = vertices.front();
    right.vertex = vertices.back();
    return true;
  }

  bool on_surface(NodeRef item, program::Landmark& out) {
    out.surface = emitter_.string(unquoted(item.child(NodeKind::string)));
    int k = 0;
    for (NodeRef q : item.children()) {
      if (!q.is(NodeKind::quantity) || k == 2) continue;
      const auto share = lang::read_quantity(q.text());
      if (!share || (share->unit != Unit::none && share->unit != Unit::percent) || share->value < 0.0 ||
          share->value > 1.0) {
        evaluator_.report(scope_, q, OutOfRange{std::string(q.text()), "0 to 1, a share of the surface's domain"});
        return false;
      }
      out.position[k++] = static_cast<float>(share->value);
    }
    return k == 2;
  }

  const Declaration& face_;
  Evaluator& evaluator_;
  Emitter& emitter_;
  Scope scope_;
  program::FaceReference reference_;
  bool surface_given_ = false;
  bool up_given_ = false;
  bool forward_given_ = false;
  std::vector<std::string> names_;
};

}  // namespace

void build_face(const Declaration& face, Evaluator& evaluator, Emitter& emitter) {
  FaceBuilder(face, evaluator, emitter).build();
}

}  // namespace nms::compiler
