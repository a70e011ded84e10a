#include "rig.h"

#include <algorithm>
#include <optional>

#include <fmt/format.h>

#include <nms/compiler/diagnostic_kinds.h>

namespace nms::compiler {

using lang::NodeKind;
using lang::NodeRef;
using lang::Quantity;
using lang::Unit;
using program::MuscleKind;

namespace {

constexpr float kRadian = 0.017453292519943295F;

/// What a property of a muscle sets, in which unit, for which kinds.
struct MuscleProperty {
  std::string_view name;
  Unit unit;
  float program::Muscle::*field;
  double low, high;  ///< in the unit's base: degrees, millimetres, shares
};

constexpr MuscleProperty kMuscleProperties[] = {
    {"angle", Unit::angle, &program::Muscle::angle, -180.0, 180.0},
    {"insertion", Unit::length, &program::Muscle::insertion_radius, 0.0, 1000.0},
    {"dissipation", Unit::length, &program::Muscle::dissipation_radius, 0.0, 1000.0},
    {"perpendicular", Unit::length, &program::Muscle::perpendicular_radius, 0.0, 1000.0},
    {"major", Unit::length, &program::Muscle::major_radius, 0.0, 1000.0},
    {"minor", Unit::length, &program::Muscle::minor_radius, 0.0, 1000.0},
    {"limit", Unit::percent, &program::Muscle::limit, 0.0, 2.0},
    {"protrusion", Unit::length, &program::Muscle::amount, -100.0, 100.0},
    {"push", Unit::length, &program::Muscle::amount, -100.0, 100.0},
    {"closes", Unit::percent, &program::Muscle::closes, 0.0, 1.0},
};

class RigBuilder {
 public:
  RigBuilder(Evaluator& evaluator, Emitter& emitter) : evaluator_(evaluator), emitter_(emitter) {}

  void build(const std::string& face_name) {
    const Declarations& all = evaluator_.declarations();
    const Declaration* face = nullptr;
    for (const Declaration& f : all.faces)
      if (face == nullptr && (face_name.empty() || f.name == face_name)) face = &f;
    // A face's own muscles take the place of those with the same name.
    std::vector<const Declaration*> muscles;
    for (const Declaration& m : all.muscles) {
      const bool own = face != nullptr && m.file == face->file && within(m.node, face->node);
      if (!own && inside_some_face(m)) continue;
      const auto same =
          std::find_if(muscles.begin(), muscles.end(), [&](const Declaration* d) { return d->name == m.name; });
      if (same == muscles.end())
        muscles.push_back(&m);
      else if (own)
        *same = &m;
    }
    for (const Declaration* m : muscles) muscle(*m);
    actuations();
    if (face != nullptr) build_face(*face, evaluator_, emitter_);
  }

 private:
  static bool within(NodeRef inner, NodeRef outer) {
    return &inner.tree() == &outer.tree() && inner.index() > outer.index() && inner.index() < outer.node().next;
  }
  bool inside_some_face(const Declaration& m) const {
    for (const Declaration& f : evaluator_.declarations().faces)
      if (within(m.node, f.node)) return true;
    return false;
  }

  Scope scope_of(const Declaration& d) const {
    Scope s;
    s.file = d.file;
    return s;
  }

  bool vector(NodeRef node, const Scope& scope, float (&out)[3]) { return read_place(node, scope, evaluator_, out); }

