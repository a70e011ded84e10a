#include "lower_entry.h"

#include <algorithm>
#include <string>
#include <utility>

#include <fmt/format.h>

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
  for (const Oscillation& o : m.oscillations) length = std::max(length, length_of(o));
  return length;
}

/// A pose that alone is declared too strong has been reported there.
void warn_of_saturation(NodeRef sum, const Pose& pose, double intensity, const Placed& placed, const Scope& scope,
                        Evaluator& evaluator) {
  const NodeRef term = sum.at(0);
  if (intensity == 1.0 && !sum.at(1) && !term.at(1) && term.at(0).is(NodeKind::name)) return;
  for (const Amount& a : pose) {
    const ChannelInfo& c = evaluator.channels().channels[a.channel];
    if (a.value <= 1.0 + 1e-9 && a.value >= c.low() - 1e-9) continue;
    evaluator.report_in_use(scope, sum, placed.used,
                            Saturated{c.name, fmt::format("{:.4g}%", a.value * 100.0),
                                      fmt::format("{:.4g}%", a.value > 1.0 ? 100.0 : c.low() * 100.0)});
  }
}

/// `X per cycle`: X once in each cycle of each sign that its span holds, from the sign's start to the end of its
/// stroke. Where an entry is played alone its whole span is one cycle.
void schedule_per_cycle(ClipDraft& clip, const Movement& movement, Placed base, const Scope& scope,
                        const PlacementContext& context, Evaluator& evaluator) {
  if (!movement.pose.empty()) {
    evaluator.report(scope, base.node,
                     WrongKind{std::string(base.name), "a pose", "a motion",
                               "a pose has no cycles; write steps, as (50%: AU25; 50%: 0% AU25), or a swing"});
    return;
  }
  base.extent = Extent::span;
  base.cycles = 1;
  if (context.tier == nullptr && context.entry) {
    schedule(clip, movement, base, scope, evaluator);
    return;
  }
  if (!base.span.has_signs()) {
    evaluator.report(scope, base.node, NoSigns{fmt::format("{} per cycle", base.name)});
    return;
  }
  for (std::uint32_t i = base.span.first_sign; i <= base.span.last_sign; ++i) {
    const Sign& sign = context.tier->signs[i];
    Placed one = base;
    one.span = {sign.start_ns, sign.stroke_end_ns, i, i};
    one.cycles = sign.cycles;
    schedule(clip, movement, one, scope, evaluator);
  }
}

/// Properties an entry may have; phases are read by read_timing.
bool known_entry_property(std::string_view name) {
  for (const std::string_view known :
       {"label", "alias", "meaning", "source", "evidence", "id", "synonym", "spreads", "onset", "offset", "lead", "lag",
        "easing", "held", "apex", "profile", "competes", "before", "excludes"})
    if (name == known) return true;
  return false;
}

/// `when NAME`, `when NAME is WORD`: what the use says of a parameter. `no` is no, and so is a share of nothing.
std::optional<bool> parameter_holds(NodeRef condition, const Scope& scope, Evaluator& evaluator) {
  const NodeRef name = condition.at(0);
  const NodeRef word = condition.at(1);
  for (const Argument& a : scope.arguments) {
    if (a.name != name.text()) continue;
    if (word) return a.word == word.text();
    if (!a.word.empty()) return a.word != "no";
    if (is_scalar(a.quantity.unit)) return a.quantity.value > 0.0;
    evaluator.report(scope, name,
                     WrongKind{std::string(name.text()), std::string(lang::describe(a.quantity.unit)),
                               "a word, a share or a count", ""});
    return std::nullopt;
  }
  std::vector<std::string> known;
  for (const Argument& a : scope.arguments) known.emplace_back(a.name);
  evaluator
      .report(scope, name, UnknownName{"parameter here", std::string(name.text()), lang::nearest(name.text(), known)})
      .helps.push_back(fmt::format("for signs with that tag or gloss, write `sign {} in span`", name.text()));
  return std::nullopt;
}

}  // namespace

