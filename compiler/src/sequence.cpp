#include "movement.h"

#include <algorithm>

#include <fmt/format.h>

#include <nms/compiler/diagnostic_kinds.h>

namespace nms::compiler {

using lang::NodeKind;
using lang::NodeRef;
using lang::Quantity;
using lang::Unit;

namespace {

constexpr std::size_t kMaxSteps = 10'000;

}  // namespace

bool Evaluator::oscillate(NodeRef call, const Scale& scale, const Scope& scope, Movement& into) {
  static constexpr std::string_view kNames[] = {"axis", "count", "rate", "by", "decay"};
  static constexpr Unit kUnits[] = {Unit::none, Unit::count, Unit::frequency, Unit::none, Unit::percent};
  std::optional<Argument> value[5];
  std::size_t position = 0;
  for (NodeRef a : call.children()) {
    if (!a.is(NodeKind::argument)) continue;
    std::size_t slot = position;
    const bool is_named = a.has(lang::kFlagNamed);
    if (is_named) {
      const auto* it = std::find(std::begin(kNames), std::end(kNames), a.at(0).text());
      slot = static_cast<std::size_t>(it - std::begin(kNames));
    }
    if (slot >= 5 || value[slot]) {
      report(scope, a,
             UnexpectedArgument{"oscillate", std::string(a.text()), {"axis", "count", "rate", "by", "decay"}});
      return false;
    }
    const NodeRef sum_node = a.at(is_named ? 1 : 0);
    if (!sum_node) return false;
    value[slot] = arithmetic(sum_node, scope);
    if (!value[slot]) return false;
    if (slot != 0 &&
        (!value[slot]->word.empty() || (kUnits[slot] != Unit::none && value[slot]->quantity.unit != kUnits[slot] &&
                                        !(kUnits[slot] == Unit::percent && is_scalar(value[slot]->quantity.unit)) &&
                                        !(kUnits[slot] == Unit::count && value[slot]->quantity.unit == Unit::none)))) {
      report(
          scope, sum_node,
          UnitMismatch{std::string(sum_node.text()),
                       value[slot]->word.empty() ? std::string(lang::describe(value[slot]->quantity.unit)) : "a word",
                       std::string(lang::describe(kUnits[slot]))});
      return false;
    }
    ++position;
  }
  for (std::size_t i = 0; i < 4; ++i)
    if (!value[i]) {
      report(scope, call, MissingArgument{"oscillate", std::string(kNames[i])});
      return false;
    }
  Oscillation o;
  o.channel = channels_.find_axis(value[0]->word);
  if (o.channel == kUnreachable) {
    std::vector<std::string> axes;
    for (const ChannelInfo& c : channels_.channels)
      if (c.is_axis()) axes.push_back(c.name);
    report(scope, call, UnknownName{"axis", std::string(value[0]->word), lang::nearest(value[0]->word, axes)});
    return false;
  }
  const ChannelInfo& channel = channels_.channels[o.channel];
  o.count = value[1]->quantity.value;
  o.rate_hz = value[2]->quantity.value;
  o.decay = value[4] ? value[4]->quantity.value : 0.0;
  const Quantity& by = value[3]->quantity;
  if (is_scalar(by.unit)) {
    o.by = by.value;
  } else if (by.unit == channel.unit) {
    o.by = by.value / (channel.full_scale < 0.0 ? -channel.full_scale : channel.full_scale);
  } else {
    report(scope, call,
           UnitMismatch{"by", std::string(lang::describe(by.unit)), std::string(lang::describe(channel.unit))});
    return false;
  }
  const auto outside = [&](const char* what, const char* range) {
    report(scope, call, OutOfRange{what, range});
    return false;
  };
  if (!(o.count >= 0.5 && o.count <= 1000.0)) return outside("count", "0.5x to 1000x");
  if (!(o.rate_hz >= 0.01 && o.rate_hz <= 100.0)) return outside("rate", "0.01Hz to 100Hz");
  if (!(o.decay >= 0.0 && o.decay <= 1.0)) return outside("decay", "0% to 100%");
  if (!(o.by >= -10.0 && o.by <= 10.0)) return outside("by", "ten times the axis' full scale");
  Movement part;
  part.oscillations.push_back(o);
  return take(std::move(part), scale, call, scope, into);
}

std::optional<Easing> Evaluator::easing(NodeRef value, const Scope& scope) {
  const std::string_view word = value ? value.text() : std::string_view();
  if (word == "smooth") return Easing::smooth;
  if (word == "linear") return Easing::linear;
  if (word == "cosine") return Easing::cosine;
  if (word == "step") return Easing::step;
  if (word == "spring") return Easing::spring;
  if (value) report(scope, value, BadProperty{"easing", std::string(word), "smooth, linear, cosine, step or spring"});
  return std::nullopt;
}

std::optional<Sequence> Evaluator::sequence(NodeRef parent, std::string_view name,
                                            std::optional<std::int64_t> duration_ns, const Scope& scope) {
  Sequence out;
  out.name = name;
  bool good = true;
  double shares = 0.0;
  std::int64_t own = 0;
  bool any_share = false;
  NodeRef last;
  constexpr std::size_t kUsual = 4;  // steps in most expressions: one allocation
  out.steps.reserve(kUsual);
  for (NodeRef node : parent.children()) {
    if (!node.is(NodeKind::step)) continue;
    last = node;
    Step step;
    step.node = node;
    step.file = scope.file;
    const NodeRef amount = node.child(NodeKind::quantity);
    const auto q = amount ? lang::read_quantity(amount.text()) : std::nullopt;
    if (!q) return std::nullopt;
    if (q->unit == Unit::time) {
      step.own_ns = q->nanoseconds;
      own += q->nanoseconds;
    } else if (q->unit == Unit::percent) {
      step.share = q->value;
      shares += q->value;
      any_share = true;
    } else {
      report(scope, amount,
             UnitMismatch{std::string(amount.text()), std::string(lang::describe(q->unit)),
                          "a share of the whole (10%) or a time (250ms)"});
      good = false;
    }
    if (q->value < 0.0) {
      report(scope, amount, OutOfRange{std::string(amount.text()), "0 and above"});
      good = false;
    }
    if (const NodeRef options = node.child(NodeKind::options))
      for (NodeRef p : options.children()) {
        if (p.is(NodeKind::profile)) {
          report(scope, p, UnknownProperty{"profile", "a step", {"easing"}})
              .helps.emplace_back("steps say by themselves how far the face has come: a profile is for what is placed");
          good = false;
        } else if (is_property(p) && p.at(0).text() == "easing") {
          const auto e = easing(p.at(1), scope);
          good = good && e.has_value();
          step.easing = e.value_or(Easing::smooth);
        } else if (is_property(p)) {
          report(scope, p.at(0), UnknownProperty{std::string(p.at(0).text()), "a step", {"easing"}});
          good = false;
        }
      }
    auto pose = sum(node.child(NodeKind::sum), scope);
    if (!pose) {
      good = false;
    } else if (!pose->still()) {
      const NodeRef s = node.child(NodeKind::sum);
      report(scope, s,
             WrongKind{std::string(s.text()), "a movement", "a pose",
                       "a step leads to a state; place movements in a timeline"});
      good = false;
    } else {
      step.pose = std::move(pose->pose);
    }
    out.steps.push_back(std::move(step));
    if (out.steps.size() > kMaxSteps) {
      report(scope, node, TooLarge{"the number of steps", fmt::format("{}", kMaxSteps)});
      return std::nullopt;
    }
  }
  if (!good) return std::nullopt;
  if (out.steps.empty()) return out;
  const auto near = [](double a, double b) { return a - b < 1e-9 && b - a < 1e-9; };
  if (duration_ns) {
    const double whole = static_cast<double>(*duration_ns);
    const double total = static_cast<double>(own) + shares * whole;
    if (total - whole > 1.0 || whole - total > 1.0) {
      report(scope, last,
             StepsNotWhole{
                 any_share && own == 0 ? fmt::format("{:.6g}%", shares * 100.0) : fmt::format("{:.6g}s", total / 1e9),
                 any_share && own == 0 ? "100%" : fmt::format("{:.6g}s", whole / 1e9)});
      return std::nullopt;
    }
    out.duration_ns = *duration_ns;
  } else if (!any_share) {
    out.duration_ns = own;
  } else if (own > 0) {
    if (shares >= 1.0 - 1e-9) {
      report(scope, last,
             StepsNotWhole{fmt::format("{:.6g}% and {:.6g}s", shares * 100.0, static_cast<double>(own) / 1e9), "100%"});
      return std::nullopt;
    }
    out.duration_ns = static_cast<std::int64_t>(static_cast<double>(own) / (1.0 - shares) + 0.5);
  } else if (!near(shares, 1.0)) {
    report(scope, last, StepsNotWhole{fmt::format("{:.6g}%", shares * 100.0), "100%"});
    return std::nullopt;
  }
  return out;
}

}  // namespace nms::compiler
