#include "link_lexicons.h"

#include <algorithm>

#include <fmt/format.h>

#include <nms/compiler/diagnostic_kinds.h>

namespace nms::compiler {

using lang::NodeKind;
using lang::NodeRef;

NodeRef included_from(NodeRef include) {
  NodeRef last;
  std::uint32_t names = 0;
  for (NodeRef c : include.children())
    if (c.is(NodeKind::name)) {
      last = c;
      ++names;
    }
  return names > 1 && !include.has(lang::kFlagError) ? last : NodeRef();
}

namespace {

constexpr std::uint32_t kMostExtended = 100;

class Linker {
 public:
  Linker(Declarations& all, const std::vector<LoadedFile>& files, lang::Diagnostics& diagnostics)
      : all_(all), files_(files), diagnostics_(diagnostics) {
    for (const LexiconDeclaration& l : all.lexicons) known_.emplace_back(l.declaration.name);
  }

  void run() {
    state_.assign(all_.lexicons.size(), State::untouched);
    depth_.assign(all_.lexicons.size(), 0);
    for (std::uint32_t i = 0; i < all_.lexicons.size(); ++i) visit(i);
  }

 private:
  enum class State : std::uint8_t { untouched, open, linked };
  /// A lexicon that another is made of, and the `extends` or `include` that says so.
  struct Needed {
    std::uint32_t lexicon;
    NodeRef name;
    NodeRef part;
  };
  struct Open {
    std::uint32_t lexicon;
    std::vector<Needed> needs;
    std::size_t next = 0;
  };

  /// Depth first, so that whatever a lexicon is made of is linked before it.
  void visit(std::uint32_t start) {
    if (state_[start] != State::untouched) return;
    std::vector<Open> open;
    const auto enter = [&](std::uint32_t lexicon) {
      state_[lexicon] = State::open;
      open.push_back({lexicon, needs_of(lexicon)});
    };
    enter(start);
    while (!open.empty()) {
      Open& o = open.back();
      if (o.next == o.needs.size()) {
        link(o.lexicon, o.needs);
        state_[o.lexicon] = State::linked;
        open.pop_back();
        continue;
      }
      Needed& need = o.needs[o.next++];
      if (state_[need.lexicon] == State::untouched) {
        enter(need.lexicon);
      } else if (state_[need.lexicon] == State::open) {
        report(o.lexicon, need.name, RecursiveDefinition{std::string(all_.lexicons[need.lexicon].declaration.name)});
        need.lexicon = kUnreachable;
      }
    }
  }

  std::vector<Needed> needs_of(std::uint32_t lexicon) {
    std::vector<Needed> needs;
    const auto add = [&](NodeRef name, NodeRef part) {
      if (!name) return;
      const std::uint32_t found = all_.find_lexicon(name.text());
      if (found == kUnreachable)
        report(lexicon, name, MissingLexicon{std::string(name.text()), near(name.text(), known_), ""});
      else
        needs.push_back({found, name, part});
    };
    const NodeRef node = all_.lexicons[lexicon].declaration.node;
    if (const NodeRef extends = node.child(NodeKind::extends)) add(extends.child(NodeKind::name), extends);
    for (NodeRef part : node.children())
      if (part.is(NodeKind::include)) add(included_from(part), part);
    return needs;
  }

  void link(std::uint32_t lexicon, const std::vector<Needed>& needs) {
    LexiconDeclaration& l = all_.lexicons[lexicon];
    for (const Needed& need : needs) {
      if (need.lexicon == kUnreachable) continue;
      if (need.part.is(NodeKind::include)) {
        include(lexicon, need);
      } else if (depth_[need.lexicon] + 1 > kMostExtended) {
        report(lexicon, need.name, TooLarge{"the length of a chain of `extends`", fmt::format("{}", kMostExtended)});
      } else {
        l.extends = need.lexicon;
        depth_[lexicon] = depth_[need.lexicon] + 1;
      }
    }
    for (NodeRef part : l.declaration.node.children())
      if (part.is(NodeKind::remove))
        for (NodeRef name : part.children())
          if (name.is(NodeKind::name)) remove(lexicon, name);
    for (const std::uint32_t e : l.entries) label(lexicon, e);
  }