std::optional<bool> holds(NodeRef when, const PlacementContext& context, const Scope& scope, Evaluator& evaluator) {
  const NodeRef condition = when.child(NodeKind::condition);
  const NodeRef name = condition.at(0);
  if (when.has(lang::kFlagError) || !name) return std::nullopt;
  if (condition.range().begin == name.range().begin) {
    const auto met = parameter_holds(condition, scope, evaluator);
    if (!met) return std::nullopt;
    return *met != when.has(lang::kFlagUnless);
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
      if (!is_called(s, name.text())) continue;
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
  base.timing =
      read_timing(placement.child(NodeKind::options), scope, evaluator, PropertyOwner::component).over(base.timing);
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
  warn_of_saturation(sum, movement->pose, intensity, base, scope, evaluator);
  if (placement.child(NodeKind::per_cycle))
    schedule_per_cycle(clip, *movement, base, scope, context, evaluator);
  else
    schedule(clip, *movement, base, scope, evaluator);
}

namespace {

/// What a condition or a use leaves out is still checked: a name in it may be wrong.
void check_item(NodeRef item, const Scope& scope, Evaluator& evaluator) {
  if (item.has(lang::kFlagError)) return;
  const NodeRef sum = item.is(NodeKind::placement) ? item.child(NodeKind::sum) : NodeRef();
  if (sum) static_cast<void>(evaluator.sum(sum, scope));
  if (item.is(NodeKind::when) || item.is(NodeKind::optional) || item.is(NodeKind::one_of))
    for (NodeRef inner : item.children()) check_item(inner, scope, evaluator);
}

/// One use of an entry while its items are scheduled.
struct Scheduling {
  ClipDraft& clip;
  const EntryUse& use;
  const Placed& base;
  const PlacementContext& context;
  Evaluator& evaluator;

  /// Anything that may stand in an entry and moves something.
  void item(NodeRef node) const {
    if (node.has(lang::kFlagError)) return;
    switch (node.kind()) {
      case NodeKind::when: {
        const bool met = holds(node, context, use.scope, evaluator).value_or(false);
        for (NodeRef inner : node.children()) met ? item(inner) : check_item(inner, use.scope, evaluator);
        break;
      }
      case NodeKind::optional:
        use.choices.leaves_out(node) ? check_item(node, use.scope, evaluator) : item(node.at(0));
        break;
      case NodeKind::one_of:
        for (NodeRef alternative : node.children())
          use.choices.leaves_out(alternative) ? check_item(alternative, use.scope, evaluator) : item(alternative);
        break;
      case NodeKind::placement:
        schedule_component(clip, node, base, use.intensity, use.scope, context, evaluator);
        break;
      default:
        break;
    }
  }
};

/// Phases and profile of an entry as its conditions have them: what stands deeper wins, then what stands later.
Timing timing_of(NodeRef parent, PropertyOwner owner, const PlacementContext& context, const Scope& scope,
                 Evaluator& evaluator) {
  Timing t = read_timing(parent, scope, evaluator, owner);
  t.profile = read_profile(parent, context.whole, context, scope, evaluator);
  for (NodeRef item : parent.children()) {
    if (!item.is(NodeKind::when) || item.has(lang::kFlagError)) continue;
    const Timing inner = timing_of(item, PropertyOwner::condition, context, scope, evaluator);
    if (holds(item, context, scope, evaluator).value_or(false)) t = inner.over(t);
  }
  return t;
}

void bad_company(NodeRef property, NodeRef at, std::string_view expected, const Scope& scope, Evaluator& evaluator) {
  evaluator.report(
      scope, at ? at : property,
      BadProperty{std::string(property.at(0).text()), at ? std::string(at.text()) : "nothing", std::string(expected)});
}

/// The values of a property that names entries of the same lexicon, or of one that it extends.
void check_entries_named(NodeRef property, const Declaration& entry, const Scope& scope, Evaluator& evaluator) {
  const Declarations& all = evaluator.declarations();
  if (!property.at(1)) return bad_company(property, {}, "names of entries", scope, evaluator);
  for (std::uint32_t v = 1; const NodeRef value = property.at(v); ++v) {
    if (!value.is(NodeKind::name)) {
      bad_company(property, value, "names of entries", scope, evaluator);
      continue;
    }
    if (all.find_entry(value.text(), entry.lexicon) != nullptr) continue;
    std::vector<std::string> known;
    for (const Declaration* d : all.entries_of(entry.lexicon)) known.emplace_back(d->name);
    evaluator.report(scope, value, UnknownName{"entry", std::string(value.text()), lang::nearest(value.text(), known)});
  }
}

/// `evidence CLASS`.
void check_evidence(NodeRef property, const Scope& scope, Evaluator& evaluator) {
  const NodeRef value = property.at(1);
  for (const std::string_view known : {"opened", "abstract", "secondary", "memory", "engineering"})
    if (value && !property.at(2) && value.text() == known) return;
  const NodeRef wrong = property.at(2) ? property.at(2) : value;
  evaluator.report(scope, wrong ? wrong : property,
                   BadProperty{"evidence", std::string(wrong ? wrong.text() : "nothing"),
                               "one of opened, abstract, secondary, memory and engineering"});
}

/// `competes NAME [COUNT]`.
void check_competes(NodeRef property, const Scope& scope, Evaluator& evaluator) {
  if (!property.at(1) || !property.at(1).is(NodeKind::name))
    return bad_company(property, property.at(1), "a name", scope, evaluator);
  const NodeRef count = property.at(2);
  if (!count) return;
  const auto q = count.is(NodeKind::quantity) ? lang::read_quantity(count.text()) : std::nullopt;
  if (!q || q->unit != lang::Unit::count || q->value < 1.0 || property.at(3))
    bad_company(property, count, "a name and at most one count of 1x and above", scope, evaluator);
}

/// `excludes sign X ...`: tags and glosses that no sign in the entry's span may have.
void check_excluded_signs(NodeRef property, std::string_view entry, const PlacementContext& context, NodeRef used,
                          const Scope& scope, Evaluator& evaluator) {
  if (!property.at(2)) return bad_company(property, {}, "`sign` and tags or glosses", scope, evaluator);
  for (std::uint32_t v = 2; const NodeRef value = property.at(v); ++v) {
    if (!value.is(NodeKind::name) && !value.is(NodeKind::string)) {
      bad_company(property, value, "tags or glosses", scope, evaluator);
      continue;
    }
    if (context.tier == nullptr) continue;
    const std::string wanted = value.is(NodeKind::string) ? unquoted(value) : std::string(value.text());
    for (const Sign& s : context.tier->signs) {
      if (s.start_ns < context.whole.start_ns || s.end_ns > context.whole.end_ns || !is_called(s, wanted)) continue;
      lang::Diagnostic& d = evaluator.report(
          scope, used,
          ExcludedSign{std::string(entry), std::string(s.gloss), s.tag == wanted ? wanted : std::string()});
      d.labels = {{s.node.tree().source_pointer(), s.node.range(), "this sign"}};
    }
  }
}

/// What an entry says of others beside it.
void check_company(NodeRef property, const Declaration& entry, const PlacementContext& context, NodeRef used,
                   const Scope& scope, Evaluator& evaluator) {
  const std::string_view name = property.at(0).text();
  if (name == "competes") check_competes(property, scope, evaluator);
  const bool signs = name == "excludes" && property.at(1).exists() && property.at(1).text() == "sign";
  if (signs) check_excluded_signs(property, entry.name, context, used, scope, evaluator);
  if (name == "synonym" || name == "before" || (name == "excludes" && !signs))
    check_entries_named(property, entry, scope, evaluator);
}

}  // namespace

void schedule_entry(ClipDraft& clip, const Declaration& entry, const EntryUse& use, const Span& span,
                    const ManualTier* tier, Evaluator& evaluator) {
  if (entry.node.has(lang::kFlagError)) return;
  const Scope& scope = use.scope;
  Placed base;
  base.layer = Layer::lexical;
  if (const NodeRef function = entry.node.child(NodeKind::function)) {
    if (const auto read = read_layer(function.text())) {
      base.layer = *read;
    } else {
      evaluator.report(scope, function,
                       UnknownName{"function", std::string(function.text()),
                                   lang::nearest(function.text(), {"affect", "prosody", "mouthing", "lexical",
                                                                   "morphological", "syntactic", "discourse"})});
      return;
    }
  }
  const PlacementContext context{tier, span, true};
  base.span = span;
  base.extent = Extent::natural;
  base.timing = use.timing.over(timing_of(entry.node, PropertyOwner::entry, context, scope, evaluator));
  base.entry = entry.name;
  base.used = use.node;
  base.cause = static_cast<std::uint32_t>(clip.causes.size());
  clip.causes.push_back({entry.name, use.node, span, &entry});
  const Scheduling scheduling{clip, use, base, context, evaluator};
  for (NodeRef item : entry.node.children()) {
    if (is_property(item) && !known_entry_property(item.at(0).text()))
      evaluator.report(
          scope, item.at(0),
          UnknownProperty{std::string(item.at(0).text()),
                          "an entry",
                          {"label", "alias", "meaning", "source", "evidence", "id", "synonym", "spreads", "onset",
                           "offset", "lead", "lag", "easing", "profile", "held", "competes", "before", "excludes"}});
    if (is_property(item) && item.at(0).text() == "evidence") check_evidence(item, scope, evaluator);
    if (is_property(item)) check_company(item, entry, context, use.node, scope, evaluator);
    scheduling.item(item);
  }
}

}  // namespace nms::compiler
