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

/// Most that a product or a sum of numbers may come to: a time of that many seconds still has its nanoseconds.
constexpr double kMostArithmetic = 1e9;

}  // namespace

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
  report(
      scope, node,
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
        if (const Argument* a = argument(p.text(), scope))
          value = *a;
        else
          value.word = p.text();
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
        report(scope, p,
               UnitMismatch{std::string(p.text()), std::string(lang::describe(value.quantity.unit)),
                            "a plain number or a share"});
        return std::nullopt;
      }
      const bool left_scalar = is_scalar(product.quantity.unit);
      const Unit unit = !any                                  ? value.quantity.unit
                        : !left_scalar                        ? product.quantity.unit
                        : !is_scalar(value.quantity.unit)     ? value.quantity.unit
                        : product.quantity.unit == Unit::none ? value.quantity.unit
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

namespace {

/// Degrees lie between nothing and ten times.
constexpr double kMaxDegree = 10.0;

}  // namespace

std::optional<double> Evaluator::degree_of(const Declaration& d) {
  Scope own;
  own.file = d.file;
  const NodeRef node = d.node.child(NodeKind::quantity);
  const auto q = node ? quantity(node, Unit::percent, own) : std::nullopt;
  if (!q) return std::nullopt;
  if (q->value >= 0.0 && q->value <= kMaxDegree) return q->value;
  report(own, node, OutOfRange{std::string(node.text()), "0% to 1000%"});
  return std::nullopt;
}

std::optional<double> Evaluator::degree(NodeRef a, const Scope& scope) {
  const NodeRef word = a.at(0);
  if (a.has(lang::kFlagNamed) || !word.is(NodeKind::name)) return std::nullopt;
  const Declaration* d = declarations_.find_degree(word.text(), scope.file);
  return d != nullptr ? degree_of(*d) : std::nullopt;
}

std::optional<double> Evaluator::degree_in_front(NodeRef factor, const Scope& scope) {
  const NodeRef word = factor.at(0);
  if (const Declaration* d = declarations_.find_degree(word.text(), scope.file)) return degree_of(*d);
  auto& diagnostic = report(scope, word, UnknownName{"degree", std::string(word.text()), similar(word.text(), [&] {
                                                       return declarations_.degree_names(scope.file);
                                                     })});
  diagnostic.helps.push_back("two names side by side: `+` between them adds, `*` scales, `;` begins another statement");
  return std::nullopt;
}

bool Evaluator::multiply_by(NodeRef factor, const Scope& scope, Scale& scale) {
  const NodeRef node = factor.at(0);
  Quantity q;
  if (node.is(NodeKind::quantity)) {
    const auto read = lang::read_quantity(node.text());
    if (!read) return false;
    q = *read;
  } else if (node.is(NodeKind::name) && !factor.has(lang::kFlagStar)) {
    const auto degree = degree_in_front(factor, scope);
    if (!degree) return false;
    q = {*degree, Unit::percent, 0};
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

namespace {

/// The parameter that a bare word goes to: the one of that name, which is then a `yes`; else the first that is a word;
/// else the first without a value.
std::size_t slot_of_word(Argument& value, const std::vector<NodeRef>& declared,
                         const std::vector<std::optional<Argument>>& given) {
  for (std::size_t i = 0; i < declared.size(); ++i)
    if (!given[i] && declared[i].at(0).text() == value.word && declared[i].at(1).is(NodeKind::name)) {
      value.word = "yes";
      return i;
    }
  for (const bool any : {false, true})
    for (std::size_t i = 0; i < declared.size(); ++i)
      if (!given[i] && (any || !declared[i].at(1).is(NodeKind::quantity))) return i;
  return declared.size();
}

}  // namespace

std::optional<Scope> Evaluator::bind(NodeRef call, bool skip_first, std::string_view callee, NodeRef params,
                                     std::uint32_t params_file, const Scope& scope, bool degrees) {
  Scope inner;
  inner.file = params_file;
  inner.left_handed = scope.left_handed;
  inner.places = scope.places;
  if (!call && !params) return inner;
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
      if (degrees && degree(a, scope)) continue;
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
      } else if (!value->word.empty()) {
        slot = slot_of_word(*value, declared, given);
      } else {
        // The first parameter of the argument's own unit that has no value yet; a plain number fits any share or count.
        for (std::size_t i = 0; i < declared.size() && slot == declared.size(); ++i)
          if (!given[i] && declared[i].at(1) && units[i] == value->quantity.unit) slot = i;
        for (std::size_t i = 0; i < declared.size() && slot == declared.size(); ++i)
          if (!given[i] && (!declared[i].at(1) || (is_scalar(units[i]) && is_scalar(value->quantity.unit)))) slot = i;
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

}  // namespace nms::compiler
