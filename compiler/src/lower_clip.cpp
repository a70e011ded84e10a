#include "lower_clip.h"

#include <algorithm>
#include <string>

#include <fmt/format.h>

#include <nms/compiler/diagnostic_kinds.h>

#include "ambient.h"
#include "competition.h"
#include "lower_entry.h"

namespace nms::compiler {

using lang::NodeKind;
using lang::NodeRef;
using lang::Unit;

namespace {

Scope default_scope(const Declaration& d, Evaluator& evaluator, bool& good) {
  Scope outer;
  outer.file = d.file;
  auto bound = evaluator.bind({}, false, d.name, evaluator.declarations().params(d), d.file, outer);
  good = bound.has_value();
  return good ? *bound : outer;
}

}  // namespace

std::optional<std::uint32_t> lexicon_in(const Declaration& d, const Scope& scope, Evaluator& evaluator) {
  const NodeRef in = d.node.child(NodeKind::in);
  const NodeRef name = in ? in.child(NodeKind::name) : NodeRef();
  if (!name) return kUnreachable;
  const std::uint32_t found = evaluator.declarations().find_lexicon(name.text());
  if (found != kUnreachable) return found;
  std::vector<std::string> known;
  for (const LexiconDeclaration& l : evaluator.declarations().lexicons) known.emplace_back(l.declaration.name);
  evaluator.report(scope, name, MissingLexicon{std::string(name.text()), lang::nearest(name.text(), known), ""});
  return std::nullopt;
}

void extend(ClipDraft& clip) {
  for (const Contribution& c : clip.contributions) {
    clip.start_ns = std::min(clip.start_ns, c.curve.knots.empty() ? c.start_ns : c.curve.knots.front().time_ns);
    clip.end_ns = std::max(clip.end_ns, c.curve.knots.empty() ? c.end_ns : c.curve.knots.back().time_ns);
  }
}

void finish(ClipDraft& clip, const Scope& scope, Evaluator& evaluator) {
  give_way(clip, evaluator.channels());
  check_competition(clip, scope, evaluator);
  extend(clip);
}

void mark_markers(ClipDraft& clip, const OutsideTimes::InClip& in) {
  for (const OutsideTimes::Used& mark : in.used())
    clip.markers.push_back({mark.time_ns, std::string(mark.name), program::MarkerKind::mark});
}

std::int64_t carrier_ns(const Declaration& entry) {
  // Median lengths of what entries spread over (NCSLGR corpus): content questions 1300 ms, negated phrases 1033 ms,
  // topics 633 ms, utterance-final signs 400 ms.
  const std::string_view spreads = spreading_of(entry);
  if (spreads == "clause") return 1'300'000'000;
  if (spreads == "phrase") return 1'033'000'000;
  if (spreads == "topic") return 633'000'000;
  return 400'000'000;
}

namespace {

/// The one share that an entry without parameters takes, neg(60%). Nothing: it is wrong, which has been reported.
std::optional<double> intensity_of(const Declaration& e, NodeRef call, const Scope& scope, Evaluator& evaluator) {
  std::optional<double> out;
  for (NodeRef a : call.children()) {
    // A bracket is a call too, and its signs come after its arguments.
    if (!a.is(NodeKind::argument) || evaluator.degree(a, scope)) continue;
    const NodeRef given = a.at(a.has(lang::kFlagNamed) ? 1 : 0);
    const auto value = given && !out ? evaluator.arithmetic(given, scope) : std::nullopt;
    if (!value || !value->word.empty() || value->quantity.unit != Unit::percent ||
        (a.has(lang::kFlagNamed) && a.at(0).text() != "intensity")) {
      evaluator.report(scope, a, UnexpectedArgument{std::string(e.name), std::string(a.text()), {"intensity"}});
      return std::nullopt;
    }
    if (value->quantity.value < 0.0) {
      evaluator.report(scope, a, OutOfRange{std::string(a.text()), "0% and above"});
      return std::nullopt;
    }
    out = value->quantity.value;
  }
  return out.value_or(1.0);
}

/// A parameter that a condition asks is one of the words that some condition or its default knows.
bool known_words(const Declaration& e, NodeRef call, const Scope& bound, const Scope& scope, Evaluator& evaluator) {
  bool good = true;
  for (const Argument& a : bound.arguments) {
    if (a.word.empty()) continue;
    std::vector<std::string> known;
    for (std::uint32_t i = e.node.index() + 1; i < e.node.node().next; ++i) {
      const NodeRef n(&e.node.tree(), i);
      if (!n.is(NodeKind::condition) || n.at(0).text() != a.name || n.range().begin != n.at(0).range().begin) continue;
      if (n.at(1))
        known.emplace_back(n.at(1).text());
      else
        known.insert(known.end(), {"yes", "no"});
    }
    if (known.empty()) continue;  // no condition asks it
    for (NodeRef p : e.node.child(NodeKind::params).children())
      if (p.at(0).text() == a.name && p.at(1).is(NodeKind::name)) known.emplace_back(p.at(1).text());
    if (std::find(known.begin(), known.end(), a.word) != known.end()) continue;
    std::sort(known.begin(), known.end());
    known.erase(std::unique(known.begin(), known.end()), known.end());
    std::string words = known.front();
    for (std::size_t i = 1; i < known.size(); ++i) words += (i + 1 == known.size() ? " or " : ", ") + known[i];
    evaluator.report(scope, call ? call : e.node.child(NodeKind::params),
                     BadProperty{std::string(a.name), std::string(a.word), std::move(words)});
    good = false;
  }
  return good;
}

}  // namespace

std::optional<EntryUse> bind_entry(const Declaration& e, NodeRef call, const Scope& scope, Evaluator& evaluator,
                                   double degree) {
  const NodeRef params = e.node.child(NodeKind::params);
  if (call)
    for (NodeRef a : call.children())
      if (a.is(NodeKind::argument)) degree *= evaluator.degree(a, scope).value_or(1.0);
  EntryUse use;
  std::optional<Scope> inner;
  if (!params && call && call.child(NodeKind::argument)) {
    const auto intensity = intensity_of(e, call, scope, evaluator);
    if (!intensity) return std::nullopt;
    use.intensity = *intensity;
    inner = Scope{e.file, {}, scope.left_handed, scope.places};
  } else {
    inner = evaluator.bind(call, false, e.name, params, e.file, scope, true);
  }
  if (!inner || !known_words(e, call, *inner, scope, evaluator)) return std::nullopt;
  use.scope = std::move(*inner);
  // A degree scales what the entry itself calls its intensity; where it declares none, all of it.
  bool declared = false;
  for (Argument& a : use.scope.arguments) {
    if (a.name != "intensity" || !a.word.empty() || !is_scalar(a.quantity.unit)) continue;
    a.quantity.value *= degree;
    declared = true;
  }
  if (!declared) use.intensity *= degree;
  use.choices = Choices::of_use(e, {}, true, scope, evaluator);
  return use;
}

std::optional<ClipDraft> lower_expression(const Declaration& d, Evaluator& evaluator) {
  bool good = true;
  const Scope scope = default_scope(d, evaluator, good);
  if (!good) return std::nullopt;
  const auto movement = evaluator.declaration(d, scope);
  if (!movement || movement->sequences.empty()) return std::nullopt;
  const Sequence& s = movement->sequences.front();
  if (s.steps.empty()) return std::nullopt;
  if (s.duration_ns < 0) return std::nullopt;  // the placement gives the length: nothing to play alone
  ClipDraft clip;
  clip.name = d.name;
  clip.kind = program::ClipKind::expression;
  clip.end_ns = s.duration_ns;
  Placed placed;
  placed.entry = d.name;
  play_sequence(clip, s, 0, s.duration_ns, false, placed, evaluator);
  finish(clip, scope, evaluator);
  return clip;
}

std::optional<ClipDraft> lower_timeline(const Declaration& d, Evaluator& evaluator) {
  if (d.node.has(lang::kFlagError)) return std::nullopt;
  bool good = true;
  const Scope scope = default_scope(d, evaluator, good);
  if (!good) return std::nullopt;
  return lower_timeline(d, scope, evaluator);
}

std::optional<ClipDraft> lower_timeline(const Declaration& d, const Scope& scope, Evaluator& evaluator) {
  const OutsideTimes::InClip in(evaluator.outside(), d.name);
  ClipDraft clip;
  clip.name = d.name;
  clip.kind = program::ClipKind::timeline;
  std::int64_t length = 0;
  const NodeRef stated = d.node.child(NodeKind::quantity);
  if (stated) {
    const auto q = evaluator.quantity(stated, Unit::time, scope);
    if (!q) return std::nullopt;
    if (q->nanoseconds <= 0) {
      evaluator.report(scope, stated, OutOfRange{std::string(stated.text()), "times above 0s"});
      return std::nullopt;
    }
    length = q->nanoseconds;
  }
  PlacementContext context{nullptr, {0, length, kUnreachable, kUnreachable}};
  for (NodeRef item : d.node.children()) {
    if (!item.is(NodeKind::placement)) continue;
    const bool placed = item.child(NodeKind::over) || item.child(NodeKind::at) || item.child(NodeKind::on);
    if (!placed && !stated) {
      evaluator.report(scope, item, MissingDuration{std::string(item.text())});
      continue;
    }
    Placed base;
    base.span = context.whole;
    base.extent = Extent::natural;
    const std::size_t before = clip.contributions.size();
    schedule_component(clip, item, base, 1.0, scope, context, evaluator);
    std::int64_t end = 0;
    for (std::size_t i = before; i < clip.contributions.size(); ++i) end = std::max(end, clip.contributions[i].end_ns);
    // The way back to rest may lie past the end of what the author timed; a second of it is nobody's mistake.
    if (stated && end > length + 1'000'000'000)
      evaluator.report(
          scope, item,
          OutlastsTimeline{fmt::format("{:.6g}s", static_cast<double>(end) / 1e9), std::string(stated.text())});
  }
  clip.end_ns = length;
  mark_markers(clip, in);
  finish(clip, scope, evaluator);
  place_ambient(clip, {d.node}, scope, evaluator);
  return clip;
}

std::optional<ClipDraft> lower_entry(const Declaration& d, Evaluator& evaluator) {
  Scope outer;
  outer.file = d.file;
  const auto use = bind_entry(d, {}, outer, evaluator);
  if (!use) return std::nullopt;
  return lower_entry(d, *use, carrier_ns(d), evaluator);
}

std::optional<ClipDraft> lower_entry(const Declaration& d, const EntryUse& use, std::int64_t length_ns,
                                     Evaluator& evaluator) {
  const OutsideTimes::InClip in(evaluator.outside(), d.name);
  ClipDraft clip;
  clip.name = d.name;
  clip.kind = program::ClipKind::entry;
  const Span span{0, length_ns, kUnreachable, kUnreachable};
  clip.end_ns = span.end_ns;
  schedule_entry(clip, d, use, span, nullptr, evaluator);
  mark_markers(clip, in);
  finish(clip, use.scope, evaluator);
  return clip;
}

}  // namespace nms::compiler
