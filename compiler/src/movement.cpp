#include "movement.h"

#include <algorithm>

#include <fmt/format.h>

#include <nms/compiler/diagnostic_kinds.h>

#include "action_unit.h"

namespace nms::compiler {

using lang::NodeKind;
using lang::NodeRef;
using lang::Quantity;
using lang::Unit;

namespace {

/// Steps of work one declaration may take: calls with arguments can multiply, and must end.
constexpr std::uint32_t kMaxWork = 200'000;
constexpr std::uint64_t kMaxWorkInAll = 20'000'000;
constexpr std::size_t kMaxDepth = 64;
constexpr std::size_t kMaxSequences = 1'000;
constexpr std::size_t kMaxSteps = 10'000;
/// Brackets open at once, over all definitions on the way: the stack is finite.
constexpr std::uint32_t kMaxBrackets = 2'000;
/// Most that a product or a sum of numbers may come to: a time of that many seconds still has its nanoseconds.
constexpr double kMostArithmetic = 1e9;
/// Most that amounts may add up to, in full scales. Anything near it is a slip; far above it numbers would overflow.
constexpr double kMaxAmount = 1e6;

bool is_scalar(Unit u) { return u == Unit::none || u == Unit::percent || u == Unit::count; }


void scale_pose(Pose& pose, double factor) {
  for (Amount& a : pose) a.value *= factor;
}

void keep_side(Pose& pose, const Channels& channels, program::Side side) {
  pose.erase(std::remove_if(pose.begin(), pose.end(),
                            [&](const Amount& a) {
                              const program::Side s = channels.channels[a.channel].side;
                              return s != program::Side::none && s != side;
                            }),
             pose.end());
}

}  // namespace

void add_amount(Pose& pose, std::uint32_t channel, double value) {
  const auto it = std::lower_bound(pose.begin(), pose.end(), channel,
                                   [](const Amount& a, std::uint32_t c) { return a.channel < c; });
  if (it != pose.end() && it->channel == channel) it->value += value;
  else pose.insert(it, {channel, value});
}

bool Evaluator::fresh(NodeRef at, std::string_view kind) {
  repeated_.labels.clear();
  return reported_.emplace(&at.tree(), at.index(), kind).second;
}

bool Evaluator::spend(NodeRef at, const Scope& scope, std::size_t steps) {
  spent_ += static_cast<std::uint32_t>(steps);
  spent_in_all_ += steps;
  if (spent_ <= kMaxWork && spent_in_all_ <= kMaxWorkInAll) return true;
  if (spent_in_all_ > kMaxWorkInAll) {
    if (!overspent_in_all_)
      report(scope, at, TooLarge{"the work that all definitions take", fmt::format("{} steps", kMaxWorkInAll)});
    overspent_in_all_ = true;
    return false;
  }
  if (!overspent_) report(scope, at, TooLarge{"the work that this definition takes", fmt::format("{} steps", kMaxWork)});
  overspent_ = true;
  return false;
}

const Argument* Evaluator::argument(std::string_view name, const Scope& scope) const {
  for (const Argument& a : scope.arguments)
    if (a.name == name) return &a;
  return nullptr;
}

std::optional<Quantity> Evaluator::quantity(NodeRef node, Unit unit, const Scope& scope) {
  const auto q = lang::read_quantity(node.text());
  if (!q) return std::nullopt;  // the parser has reported it
  const bool fits = q->unit == unit || (is_scalar(unit) && is_scalar(q->unit) && unit != Unit::count);
  if (fits) return q;
  report(scope, node,
         UnitMismatch{std::string(node.text()), std::string(lang::describe(q->unit)), std::string(lang::describe(unit))});
  return std::nullopt;
}

std::optional<Argument> Evaluator::arithmetic(NodeRef node, const Scope& scope) {
  if (!node || node.has(lang::kFlagError)) return std::nullopt;
  if (node.is(NodeKind::quantity)) {
    const auto q = lang::read_quantity(node.text());
    if (!q) return std::nullopt;
    return Argument{{}, *q, {}};
  }
  if (node.is(NodeKind::name)) {
    if (const Argument* a = argument(node.text(), scope)) return Argument{{}, a->quantity, a->word};
    return Argument{{}, {}, node.text()};
  }
  if (!node.is(NodeKind::sum)) {
    report(scope, node, WrongKind{std::string(node.text()), std::string(lang::describe(node.kind())), "a number", ""});
    return std::nullopt;
  }
  Argument total;
  bool first = true;
  for (NodeRef t : node.children()) {
    if (!spend(t, scope)) return std::nullopt;
    Argument product;
    product.quantity = {1.0, Unit::none, 0};
    bool any = false;
    for (NodeRef part : t.children()) {
      NodeRef p = part;
      if (p.is(NodeKind::factor)) p = p.at(0);
      Argument value;
      if (p.is(NodeKind::quantity)) {
        const auto q = lang::read_quantity(p.text());
        if (!q) return std::nullopt;
        value.quantity = *q;
      } else if (p.is(NodeKind::group)) {
        auto inner = arithmetic(p.at(0), scope);
        if (!inner) return std::nullopt;
        value = *inner;
      } else if (p.is(NodeKind::name)) {
        if (const Argument* a = argument(p.text(), scope)) value = *a;
        else value.word = p.text();
      } else {
        report(scope, p, WrongKind{std::string(p.text()), std::string(lang::describe(p.kind())), "a number", ""});
        return std::nullopt;
      }
      if (!value.word.empty()) {
        if (any || t.has(lang::kFlagMinus) || !first) {
          report(scope, p, WrongKind{std::string(p.text()), "a word", "a number", ""});
          return std::nullopt;
        }
        value.name = {};
        // A word alone; anything after it is arithmetic on a word.
        product = value;
        any = true;
        continue;
      }
      if (!product.word.empty()) {
        report(scope, p, WrongKind{std::string(product.word), "a word", "a number", ""});
        return std::nullopt;
      }
      if (!is_scalar(product.quantity.unit) && !is_scalar(value.quantity.unit)) {
        report(scope, p, UnitMismatch{std::string(p.text()), std::string(lang::describe(value.quantity.unit)),
                                      "a plain number or a share"});
        return std::nullopt;
      }
      const bool left_scalar = is_scalar(product.quantity.unit);
      const Unit unit = !any                                   ? value.quantity.unit
                        : !left_scalar                         ? product.quantity.unit
                        : !is_scalar(value.quantity.unit)      ? value.quantity.unit
                        : product.quantity.unit == Unit::none  ? value.quantity.unit
                                                               : product.quantity.unit;
      if (!any) {
        product.quantity = value.quantity;
      } else {
        const double scale = left_scalar ? product.quantity.value : value.quantity.value;
        const Quantity& dimensional = left_scalar ? value.quantity : product.quantity;
        const double ns = static_cast<double>(dimensional.nanoseconds) * scale;
        product.quantity = {product.quantity.value * value.quantity.value, unit, 0};
        if (!(product.quantity.value >= -kMostArithmetic && product.quantity.value <= kMostArithmetic)) {
          report(scope, p, OutOfRange{std::string(t.text()), "what arithmetic may come to"});
          return std::nullopt;
        }
        product.quantity.nanoseconds = static_cast<std::int64_t>(ns < 0 ? ns - 0.5 : ns + 0.5);
      }
      any = true;
    }
    if (!any) return std::nullopt;
    if (!product.word.empty()) {
      if (!first) {
        report(scope, t, WrongKind{std::string(product.word), "a word", "a number", ""});
        return std::nullopt;
      }
      total = product;
      first = false;
      continue;
    }
    const double sign = t.has(lang::kFlagMinus) ? -1.0 : 1.0;
    if (first) {
      total = product;
      total.quantity.value *= sign;
      if (sign < 0) total.quantity.nanoseconds = -total.quantity.nanoseconds;
    } else {
      const bool like = total.word.empty() && (total.quantity.unit == product.quantity.unit ||
                                               (is_scalar(total.quantity.unit) && is_scalar(product.quantity.unit)));
      if (!like) {
        report(scope, t,
               UnitMismatch{std::string(t.text()), std::string(lang::describe(product.quantity.unit)),
                            total.word.empty() ? std::string(lang::describe(total.quantity.unit)) : "a word"});
        return std::nullopt;
      }
      total.quantity.value += sign * product.quantity.value;
      if (!(total.quantity.value >= -kMostArithmetic && total.quantity.value <= kMostArithmetic)) {
        report(scope, t, OutOfRange{std::string(node.text()), "what arithmetic may come to"});
        return std::nullopt;
      }
      total.quantity.nanoseconds += sign < 0 ? -product.quantity.nanoseconds : product.quantity.nanoseconds;
    }
    first = false;
  }
  if (first) return std::nullopt;
  return total;
}

bool Evaluator::multiply_by(NodeRef factor, const Scope& scope, Scale& scale) {
  const NodeRef node = factor.at(0);
  Quantity q;
  if (node.is(NodeKind::quantity)) {
    const auto read = lang::read_quantity(node.text());
    if (!read) return false;
    q = *read;
  } else if (node.is(NodeKind::name)) {
    const Argument* a = argument(node.text(), scope);
    if (a == nullptr) {
      std::vector<std::string> names;
      for (const Argument& known : scope.arguments) names.emplace_back(known.name);
      report(scope, node, UnknownName{"parameter", std::string(node.text()), lang::nearest(node.text(), names)});
      return false;
    }
    if (!a->word.empty()) {
      report(scope, node, WrongKind{std::string(node.text()), "a word", "a number", ""});
      return false;
    }
    q = a->quantity;
  } else if (node.is(NodeKind::group)) {
    const auto value = arithmetic(node.at(0), scope);
    if (!value) return false;
    if (!value->word.empty()) {
      report(scope, node, WrongKind{std::string(value->word), "a word", "a number", ""});
      return false;
    }
    q = value->quantity;
  } else {
    return false;
  }
  if (is_scalar(q.unit)) {
    scale.factor *= q.value;
    if (scale.factor >= -kMaxAmount && scale.factor <= kMaxAmount) return true;
    report(scope, node, OutOfRange{std::string(node.text()), fmt::format("factors up to {}", kMaxAmount)});
    return false;
  }
  if ((q.unit == Unit::angle || q.unit == Unit::length) && scale.unit == Unit::none) {
    scale.unit = q.unit;
    scale.absolute = q.value;
    scale.node = node;
    return true;
  }
  report(scope, node,
         UnitMismatch{std::string(node.text()), std::string(lang::describe(q.unit)), "a share or a plain number"});
  return false;
}

bool Evaluator::add_unit(std::string_view text, std::uint32_t number, program::Side side, double value,
                         const Scale& scale, NodeRef at, const Scope& scope, Pose& into) {
  const UnitInfo* unit = channels_.find_unit(number);
  if (unit == nullptr) {
    report(scope, at,
           UnknownActionUnit{fmt::format("AU{}", number), lang::nearest(fmt::format("AU{}", number), channels_.unit_names())});
    return false;
  }
  const ChannelInfo& channel = channels_.channels[unit->channel];
  value *= scale.factor;
  if (scale.unit != Unit::none) {
    if (!channel.is_axis() || channel.unit != scale.unit) {
      report(scope, scale.node,
             UnitMismatch{std::string(scale.node.text()), std::string(lang::describe(scale.unit)),
                          channel.is_axis() ? std::string(lang::describe(channel.unit)) + " or a share"
                                            : std::string("a share")});
      return false;
    }
    const double full = channel.full_scale < 0.0 ? -channel.full_scale : channel.full_scale;
    value *= scale.absolute / full;
  }
  value *= unit->sign;
  if (side != program::Side::none && !unit->sided) {
    report(scope, at, UnknownSide{std::string(text), fmt::format("AU{}", number)});
    return false;
  }
  if (!unit->sided || side != program::Side::right) add_amount(into, unit->channel, value);
  if (unit->sided && side != program::Side::left) add_amount(into, unit->channel + 1, value);
  return true;
}

bool Evaluator::action_unit(NodeRef token, const Scale& scale, const Scope& scope, Movement& into) {
  const auto unit = read_action_unit(token.text());
  if (!unit) {
    report(scope, token, UnknownActionUnit{std::string(token.text()), {}});
    return false;
  }
  return add_unit(token.text(), unit->number, unit->side, unit->intensity, scale, token, scope, into.pose);
}

bool Evaluator::facs(NodeRef node, const Scale& scale, const Scope& scope, Movement& into) {
  const NodeRef string = node.child(NodeKind::string);
  if (!string) return false;
  const std::string_view text = unquoted(string);
  bool good = true;
  std::size_t begin = 0;
  while (begin <= text.size()) {
    const std::size_t plus = std::min(text.find('+', begin), text.size());
    std::string_view unit_text = text.substr(begin, plus - begin);
    while (!unit_text.empty() && unit_text.front() == ' ') unit_text.remove_prefix(1);
    while (!unit_text.empty() && unit_text.back() == ' ') unit_text.remove_suffix(1);
    begin = plus + 1;
    if (const auto unit = read_facs_unit(unit_text)) {
      good = add_unit(unit_text, unit->number, unit->side, unit->intensity, scale, string, scope, into.pose) && good;
    } else {
      const bool star = unit_text.find('*') != std::string_view::npos;
      const bool alternative = unit_text.find_first_of(",/") != std::string_view::npos;
      report(scope, string,
             BadFacsString{std::string(unit_text), star          ? "asks for any intensity, which is not yet compiled"
                                                   : alternative ? "offers alternatives, which are not yet compiled"
                                                                 : "is not a unit"});
      good = false;
    }
  }
  return good;
}

bool Evaluator::take(Movement&& part, const Scale& scale, NodeRef at, const Scope& scope, Movement& into) {
  if (scale.unit != Unit::none) {
    report(scope, scale.node,
           UnitMismatch{std::string(scale.node.text()), std::string(lang::describe(scale.unit)),
                        "a share or a plain number"});
    return false;
  }
  // A long sequence costs what it weighs, wherever it is copied to.
  for (const Sequence& s : part.sequences)
    if (!spend(at, scope, s.steps.size())) return false;
  for (const Amount& a : part.pose) add_amount(into.pose, a.channel, a.value * scale.factor);
  for (Sequence& s : part.sequences) {
    for (Step& step : s.steps) scale_pose(step.pose, scale.factor);
    into.sequences.push_back(std::move(s));
  }
  for (Oscillation& o : part.oscillations) {
    o.by *= scale.factor;
    into.oscillations.push_back(o);
  }
  if (into.sequences.size() > kMaxSequences || into.oscillations.size() > kMaxSequences) {
    report(scope, at, TooLarge{"the number of movements in one sum", fmt::format("{}", kMaxSequences)});
    return false;
  }
  return true;
}

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
    if (slot != 0 && (!value[slot]->word.empty() ||
                      (kUnits[slot] != Unit::none && value[slot]->quantity.unit != kUnits[slot] &&
                       !(kUnits[slot] == Unit::percent && is_scalar(value[slot]->quantity.unit)) &&
                       !(kUnits[slot] == Unit::count && value[slot]->quantity.unit == Unit::none)))) {
      report(scope, sum_node,
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
    report(scope, call, UnitMismatch{"by", std::string(lang::describe(by.unit)), std::string(lang::describe(channel.unit))});
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

std::optional<Scope> Evaluator::bind(NodeRef call, bool skip_first, std::string_view callee, NodeRef params,
                                     std::uint32_t params_file, const Scope& scope) {
  Scope inner;
  inner.file = params_file;
  inner.left_handed = scope.left_handed;
  std::vector<NodeRef> declared;
  std::vector<std::string> names;
  std::vector<Unit> units;
  if (params)
    for (NodeRef p : params.children()) {
      if (!p.is(NodeKind::param) || !p.at(0)) continue;  // one without a name did not parse
      if (std::find(names.begin(), names.end(), p.at(0).text()) != names.end())
        report(scope, p, DuplicateName{"parameter", std::string(p.at(0).text())});
      declared.push_back(p);
      names.emplace_back(p.at(0).text());
      const NodeRef fallback = p.at(1);
      const auto q = fallback && fallback.is(NodeKind::quantity) ? lang::read_quantity(fallback.text()) : std::nullopt;
      units.push_back(q ? q->unit : Unit::none);
    }
  std::vector<std::optional<Argument>> given(declared.size());
  bool good = true;
  bool skipped = !skip_first;
  if (call)
    for (NodeRef a : call.children()) {
      if (!a.is(NodeKind::argument)) continue;
      if (!skipped) {
        skipped = true;
        continue;
      }
      const bool is_named = a.has(lang::kFlagNamed);
      const NodeRef sum_node = a.at(is_named ? 1 : 0);
      if (!sum_node) {
        report(scope, a, UnexpectedArgument{std::string(callee), std::string(a.text()), names});
        good = false;
        continue;
      }
      auto value = arithmetic(sum_node, scope);
      if (!value) return std::nullopt;
      std::size_t slot = declared.size();
      if (is_named) {
        for (std::size_t i = 0; i < names.size(); ++i)
          if (names[i] == a.at(0).text()) slot = i;
      } else {
        // The first parameter of the argument's own unit that has no value yet; a plain number fits any share or count.
        for (std::size_t i = 0; i < declared.size() && slot == declared.size(); ++i)
          if (!given[i] && value->word.empty() && declared[i].at(1) && units[i] == value->quantity.unit) slot = i;
        for (std::size_t i = 0; i < declared.size() && slot == declared.size(); ++i)
          if (!given[i] && (!declared[i].at(1) || !value->word.empty() ||
                            (is_scalar(units[i]) && is_scalar(value->quantity.unit))))
            slot = i;
      }
      if (slot == declared.size() || given[slot]) {
        report(scope, a, UnexpectedArgument{std::string(callee), std::string(a.text()), names});
        good = false;
        continue;
      }
      if (is_named && value->word.empty() && declared[slot].at(1) && units[slot] != value->quantity.unit &&
          !(is_scalar(units[slot]) && is_scalar(value->quantity.unit))) {
        report(scope, sum_node,
               UnitMismatch{std::string(sum_node.text()), std::string(lang::describe(value->quantity.unit)),
                            std::string(lang::describe(units[slot]))});
        good = false;
        continue;
      }
      given[slot] = *value;
    }
  for (std::size_t i = 0; i < declared.size(); ++i) {
    Argument value;
    if (given[i]) {
      value = *given[i];
    } else {
      const NodeRef fallback = declared[i].at(1);
      if (!fallback) {
        report(scope, call ? call : params, MissingArgument{std::string(callee), names[i]});
        good = false;
        continue;
      }
      if (fallback.is(NodeKind::quantity)) {
        const auto q = lang::read_quantity(fallback.text());
        if (!q) return std::nullopt;
        value.quantity = *q;
      } else {
        value.word = fallback.text();
      }
    }
    value.name = declared[i].at(0).text();
    inner.arguments.push_back(value);
  }
  if (!good) return std::nullopt;
  return inner;
}

bool Evaluator::named(NodeRef name, NodeRef call, const Scale& scale, const Scope& scope, Movement& into) {
  const std::string_view word = name.text();
  if (call) {
    if (word == "oscillate") return oscillate(call, scale, scope, into);
    if (word == "left" || word == "right" || word == "dominant" || word == "contra") {
      const NodeRef a = call.child(NodeKind::argument);
      const NodeRef inner = a ? a.at(0) : NodeRef();
      if (!inner || a.node().next != call.node().next) {
        report(scope, call, MissingArgument{std::string(word), ""});
        return false;
      }
      auto part = sum(inner, scope);
      if (!part) return false;
      const bool left = word == "left" || (word == "dominant" && scope.left_handed) ||
                        (word == "contra" && !scope.left_handed);
      const program::Side side = left ? program::Side::left : program::Side::right;
      keep_side(part->pose, channels_, side);
      for (Sequence& s : part->sequences)
        for (Step& step : s.steps) keep_side(step.pose, channels_, side);
      return take(std::move(*part), scale, name, scope, into);
    }
  }
  bool skip_first = false;
  const Declaration* d = declarations_.find_movement(word, scope.file);
  std::string variant;
  if (call) {
    // A first argument that is a bare word picks the variant `name_word`: jut(forward, 60%) is jut_forward(60%).
    const NodeRef a = call.child(NodeKind::argument);
    if (a && !a.has(lang::kFlagNamed)) {
      NodeRef w = a.at(0);
      if (w && w.is(NodeKind::sum) && w.at(0) && w.at(0).is(NodeKind::term) && !w.at(1) && !w.at(0).at(1)) w = w.at(0).at(0);
      if (w && w.is(NodeKind::name) && argument(w.text(), scope) == nullptr) {
        variant = fmt::format("{}_{}", word, w.text());
        if (const Declaration* v = declarations_.find_movement(variant, scope.file)) {
          d = v;
          skip_first = true;
        } else if (d == nullptr) {
          report(scope, w,
                 UnknownName{"pose, expression or motion", variant,
                             similar(variant, [&] { return declarations_.movement_names(scope.file); })});
          return false;
        }
      }
    }
  }
  if (d == nullptr) {
    const Argument* a = argument(word, scope);
    if (a != nullptr) {
      report(scope, name, WrongKind{std::string(word), "a number", "a pose, expression or motion",
                                    fmt::format("to scale by it, write {} * P", word)});
      return false;
    }
    report(scope, name, UnknownName{"pose, expression or motion", std::string(word),
                                    similar(word, [&] { return declarations_.movement_names(scope.file); })});
    return false;
  }
  auto inner = bind(call, skip_first, d->name, d->node.child(NodeKind::params), d->file, scope);
  if (!inner) return false;
  auto part = declaration(*d, *inner);
  if (!part) return false;
  return take(std::move(*part), scale, name, scope, into);
}

bool Evaluator::term(NodeRef node, const Scope& scope, Movement& into) {
  if (!spend(node, scope)) return false;
  Scale scale;
  if (node.has(lang::kFlagMinus)) scale.factor = -1.0;
  for (NodeRef part : node.children()) {
    if (part.is(NodeKind::factor)) {
      if (!multiply_by(part, scope, scale)) return false;
      continue;
    }
    switch (part.kind()) {
      case NodeKind::au_token: return action_unit(part, scale, scope, into);
      case NodeKind::facs: return facs(part, scale, scope, into);
      case NodeKind::name: return named(part, {}, scale, scope, into);
      case NodeKind::call: return named(part.at(0), part, scale, scope, into);
      case NodeKind::group: {
        auto inner = sum(part.at(0), scope);
        return inner && take(std::move(*inner), scale, part, scope, into);
      }
      case NodeKind::steps: {
        auto s = sequence(part, "", std::nullopt, scope);
        if (!s) return false;
        Movement m;
        m.sequences.push_back(std::move(*s));
        return take(std::move(m), scale, part, scope, into);
      }
      case NodeKind::quantity:
        report(scope, part, WrongKind{std::string(part.text()), "a number", "a pose, expression or motion",
                                      "write what it scales after it: 60% AU12"});
        return false;
      default: return false;
    }
  }
  return false;
}

std::optional<Movement> Evaluator::sum(NodeRef node, const Scope& scope) {
  if (!node || node.has(lang::kFlagError)) return std::nullopt;
  if (depth_ >= kMaxBrackets) {
    report(scope, node, TooLarge{"the depth of brackets and definitions", fmt::format("{}", kMaxBrackets)});
    return std::nullopt;
  }
  if (depth_ == 0 && open_.empty()) {  // what is placed starts afresh, as a declaration does
    spent_ = 0;
    overspent_ = false;
  }
  ++depth_;
  auto out = sum_within(node, scope);
  --depth_;
  return out;
}

std::optional<Movement> Evaluator::sum_within(NodeRef node, const Scope& scope) {
  Movement out;
  bool good = true;
  if (node.is(NodeKind::name)) {  // an argument that is a bare name: left(smile)
    if (!named(node, {}, {}, scope, out)) return std::nullopt;
    return out;
  }
  if (!node.is(NodeKind::sum)) {
    report(scope, node, WrongKind{std::string(node.text()), std::string(lang::describe(node.kind())),
                                  "a pose, expression or motion", ""});
    return std::nullopt;
  }
  for (NodeRef t : node.children())
    if (t.is(NodeKind::term)) good = term(t, scope, out) && good;
  if (!good) return std::nullopt;
  for (const Amount& a : out.pose)
    if (!(a.value >= -kMaxAmount && a.value <= kMaxAmount)) {
      report(scope, node, OutOfRange{std::string(node.text()), fmt::format("what may be added up, {}%", kMaxAmount * 100.0)});
      return std::nullopt;
    }
  return out;
}

std::optional<Easing> Evaluator::easing(NodeRef value, const Scope& scope) {
  const std::string_view word = value ? value.text() : std::string_view();
  if (word == "smooth") return Easing::smooth;
  if (word == "linear") return Easing::linear;
  if (word == "cosine") return Easing::cosine;
  if (word == "step") return Easing::step;
  if (word == "spring") report(scope, value, NotCompiled{"spring easing"});
  else if (value) report(scope, value, BadProperty{"easing", std::string(word), "smooth, linear, cosine or step"});
  return std::nullopt;
}

std::optional<Sequence> Evaluator::sequence(NodeRef parent, std::string_view name, std::optional<std::int64_t> duration_ns,
                                            const Scope& scope) {
  Sequence out;
  out.name = name;
  bool good = true;
  double shares = 0.0;
  std::int64_t own = 0;
  bool any_share = false;
  NodeRef last;
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
      report(scope, amount, UnitMismatch{std::string(amount.text()), std::string(lang::describe(q->unit)),
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
          report(scope, p, NotCompiled{"a profile"});
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
      report(scope, s, WrongKind{std::string(s.text()), "a movement", "a pose",
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
             StepsNotWhole{any_share && own == 0 ? fmt::format("{:.6g}%", shares * 100.0)
                                                 : fmt::format("{:.6g}s", total / 1e9),
                           any_share && own == 0 ? "100%" : fmt::format("{:.6g}s", whole / 1e9)});
      return std::nullopt;
    }
    out.duration_ns = *duration_ns;
  } else if (!any_share) {
    out.duration_ns = own;
  } else if (own > 0) {
    if (shares >= 1.0 - 1e-9) {
      report(scope, last, StepsNotWhole{fmt::format("{:.6g}% and {:.6g}s", shares * 100.0, static_cast<double>(own) / 1e9),
                                        "100%"});
      return std::nullopt;
    }
    out.duration_ns = static_cast<std::int64_t>(static_cast<double>(own) / (1.0 - shares) + 0.5);
  } else if (!near(shares, 1.0)) {
    report(scope, last, StepsNotWhole{fmt::format("{:.6g}%", shares * 100.0), "100%"});
    return std::nullopt;
  }
  return out;
}

std::optional<Movement> Evaluator::declaration(const Declaration& d, const Scope& scope) {
  const bool cacheable = scope.arguments.empty();
  const std::uint64_t key = (std::uint64_t{d.file} << 33U) | (std::uint64_t{d.node.index()} << 1U) |
                            (scope.left_handed ? 1U : 0U);
  if (cacheable) {
    const auto it = known_.find(key);
    if (it != known_.end()) return it->second;
  }
  if (too_heavy_.count(key) != 0) return std::nullopt;
  if (std::find(open_.begin(), open_.end(), d.node) != open_.end()) {
    report(scope, d.node.child(NodeKind::name), RecursiveDefinition{std::string(d.name)});
    return std::nullopt;
  }
  if (open_.size() >= kMaxDepth) {
    report(scope, d.node.child(NodeKind::name), TooLarge{"the depth of definitions", fmt::format("{}", kMaxDepth)});
    return std::nullopt;
  }
  const bool outermost = open_.empty();
  if (outermost) {
    spent_ = 0;
    overspent_ = false;
  }
  open_.push_back(d.node);
  std::optional<Movement> result;
  if (!d.node.has(lang::kFlagError)) {
    switch (d.node.kind()) {
      case NodeKind::pose:
        result = sum(d.node.child(NodeKind::sum), scope);
        if (result && !result->still()) {
          const NodeRef s = d.node.child(NodeKind::sum);
          report(scope, s, WrongKind{std::string(d.name), "made of a movement", "a pose",
                                     "declare it as a motion: motion " + std::string(d.name) + " = ..."});
          result.reset();
        }
        break;
      case NodeKind::motion:
        if (const NodeRef steps = d.node.child(NodeKind::steps)) {
          if (auto s = sequence(steps, d.name, std::nullopt, scope)) {
            result.emplace();
            result->sequences.push_back(std::move(*s));
          }
        } else {
          result = sum(d.node.child(NodeKind::sum), scope);
          if (result)
            for (Oscillation& o : result->oscillations)
              if (o.name.empty()) o.name = d.name;
        }
        break;
      case NodeKind::expression: {
        std::optional<std::int64_t> duration;
        bool good = true;
        if (const NodeRef length = d.node.child(NodeKind::quantity)) {
          const auto q = quantity(length, Unit::time, scope);
          if (q && q->nanoseconds <= 0) report(scope, length, OutOfRange{std::string(length.text()), "times above 0s"});
          good = q && q->nanoseconds > 0;
          if (q) duration = q->nanoseconds;
        }
        if (good) {
          if (auto s = sequence(d.node, d.name, duration, scope)) {
            result.emplace();
            result->sequences.push_back(std::move(*s));
          }
        }
        break;
      }
      default: break;
    }
  }
  open_.pop_back();
  if (outermost && overspent_) too_heavy_.insert(key);
  if (cacheable) known_.emplace(key, result);
  return result;
}

}  // namespace nms::compiler
