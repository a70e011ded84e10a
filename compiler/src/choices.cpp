#include "choices.h"

#include <algorithm>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include <fmt/format.h>

#include <nms/compiler/diagnostic_kinds.h>

namespace nms::compiler {

using lang::NodeKind;
using lang::NodeRef;

std::string_view component_name(NodeRef sum) {
  std::string_view name = sum.text();
  for (NodeRef term : sum.children())
    for (NodeRef part : term.children()) {
      if (part.is(NodeKind::name)) return part.text();
      if (part.is(NodeKind::call)) return part.at(0).text();
    }
  return name;
}

bool optional_plays(NodeRef property, bool otherwise, const Scope& scope, Evaluator& evaluator) {
  const NodeRef value = property.at(1);
  if (value.text() == "all") return true;
  if (value.text() == "none") return false;
  evaluator.report(scope, property,
                   BadProperty{"optional", value ? std::string(value.text()) : "nothing", "all or none"});
  return otherwise;
}

namespace {

constexpr std::size_t kNone = static_cast<std::size_t>(-1);

std::vector<NodeRef> alternatives(NodeRef one_of) {
  std::vector<NodeRef> out;
  for (NodeRef c : one_of.children())
    if (c.is(NodeKind::placement) || c.is(NodeKind::one_of)) out.push_back(c);
  return out;
}

/// Names under which an item may be chosen: a component's own, and those of the alternatives in it.
void names_of(NodeRef item, std::vector<std::string_view>& out) {
  if (item.is(NodeKind::placement)) {
    if (const NodeRef sum = item.child(NodeKind::sum)) out.push_back(component_name(sum));
    return;
  }
  for (NodeRef c : item.children()) names_of(c, out);
}

/// The choices that an entry leaves to its users, in the order they are written.
struct Open {
  std::vector<NodeRef> optionals;
  std::vector<NodeRef> one_ofs;

  explicit Open(NodeRef entry) {
    for (std::uint32_t i = entry.index() + 1; i < entry.node().next; ++i) {
      const NodeRef n(&entry.tree(), i);
      if (n.has(lang::kFlagError)) continue;
      if (n.is(NodeKind::optional)) optionals.push_back(n);
      if (n.is(NodeKind::one_of)) one_ofs.push_back(n);
    }
  }
};

class Reader {
 public:
  Reader(const Declaration& entry, const Scope& scope, Evaluator& evaluator)
      : entry_(entry), open_(entry.node), scope_(scope), evaluator_(evaluator), chosen_(open_.one_ofs.size(), kNone) {}

  std::vector<std::uint32_t> read(NodeRef options, bool optional) {
    Names wanted;
    if (options)
      for (NodeRef p : options.children()) {
        if (!is_property(p)) continue;
        if (p.at(0).text() == "choose") choose(p);
        if (p.at(0).text() == "optional") optional = read_optional(p, optional, wanted);
      }
    std::vector<std::uint32_t> left_out;
    for (const NodeRef o : open_.optionals) {
      std::vector<std::string_view> names;
      if (!wanted.empty()) names_of(o.at(0), names);
      const bool named =
          std::any_of(names.begin(), names.end(), [&](std::string_view n) { return wanted.contains(n); });
      if (wanted.empty() ? !optional : !named) left_out.push_back(o.index());
    }
    for (std::size_t i = 0; i < open_.one_ofs.size(); ++i) {
      const std::vector<NodeRef> all = alternatives(open_.one_ofs[i]);
      for (std::size_t j = 0; j < all.size(); ++j)
        if (j != (chosen_[i] == kNone ? 0 : chosen_[i])) left_out.push_back(all[j].index());
    }
    std::sort(left_out.begin(), left_out.end());
    return left_out;
  }

 private:
  using Names = std::unordered_set<std::string_view>;

  /// `optional all`, `optional none`, or one that is wanted: with it those that are not named are left out.
  bool read_optional(NodeRef property, bool otherwise, Names& wanted) {
    const NodeRef value = property.at(1);
    if (property.at(2) || !value || value.text() == "all" || value.text() == "none")
      return optional_plays(property, otherwise, scope_, evaluator_);
    if (optional_names_.empty())
      for (const NodeRef o : open_.optionals) names_of(o.at(0), optional_names_);
    if (std::find(optional_names_.begin(), optional_names_.end(), value.text()) == optional_names_.end())
      unknown(value, fmt::format("optional component of {}", entry_.name), optional_names_);
    else
      wanted.insert(value.text());
    return otherwise;
  }

