#include "lower_entry.h"

#include <algorithm>
#include <string>
#include <utility>

#include <nms/compiler/diagnostic_kinds.h>

#include "profile.h"

namespace nms::compiler {

using lang::NodeKind;
using lang::NodeRef;

std::string_view spreading_of(const Declaration& entry) {
  for (NodeRef p : entry.node.children())
    if (is_property(p) && p.at(0).text() == "spreads" && p.at(1)) return p.at(1).text();
  return {};
}

namespace {

/// What an author calls a component: the name in it that says most.
std::string_view component_name(NodeRef sum) {
  std::string_view name = sum.text();
  for (NodeRef term : sum.children())
    for (NodeRef part : term.children()) {
      if (part.is(NodeKind::name)) return part.text();
      if (part.is(NodeKind::call)) return part.at(0).text();
    }
  return name;
}

void scale(Movement& m, double factor) {
  if (factor == 1.0) return;
  for (Amount& a : m.pose) a.value *= factor;
  for (Sequence& s : m.sequences)
    for (Step& step : s.steps)
      for (Amount& a : step.pose) a.value *= factor;
  for (Oscillation& o : m.oscillations) o.by *= factor;
}

/// How long steps and swings last by themselves.
std::int64_t own_length(const Movement& m) {
  std::int64_t length = 0;
  for (const Sequence& s : m.sequences) length = std::max(length, s.duration_ns);
  for (const Oscillation& o : m.oscillations)
    length = std::max(length, static_cast<std::int64_t>(o.count / o.rate_hz * 1e9 + 0.5));
  return length;
}

/// Properties an entry may have; phases are read by read_timing.
bool known_entry_property(std::string_view name) {
  for (const std::string_view known :
       {"label", "alias", "meaning", "source", "evidence", "id", "synonym", "spreads", "onset", "offset", "lead", "lag",
        "easing", "held", "apex", "profile", "competes", "before"})
    if (name == known) return true;
  return false;
}

}  // namespace

std::optional<bool> holds(NodeRef when, const PlacementContext& context, const Scope& scope, Evaluator& evaluator) {
  const NodeRef condition = when.child(NodeKind::condition);
  const NodeRef name = condition.at(0);
  if (when.has(lang::kFlagError) || !name) return std::nullopt;
  if (condition.text() == name.text()) {  // `when NAME`: what would have to be the case, nobody has said
    evaluator.report(scope, condition, NotCompiled{"a condition other than `sign TAG in span`"});
    return std::nullopt;
  }
  bool in_span = false;
  if (const NodeRef in = condition.at(1)) {
    in_span = in.text() == "span";
    if (!in_span && in.text() != "utterance") {
      evaluator.report(scope, in, UnknownName{"span of a condition", std::string(in.text()), {"span", "utterance"}});
      return std::nullopt;
    }
  }
  bool found = false;
  if (context.tier != nullptr)
    for (const Sign& s : context.tier->signs) {
      if (s.tag != name.text() && s.gloss != name.text()) continue;
      found |= !in_span || (s.start_ns >= context.whole.start_ns && s.end_ns <= context.whole.end_ns);
    }
  return found != when.has(lang::kFlagUnless);
}

void schedule_component(ClipDraft& clip, NodeRef placement, Placed base, double intensity, const Scope& scope,
                        const PlacementContext& context, Evaluator& evaluator) {
  if (placement.has(lang::kFlagError)) return;
  const NodeRef sum = placement.child(NodeKind::sum);
  if (!sum) return;
  Placer placer(evaluator, scope, context);
  base.node = sum;
  if (base.name.empty()) base.name = component_name(sum);
  base.timing = read_timing(placement.child(NodeKind::options), scope, evaluator, false).over(base.timing);
  base.fill = placement.child(NodeKind::fill).exists();
  if (const NodeRef over = placement.child(NodeKind::over)) {
    const auto span = placer.over(over);
    if (!span) return;
    base.span = *span;
    base.extent = Extent::span;
  } else if (const NodeRef at = placement.child(NodeKind::at)) {
    const NodeRef point = at.child(NodeKind::point);
    if (!point) return;
    const auto time = placer.point(point);
    if (!time) return;
    base.span = {*time, *time, kUnreachable, kUnreachable};
    base.extent = Extent::point;
    if (const NodeRef duration = at.child(NodeKind::duration)) {
      const NodeRef amount = duration.child(NodeKind::quantity);
      const auto length = amount ? evaluator.quantity(amount, lang::Unit::time, scope) : std::nullopt;
      if (!length) return;
      if (length->nanoseconds <= 0) {
        evaluator.report(scope, amount, OutOfRange{std::string(amount.text()), "times above 0s"});
        return;
      }
      base.span.end_ns = *time + length->nanoseconds;
      base.extent = Extent::span;
    }
  } else if (const NodeRef on = placement.child(NodeKind::on)) {
    const NodeRef name = on.at(0);
    const auto s = name ? placer.sign(name) : std::nullopt;
    if (!s) return;
    const Sign& sign = context.tier->signs[*s];
    base.span = {sign.start_ns, sign.end_ns, *s, *s};
    base.extent = Extent::span;
  }
  auto movement = evaluator.sum(sum, scope);
  if (!movement) return;
  if (base.cause == kUnreachable) {
    base.cause = static_cast<std::uint32_t>(clip.causes.size());
    Span span = base.span;
    if (base.extent == Extent::point) span.end_ns = span.start_ns + own_length(*movement);
    clip.causes.push_back({base.name, sum, span, nullptr});
  }
  scale(*movement, intensity);
  const NodeRef options = placement.child(NodeKind::options);
  if (options && movement->pose.empty() && movement->sequences.empty())
    for (NodeRef p : options.children())
      if (is_property(p) && p.at(0).text() == "held")
        evaluator.report(scope, p, BadProperty{"held", std::string(base.name), "a pose or steps"});
  if (options && options.child(NodeKind::profile)) {
    Span span = base.span;
    if (base.extent != Extent::span && !base.fill && movement->pose.empty())
      if (const std::int64_t length = own_length(*movement); length > 0) span.end_ns = span.start_ns + length;
    base.timing.profile = read_profile(options, span, context, scope, evaluator);
  }
  schedule(clip, *movement, base, scope, evaluator);
}

namespace {

/// What a condition leaves out is still checked: a name in it may be wrong.
void check_item(NodeRef item, const Scope& scope, Evaluator& evaluator) {
  if (item.has(lang::kFlagError)) return;
  const NodeRef sum = item.is(NodeKind::placement) ? item.child(NodeKind::sum) : NodeRef();
  if (sum) static_cast<void>(evaluator.sum(sum, scope));
  if (item.is(NodeKind::optional)) evaluator.report(scope, item, NotCompiled{"optional"});
  if (item.is(NodeKind::one_of)) evaluator.report(scope, item, NotCompiled{"one of"});
  if (item.is(NodeKind::when))
    for (NodeRef inner : item.children()) check_item(inner, scope, evaluator);
}

/// Anything that may stand in an entry and moves something.
void schedule_item(ClipDraft& clip, NodeRef item, const Placed& base, double intensity, const Scope& scope,
                   const PlacementContext& context, Evaluator& evaluator) {
  switch (item.kind()) {
    case NodeKind::when: {
      if (item.has(lang::kFlagError)) break;
      const auto active = holds(item, context, scope, evaluator);
      for (NodeRef inner : item.children()) {
        if (inner.is(NodeKind::property) || inner.is(NodeKind::profile))
          evaluator.report(scope, inner, NotCompiled{"a property under a condition"});
        else if (active.value_or(false))
          schedule_item(clip, inner, base, intensity, scope, context, evaluator);
        else
          check_item(inner, scope, evaluator);
      }
      break;
    }
    case NodeKind::optional:
      evaluator.report(scope, item, NotCompiled{"optional"});
      break;
    case NodeKind::one_of:
      evaluator.report(scope, item, NotCompiled{"one of"});
      break;
    case NodeKind::placement:
      schedule_component(clip, item, base, intensity, scope, context, evaluator);
      break;
    default:
      break;
  }
}

/// `synonym mm pah`: entries of the same lexicon, or of one that it extends, that may look the same.
void check_synonyms(NodeRef property, const Declaration& entry, const Scope& scope, Evaluator& evaluator) {
  const Declarations& all = evaluator.declarations();
  for (NodeRef value : property.children()) {
    if (value == property.at(0) || all.find_entry(value.text(), entry.lexicon) != nullptr) continue;
    std::vector<std::string> known;
    for (const Declaration* d : all.entries_of(entry.lexicon)) known.emplace_back(d->name);
    evaluator.report(scope, value, UnknownName{"entry", std::string(value.text()), lang::nearest(value.text(), known)});
  }
}

}  // namespace

namespace {

/// `competes NAME [COUNT]`, `before NAME ...`: what an entry says of others beside it.
void check_company(NodeRef property, const Scope& scope, Evaluator& evaluator) {
  const std::string_view name = property.at(0).text();
  const bool competes = name == "competes";
  const auto bad = [&](NodeRef at, std::string_view expected) {
    evaluator.report(scope, at ? at : property,
                     BadProperty{std::string(name), at ? std::string(at.text()) : "nothing", std::string(expected)});
  };
  if (!property.at(1) || !property.at(1).is(NodeKind::name))
    return bad(property.at(1), competes ? "a name" : "names of entries");
  if (!competes) {
    bool first = true;
    for (NodeRef other : property.children())
      if (!std::exchange(first, false) && !other.is(NodeKind::name)) bad(other, "names of entries");
    return;
  }
  const NodeRef count = property.at(2);
  if (!count) return;
  const auto q = count.is(NodeKind::quantity) ? lang::read_quantity(count.text()) : std::nullopt;
  if (!q || q->unit != lang::Unit::count || q->value < 1.0 || property.at(3))
    bad(count, "a name and at most one count of 1x and above");
}

}  // namespace

void schedule_entry(ClipDraft& clip, const Declaration& entry, const Scope& scope, const Span& span, const Timing& use,
                    double intensity, const ManualTier* tier, Evaluator& evaluator, NodeRef used) {
  if (entry.node.has(lang::kFlagError)) return;
  Layer layer = Layer::lexical;
  if (const NodeRef function = entry.node.child(NodeKind::function)) {
    if (const auto read = read_layer(function.text())) {
      layer = *read;
    } else {
      evaluator.report(scope, function,
                       UnknownName{"function", std::string(function.text()),
                                   lang::nearest(function.text(), {"affect", "prosody", "mouthing", "lexical",
                                                                   "morphological", "syntactic", "discourse"})});
      return;
    }
  }
  Timing own = read_timing(entry.node, scope, evaluator, true);
  PlacementContext context{tier, span, true};
  own.profile = read_profile(entry.node, span, context, scope, evaluator);
  Placed base;
  base.span = span;
  base.extent = Extent::natural;
  base.timing = use.over(own);
  base.layer = layer;
  base.entry = entry.name;
  base.used = used;
  base.cause = static_cast<std::uint32_t>(clip.causes.size());
  clip.causes.push_back({entry.name, used, span, &entry});
  for (NodeRef item : entry.node.children()) {
    if (is_property(item) && item.at(0).text() == "synonym") check_synonyms(item, entry, scope, evaluator);
    if (is_property(item) && !known_entry_property(item.at(0).text()))
      evaluator.report(
          scope, item.at(0),
          UnknownProperty{std::string(item.at(0).text()),
                          "an entry",
                          {"label", "alias", "meaning", "source", "evidence", "id", "synonym", "spreads", "onset",
                           "offset", "lead", "lag", "easing", "profile", "held", "competes", "before"}});
    if (is_property(item) && (item.at(0).text() == "competes" || item.at(0).text() == "before"))
      check_company(item, scope, evaluator);
    schedule_item(clip, item, base, intensity, scope, context, evaluator);
  }
}

}  // namespace nms::compiler