  /// Takes the entries over that are named in front of `from`.
  void include(std::uint32_t lexicon, const Needed& need) {
    LexiconDeclaration& l = all_.lexicons[lexicon];
    for (NodeRef name : need.part.children()) {
      if (!name.is(NodeKind::name) || name == need.name) continue;
      const Declaration* entry = entry_of(lexicon, name, need.lexicon);
      if (entry == nullptr) continue;
      const auto index = static_cast<std::uint32_t>(entry - all_.entries.data());
      const auto [it, added] = l.by_name.try_emplace(entry->name, index);
      if (added) {
        l.entries.push_back(index);
        continue;
      }
      auto& d = report(lexicon, name, DuplicateName{"entry", std::string(entry->name)});
      d.labels.push_back(declared(all_.entries[it->second], "the first one"));
    }
  }

  void remove(std::uint32_t lexicon, NodeRef name) {
    LexiconDeclaration& l = all_.lexicons[lexicon];
    if (l.extends == kUnreachable) {
      report(lexicon, name, UnknownName{"inherited entry", std::string(name.text()), {}})
          .helps.push_back(fmt::format("{} extends no lexicon, so it inherits none", l.declaration.name));
      return;
    }
    if (const Declaration* entry = entry_of(lexicon, name, l.extends)) l.removed.insert(entry->name);
  }

  /// The entry of another lexicon that a name here means.
  const Declaration* entry_of(std::uint32_t lexicon, NodeRef name, std::uint32_t of) {
    const std::vector<const Declaration*> found = all_.find_entries(name.text(), of);
    if (found.size() == 1) return found.front();
    if (found.empty()) {
      report(lexicon, name,
             UnknownName{fmt::format("entry of {}", all_.lexicons[of].declaration.name), std::string(name.text()),
                         near(name.text(), all_.entry_names(of))});
      return nullptr;
    }
    AmbiguousLabel kind{std::string(name.text()), {}};
    for (const Declaration* e : found) kind.candidates.emplace_back(e->name);
    auto& d = report(lexicon, name, kind);
    for (const Declaration* e : found) d.labels.push_back(declared(*e, "this one"));
    return nullptr;
  }

  /// Puts an entry under its labels and aliases, and says so where another has one of them.
  void label(std::uint32_t lexicon, std::uint32_t index) {
    LexiconDeclaration& l = all_.lexicons[lexicon];
    const Declaration& entry = all_.entries[index];
    for (NodeRef item : entry.node.children()) {
      if (!is_property(item) || (item.at(0).text() != "label" && item.at(0).text() != "alias")) continue;
      for (NodeRef value : item.children()) {
        if (!value.is(NodeKind::string)) continue;
        const std::string text = unquoted(value);
        if (text == entry.name) continue;
        std::vector<std::uint32_t>& all = l.by_label[text];
        if (!all.empty() && all.back() == index) continue;  // the entry says it twice
        const auto named = l.by_name.find(std::string_view(text));
        const Declaration* other = named != l.by_name.end() ? &all_.entries[named->second]
                                   : !all.empty()           ? &all_.entries[all.front()]
                                                            : nullptr;
        all.push_back(index);
        if (other == nullptr || !files_[l.declaration.file].root || entry.lexicon != lexicon) continue;
        auto& d = diagnostics_.report(
            value.tree().source_pointer(), value.range(),
            SharedLabel{text, std::string(entry.name), std::string(other->name), named != l.by_name.end()});
        d.labels.push_back(declared(*other, named != l.by_name.end() ? "of this name" : "has it too"));
      }
    }
  }

  [[nodiscard]] lang::Label declared(const Declaration& entry, std::string text) const {
    const NodeRef name = entry.node.child(NodeKind::name);
    return {entry.node.tree().source_pointer(), (name ? name : entry.node).range(), std::move(text)};
  }

  /// As Evaluator::similar: after many errors none are looked for.
  [[nodiscard]] std::vector<std::string> near(std::string_view name, const std::vector<std::string>& known) const {
    constexpr std::size_t kMostSearches = 100;
    if (diagnostics_.error_count() >= kMostSearches) return {};
    return lang::nearest(name, known);
  }

  template <typename Kind>
  lang::Diagnostic& report(std::uint32_t lexicon, NodeRef at, const Kind& kind) {
    const Declaration& d = all_.lexicons[lexicon].declaration;
    return diagnostics_.report(files_[d.file].tree->source_pointer(), (at ? at : d.node).range(), kind);
  }

  Declarations& all_;
  const std::vector<LoadedFile>& files_;
  lang::Diagnostics& diagnostics_;
  std::vector<std::string> known_;
  std::vector<State> state_;
  std::vector<std::uint32_t> depth_;  ///< lexicons that each extends, over all steps
};

}  // namespace

void link_lexicons(Declarations& all, const std::vector<LoadedFile>& files, lang::Diagnostics& diagnostics) {
  Linker(all, files, diagnostics).run();
}

}  // namespace nms::compiler