  void choose(NodeRef property) {
    if (open_.one_ofs.empty()) {
      evaluator_.report(scope_, property.at(0),
                        UnknownProperty{"choose", fmt::format("{}, which has no `one of`,", entry_.name), {}});
      return;
    }
    if (!property.at(1))
      evaluator_.report(scope_, property, BadProperty{"choose", "nothing", "an alternative's name or number"});
    std::size_t position = 0;
    bool first = true;
    for (NodeRef value : property.children()) {
      if (!first && value.is(NodeKind::quantity))
        choose_number(value, position++);
      else if (!first)
        choose_name(value);
      first = false;
    }
  }

  /// The n-th number chooses in the n-th `one of`.
  void choose_number(NodeRef value, std::size_t position) {
    const auto q = lang::read_quantity(value.text());
    if (!q) return;
    if (position >= open_.one_ofs.size()) {
      evaluator_.report(scope_, value,
                        OutOfRange{std::string(value.text()),
                                   fmt::format("the {} `one of` that {} has", open_.one_ofs.size(), entry_.name)});
      return;
    }
    const std::size_t count = alternatives(open_.one_ofs[position]).size();
    const double number = q->value;
    if (q->unit != lang::Unit::none || !(number >= 1.0 && number <= static_cast<double>(count)) ||
        number != static_cast<double>(static_cast<std::size_t>(number))) {
      evaluator_.report(scope_, value,
                        OutOfRange{std::string(value.text()), fmt::format("the alternatives 1 to {}", count)});
      return;
    }
    chosen_[position] = static_cast<std::size_t>(number) - 1;
  }

  void choose_name(NodeRef value) {
    index_alternatives();
    const std::string_view name = value.text();
    const auto it = by_name_.find(name);
    if (it == by_name_.end()) {
      unknown(value, fmt::format("alternative of {}", entry_.name), alternative_names_);
      return;
    }
    for (const auto& [one_of, alternative] : it->second) {
      if (chosen_[one_of] != kNone && chosen_[one_of] != alternative)
        evaluator_.report(scope_, value,
                          BadProperty{"choose", fmt::format("{} beside another of the same `one of`", name),
                                      "one alternative of each"});
      chosen_[one_of] = alternative;
    }
  }

  /// Of two alternatives of one name in a `one of` the first is meant; the other has its number.
  void index_alternatives() {
    if (!by_name_.empty()) return;
    for (std::size_t i = 0; i < open_.one_ofs.size(); ++i) {
      const std::vector<NodeRef> all = alternatives(open_.one_ofs[i]);
      for (std::size_t j = 0; j < all.size(); ++j) {
        std::vector<std::string_view> names;
        names_of(all[j], names);
        for (const std::string_view name : names) {
          auto& places = by_name_[name];
          if (places.empty() || places.back().first != i) places.emplace_back(i, j);
        }
        alternative_names_.insert(alternative_names_.end(), names.begin(), names.end());
      }
    }
  }

  void unknown(NodeRef value, std::string what, const std::vector<std::string_view>& names) {
    const auto known = [&] { return std::vector<std::string>(names.begin(), names.end()); };
    evaluator_.report(scope_, value,
                      UnknownName{std::move(what), std::string(value.text()), evaluator_.similar(value.text(), known)});
  }

  const Declaration& entry_;
  const Open open_;
  const Scope& scope_;
  Evaluator& evaluator_;
  std::vector<std::string_view> optional_names_;
  std::vector<std::string_view> alternative_names_;
  std::unordered_map<std::string_view, std::vector<std::pair<std::size_t, std::size_t>>> by_name_;
  std::vector<std::size_t> chosen_;  ///< of each `one of`, the alternative; kNone: nothing is said
};

}  // namespace

Choices Choices::of_use(const Declaration& entry, NodeRef options, bool optional, const Scope& scope,
                        Evaluator& evaluator) {
  Choices out;
  out.left_out_ = Reader(entry, scope, evaluator).read(options, optional);
  return out;
}

bool Choices::leaves_out(NodeRef item) const {
  return std::binary_search(left_out_.begin(), left_out_.end(), item.index());
}

}  // namespace nms::compiler
