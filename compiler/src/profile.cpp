#include "profile.h"

#include <string>

#include <fmt/format.h>

#include <nms/compiler/diagnostic_kinds.h>

namespace nms::compiler {

using lang::NodeKind;
using lang::NodeRef;

namespace {

/// The profiles that have a name. The numbers are engineering defaults: no corpus states them.
struct NamedProfile {
  std::string_view name;
  double start, end;
};
constexpr NamedProfile kProfiles[] = {{"flat", 1.0, 1.0}, {"crescendo", 0.6, 1.0}, {"decrescendo", 1.0, 0.6}};

std::string seconds(std::int64_t ns) { return fmt::format("{:.6g}s", static_cast<double>(ns) / 1e9); }

void add_point(Curve& curve, std::int64_t time_ns, double factor) {
  ease_to(curve, time_ns, factor, Easing::linear, 0xFFFFFFFFU);
}

/// `clause`, `start of SIGN` and the like in an entry that is played alone: there are no signs to find.
bool at_a_sign(NodeRef where) {
  if (where.is(NodeKind::gloss)) return true;
  const NodeRef anchor = where.child(NodeKind::anchor);
  return anchor && anchor.at(0) && !anchor.text().starts_with("mark");
}

}  // namespace

std::optional<Curve> read_profile(NodeRef parent, const Span& span, const PlacementContext& context, const Scope& scope,
                                  Evaluator& evaluator) {
  const NodeRef node = parent ? parent.child(NodeKind::profile) : NodeRef();
  if (!node || node.has(lang::kFlagError)) return std::nullopt;
  Curve out;
  if (const NodeRef name = node.child(NodeKind::name)) {
    std::vector<std::string> known;
    for (const NamedProfile& p : kProfiles) {
      known.emplace_back(p.name);
      if (p.name != name.text()) continue;
      add_point(out, span.start_ns, p.start);
      add_point(out, span.end_ns, p.end);
      return out;
    }
    evaluator.report(scope, name,
                     UnknownName{"profile", std::string(name.text()), lang::nearest(name.text(), known, 3)});
    return std::nullopt;
  }
  PlacementContext inside = context;
  inside.whole = span;
  Placer placer(evaluator, scope, inside);
  for (NodeRef point : node.children()) {
    const NodeRef share = point.at(0);
    const NodeRef where = point.at(1);
    if (!share || !where) continue;
    const auto factor = evaluator.quantity(share, lang::Unit::percent, scope);
    if (!factor) return std::nullopt;
    if (factor->value < 0.0 || factor->value > 1.0) {
      evaluator.report(scope, share, OutOfRange{std::string(share.text()), "0% to 100%"});
      return std::nullopt;
    }
    std::optional<std::int64_t> time;
    if (where.is(NodeKind::name)) {
      time = where.text() == "start" ? span.start_ns : span.end_ns;
    } else if (context.entry && context.tier == nullptr && at_a_sign(where)) {
      continue;
    } else if (where.is(NodeKind::gloss)) {
      const auto sign = placer.sign(where);
      if (!sign) return std::nullopt;
      time = context.tier->signs[*sign].start_ns;
    } else {
      time = placer.point(where);
    }
    if (!time) return std::nullopt;
    if (*time < span.start_ns || *time > span.end_ns) {
      evaluator.report(
          scope, point,
          BadProfile{std::string(where.text()), fmt::format("is at {}, outside the span from {} to {}", seconds(*time),
                                                            seconds(span.start_ns), seconds(span.end_ns))});
      return std::nullopt;
    }
    if (!out.empty() && *time <= out.knots.back().time_ns) {
      evaluator.report(
          scope, point,
          BadProfile{std::string(where.text()), fmt::format("is at {}, not after the point in front of it, at {}",
                                                            seconds(*time), seconds(out.knots.back().time_ns))});
      return std::nullopt;
    }
    add_point(out, *time, factor->value);
  }
  if (out.empty()) return std::nullopt;
  return out;
}

Curve profiled(const Curve& curve, const Curve& profile) {
  if (curve.empty()) return curve;
  // What is left out, cut down to the curve's time so that the curve is not made longer.
  const std::int64_t begin = curve.knots.front().time_ns;
  const std::int64_t end = curve.knots.back().time_ns;
  Curve without;
  add_point(without, begin, 1.0 - profile.value(begin));
  for (const CurveKnot& k : profile.knots)
    if (k.time_ns > begin && k.time_ns < end) add_point(without, k.time_ns, 1.0 - k.value);
  add_point(without, end, 1.0 - profile.value(end));
  return replaced(curve, {}, without);
}

}  // namespace nms::compiler