  void muscle(const Declaration& d) {
    if (d.node.has(lang::kFlagError)) return;
    const Scope scope = scope_of(d);
    program::Muscle m;
    const NodeRef kind = d.node.child(NodeKind::muscle_kind);
    const std::string_view word = kind ? kind.text() : std::string_view();
    static constexpr std::string_view kKinds[] = {"linear", "sheet", "sphincter", "eyelid", "hinge", "bulge", "roll"};
    const auto* it = std::find(std::begin(kKinds), std::end(kKinds), word);
    if (it == std::end(kKinds)) {
      evaluator_.report(
          scope, kind ? kind : d.node,
          UnknownName{"kind of muscle", std::string(word),
                      lang::nearest(word, std::vector<std::string>(std::begin(kKinds), std::end(kKinds)))});
      return;
    }
    m.kind = static_cast<MuscleKind>(it - std::begin(kKinds));
    for (NodeRef place : d.node.children()) {
      if (!place.is(NodeKind::place)) continue;
      const std::string_view role = place.at(0).text();
      const NodeRef landmark = place.at(1);
      if (!landmark) continue;
      const bool insertion = role == "to";
      (insertion ? m.insertion : m.attachment) = emitter_.string(landmark.text());
      if (const NodeRef offset = place.child(NodeKind::vector))
        if (!vector(offset, scope, insertion ? m.insertion_offset : m.attachment_offset)) return;
    }
    if (m.attachment == program::StringId{0}) {
      evaluator_.report(scope, d.node.child(NodeKind::name),
                        MissingProperty{"a landmark (from, at or about NAME)", std::string(d.name)});
      return;
    }
    const bool needs_insertion = m.kind == MuscleKind::linear || m.kind == MuscleKind::sheet ||
                                 m.kind == MuscleKind::sphincter || m.kind == MuscleKind::eyelid ||
                                 m.kind == MuscleKind::roll;
    if (needs_insertion && m.insertion == program::StringId{0}) {
      evaluator_.report(scope, d.node.child(NodeKind::name),
                        MissingProperty{"an insertion (to NAME)", std::string(d.name)});
      return;
    }
    m.limit = 1.0F;
    if (m.kind == MuscleKind::linear || m.kind == MuscleKind::sheet) m.limit = 0.25F;  // Barker 2005, 4.4.1
    for (NodeRef p : d.node.children())
      if (is_property(p) && !property(p, scope, m)) return;
    if (m.kind == MuscleKind::hinge && m.frame == program::Frame::none) m.frame = program::Frame::jaw;

    const bool sided = d.node.child(NodeKind::sides).exists();
    Found found{std::string(d.name), sided, static_cast<std::uint32_t>(emitter_.draft.muscles.size())};
    for (const program::Side side : {program::Side::left, program::Side::right}) {
      if (!sided && side == program::Side::right) break;
      m.side = sided ? side : program::Side::none;
      m.name = emitter_.string(fmt::format("{}{}", d.name, !sided ? "" : side == program::Side::left ? "_L" : "_R"));
      emitter_.draft.muscles.push_back(m);
    }
    found_.push_back(std::move(found));
  }

  bool property(NodeRef p, const Scope& scope, program::Muscle& m) {
    const std::string_view name = p.at(0).text();
    const NodeRef value = p.at(1);
    const std::string_view word = value ? value.text() : std::string_view();
    const auto bad = [&](std::string_view expected) {
      evaluator_.report(scope, value ? value : p,
                        BadProperty{std::string(name), value ? std::string(word) : "nothing", std::string(expected)});
      return false;
    };
    if (name == "falloff") {
      if (word == "smooth")
        m.falloff = program::Falloff::smooth;
      else if (word == "thesis")
        m.falloff = program::Falloff::thesis;
      else
        return bad("smooth or thesis");
      return true;
    }
    if (name == "region" || name == "except") {
      if (!value || !value.is(NodeKind::name)) return bad("the name of a region of the face");
      (name == "region" ? m.region : m.except) = emitter_.string(word);
      return true;
    }
    if (name == "frame") {
      if (word == "jaw")
        m.frame = program::Frame::jaw;
      else if (word == "head")
        m.frame = program::Frame::head;
      else if (word == "torso")
        m.frame = program::Frame::torso;
      else if (word == "eyes")
        m.frame = program::Frame::eyes;
      else
        return bad("jaw, head, torso or eyes");
      return true;
    }
    if (name == "slide") {
      if (!value || !value.is(NodeKind::vector)) return bad("three lengths: (0mm, -2mm, 5mm)");
      return vector(value, scope, m.slide);
    }
    for (const MuscleProperty& known : kMuscleProperties) {
      if (known.name != name) continue;
      const auto q = value && value.is(NodeKind::quantity) ? lang::read_quantity(word) : std::nullopt;
      if (!q || q->unit != known.unit) return bad(lang::describe(known.unit));
      if (q->value < known.low || q->value > known.high) {
        evaluator_.report(scope, value, OutOfRange{std::string(word), fmt::format("what {} can be", name)});
        return false;
      }
      float v = static_cast<float>(q->value);
      if (known.unit == Unit::angle) v *= kRadian;
      if (known.unit == Unit::length) v /= 1000.0F;
      m.*known.field = v;
      return true;
    }
    std::vector<std::string> names{"falloff", "region", "except", "frame", "slide"};
    for (const MuscleProperty& known : kMuscleProperties) names.emplace_back(known.name);
    evaluator_.report(scope, p.at(0), UnknownProperty{std::string(name), "a muscle", names});
    return false;
  }

  void actuations() {
    std::vector<program::Actuation> out;
    std::vector<std::string> names;
    for (const Found& f : found_) names.push_back(f.name);
    for (const UnitInfo& unit : evaluator_.channels().units) {
      const Declaration& d = unit.declaration;
      if (!d.node.is(NodeKind::au)) continue;
      const Scope scope = scope_of(d);
      for (NodeRef p : d.node.children()) {
        if (!is_property(p) || is_unit_property(p.at(0).text())) continue;
        const std::string_view name = p.at(0).text();
        const auto muscle = std::find_if(found_.begin(), found_.end(), [&](const Found& f) { return f.name == name; });
        if (muscle == found_.end()) {
          evaluator_.report(scope, p.at(0), UnknownName{"muscle", std::string(name), lang::nearest(name, names)});
          continue;
        }
        const NodeRef value = p.at(1);
        const auto q = value && value.is(NodeKind::quantity) ? lang::read_quantity(value.text()) : std::nullopt;
        if (!q || q->unit != Unit::percent) {
          evaluator_.report(scope, value ? value : p,
                            BadProperty{std::string(name), value ? std::string(value.text()) : "nothing",
                                        std::string(lang::describe(Unit::percent))});
          continue;
        }
        if (q->value < -4.0 || q->value > 4.0) {
          evaluator_.report(scope, value, OutOfRange{std::string(value.text()), "-400% to 400%"});
          continue;
        }
        const auto share = static_cast<float>(q->value * unit.sign);
        for (int i = 0; i < 2; ++i) {  // left, right
          if (!unit.sided && i == 1 && !muscle->sided) break;
          const std::uint32_t channel = unit.channel + (unit.sided && i == 1 ? 1U : 0U);
          const std::uint32_t target = muscle->first + (muscle->sided && i == 1 ? 1U : 0U);
          out.push_back({program::ChannelId{channel}, program::MuscleId{target}, share});
        }
      }
    }
    std::stable_sort(out.begin(), out.end(), [](const program::Actuation& a, const program::Actuation& b) {
      return a.channel != b.channel ? a.channel < b.channel : a.muscle < b.muscle;
    });
    // A pair said twice adds up.
    for (const program::Actuation& a : out) {
      auto& all = emitter_.draft.actuations;
      if (!all.empty() && all.back().channel == a.channel && all.back().muscle == a.muscle)
        all.back().share += a.share;
      else
        all.push_back(a);
    }
  }

  struct Found {
    std::string name;
    bool sided;
    std::uint32_t first;
  };
  Evaluator& evaluator_;
  Emitter& emitter_;
  std::vector<Found> found_;
};

}  // namespace

bool read_place(NodeRef node, const Scope& scope, Evaluator& evaluator, float (&out)[3]) {
  int i = 0;
  for (NodeRef q : node.children()) {
    if (!q.is(NodeKind::quantity) || i == 3) continue;
    const auto read = lang::read_quantity(q.text());
    if (!read) return false;
    if (read->unit != Unit::length && read->value != 0.0) {
      evaluator.report(scope, q,
                       UnitMismatch{std::string(q.text()), std::string(lang::describe(read->unit)),
                                    std::string(lang::describe(Unit::length))});
      return false;
    }
    if (read->value < -1e5 || read->value > 1e5) {
      evaluator.report(scope, q, OutOfRange{std::string(q.text()), "100 metres about the face's origin"});
      return false;
    }
    out[i++] = static_cast<float>(read->value / 1000.0);
  }
  return i == 3;
}

void build_rig(const std::string& face_name, Evaluator& evaluator, Emitter& emitter) {
  RigBuilder(evaluator, emitter).build(face_name);
}

}  // namespace nms::compiler
