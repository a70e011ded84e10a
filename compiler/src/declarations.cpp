#include "declarations.h"

#include <algorithm>
#include <unordered_set>

#include <fmt/format.h>

#include <nms/compiler/diagnostic_kinds.h>

namespace nms::compiler {

using lang::NodeKind;
using lang::NodeRef;

bool is_property(NodeRef node) { return node.is(NodeKind::property) && node.at(0).exists(); }

std::string_view unquoted(NodeRef node) {
  std::string_view text = node.text();
  if (text.size() >= 2 && (text.front() == '"' || text.front() == '`') && text.back() == text.front())
    text = text.substr(1, text.size() - 2);
  return text;
}

namespace {

std::string_view name_of(NodeRef declaration) {
  const NodeRef name = declaration.child(NodeKind::name);
  return name ? name.text() : std::string_view();
}

/// Reports the second declaration of a name in one file.
class Uniqueness {
 public:
  Uniqueness(const std::vector<LoadedFile>& files, lang::Diagnostics& diagnostics)
      : files_(files), diagnostics_(diagnostics) {}

  bool fresh(const char* space, const char* what, std::string_view name, std::uint32_t file, NodeRef node) {
    const auto [it, added] = seen_.try_emplace(fmt::format("{}\n{}\n{}", space, file, name), node);
    if (added) return true;
    const NodeRef first_name = it->second.child(NodeKind::name);
    const NodeRef this_name = node.child(NodeKind::name);
    const auto& source = files_[file].tree->source_pointer();
    auto& d =
        diagnostics_.report(source, (this_name ? this_name : node).range(), DuplicateName{what, std::string(name)});
    d.labels.push_back({source, (first_name ? first_name : it->second).range(), "the first one"});
    return false;
  }

 private:
  const std::vector<LoadedFile>& files_;
  lang::Diagnostics& diagnostics_;
  std::unordered_map<std::string, NodeRef> seen_;
};

/// Words by which an entry is found: its name, labels and aliases.
void index_entry(LexiconDeclaration& lexicon, std::uint32_t index, const Declaration& entry) {
  lexicon.by_name.try_emplace(entry.name, index);
  for (NodeRef item : entry.node.children()) {
    if (!is_property(item)) continue;
    const std::string_view property = item.at(0).text();
    if (property != "label" && property != "alias") continue;
    for (NodeRef value : item.children())
      if (value.is(NodeKind::string)) lexicon.by_name.try_emplace(unquoted(value), index);
  }
}

/// Names of lexicons that a file speaks of without declaring or using them.
void named_lexicons(const lang::Tree& tree, std::vector<std::string>& out) {
  for (NodeRef d : tree.root().children()) {
    if (!d.is(NodeKind::utterance) && !d.is(NodeKind::discourse) && !d.is(NodeKind::lexicon)) continue;
    for (const NodeKind k : {NodeKind::in, NodeKind::extends})
      if (const NodeRef part = d.child(k))
        if (const NodeRef name = part.child(NodeKind::name)) out.emplace_back(name.text());
  }
}

bool declares_lexicon(const std::vector<LoadedFile>& files, std::string_view name) {
  for (const LoadedFile& f : files)
    for (NodeRef d : f.tree->root().children())
      if (d.is(NodeKind::lexicon) && name_of(d) == name) return true;
  return false;
}

}  // namespace

Declarations Declarations::collect(std::vector<LoadedFile>& files, lang::SourceProvider& provider,
                                   lang::Diagnostics& diagnostics) {
  for (std::uint32_t i = 0; i < files.size(); ++i) {  // `files` grows
    std::vector<std::string> names;
    named_lexicons(*files[i].tree, names);
    for (const std::string& name : names)
      if (!declares_lexicon(files, name))
        load_named(files, i, fmt::format("lexicons/{}.nms", name), provider, diagnostics);
  }

  Declarations all;
  all.files_ = &files;
  Uniqueness unique(files, diagnostics);
  for (std::uint32_t i = 0; i < files.size(); ++i) {
    for (NodeRef node : files[i].tree->root().children()) {
      const Declaration d{node, name_of(node), i};
      switch (node.kind()) {
        case NodeKind::pose:
        case NodeKind::expression:
        case NodeKind::motion:
          if (d.name.empty() || !unique.fresh("movement", "pose, expression or motion", d.name, i, node)) break;
          all.movement_index_[d.name].push_back(static_cast<std::uint32_t>(all.movements.size()));
          all.movements.push_back(d);
          break;
        case NodeKind::timeline:
        case NodeKind::utterance:
        case NodeKind::discourse:
          if (!d.name.empty() && unique.fresh("clip", "timeline, utterance or discourse", d.name, i, node)) {
            all.clip_index_[d.name].push_back(static_cast<std::uint32_t>(all.clips.size()));
            all.clips.push_back(d);
          }
          break;
        case NodeKind::track:
          if (unique.fresh("track", "track", d.name, i, node)) all.tracks.push_back(d);
          break;
        case NodeKind::axis:
          if (unique.fresh("axis", "axis", d.name, i, node)) all.axes.push_back(d);
          break;
        case NodeKind::au: {
          const NodeRef number = node.child(NodeKind::quantity);
          if (number && unique.fresh("au", "action unit", number.text(), i, node))
            all.units.push_back({node, number.text(), i});
          break;
        }
        case NodeKind::muscle:
          if (unique.fresh("muscle", "muscle", d.name, i, node)) all.muscles.push_back(d);
          break;
        case NodeKind::face:
          if (unique.fresh("face", "face", d.name, i, node)) all.faces.push_back(d);
          for (NodeRef part : node.children())
            if (part.is(NodeKind::muscle)) all.muscles.push_back({part, name_of(part), i});
          break;
        case NodeKind::test:
          all.tests.push_back({node, d.name, i});
          break;
        case NodeKind::lexicon: {
          if (d.name.empty() || !unique.fresh("lexicon", "lexicon", d.name, i, node)) break;
          LexiconDeclaration lexicon{d, kUnreachable, {}, {}};
          for (NodeRef part : node.children()) {
            if (!part.is(NodeKind::entry)) continue;
            const std::string_view name = name_of(part);
            if (name.empty() || !unique.fresh(fmt::format("entry {}", d.name).c_str(), "entry", name, i, part))
              continue;
            const auto index = static_cast<std::uint32_t>(all.entries.size());
            all.entries.push_back({part, name, i, static_cast<std::uint32_t>(all.lexicons.size())});
            lexicon.entries.push_back(index);
          }
          // Names before labels: a label never hides another entry's name.
          for (const std::uint32_t e : lexicon.entries) lexicon.by_name.emplace(all.entries[e].name, e);
          for (const std::uint32_t e : lexicon.entries) index_entry(lexicon, e, all.entries[e]);
          all.lexicons.push_back(std::move(lexicon));
          break;
        }
        default:
          break;
      }
    }
  }

  std::vector<std::string> known;
  for (const LexiconDeclaration& l : all.lexicons) known.emplace_back(l.declaration.name);
  for (LexiconDeclaration& lexicon : all.lexicons) {
    const NodeRef extends = lexicon.declaration.node.child(NodeKind::extends);
    if (!extends) continue;
    const NodeRef base = extends.child(NodeKind::name);
    if (!base) continue;
    lexicon.extends = all.find_lexicon(base.text());
    const auto& source = files[lexicon.declaration.file].tree->source_pointer();
    if (lexicon.extends == kUnreachable) {
      diagnostics.report(source, base.range(),
                         MissingLexicon{std::string(base.text()), lang::nearest(base.text(), known), ""});
    }
  }
  // A circle of `extends` is cut where it closes.
  for (std::uint32_t i = 0; i < all.lexicons.size(); ++i) {
    std::uint32_t at = i;
    for (std::size_t steps = 0; at != kUnreachable && steps <= all.lexicons.size(); ++steps) {
      if (all.lexicons[at].extends == i) {
        const Declaration& d = all.lexicons[at].declaration;
        diagnostics.report(files[d.file].tree->source_pointer(), d.node.child(NodeKind::extends).range(),
                           RecursiveDefinition{std::string(all.lexicons[i].declaration.name)});
        all.lexicons[at].extends = kUnreachable;
        break;
      }
      at = all.lexicons[at].extends;
    }
  }
  return all;
}

namespace {

/// Of the declarations of one name the one that is nearest to a file.
const Declaration* nearest_of(const std::unordered_map<std::string_view, std::vector<std::uint32_t>>& index,
                              const std::vector<Declaration>& declarations, std::string_view name,
                              const LoadedFile& from) {
  const auto it = index.find(name);
  if (it == index.end()) return nullptr;
  const Declaration* best = nullptr;
  std::uint32_t best_distance = kUnreachable;
  for (const std::uint32_t i : it->second) {
    const std::uint32_t distance = from.distance[declarations[i].file];
    if (distance < best_distance) {
      best_distance = distance;
      best = &declarations[i];
    }
  }
  return best;
}

}  // namespace

const Declaration* Declarations::find_movement(std::string_view name, std::uint32_t from) const {
  return nearest_of(movement_index_, movements, name, (*files_)[from]);
}

const Declaration* Declarations::find_clip(std::string_view name, std::uint32_t from) const {
  return nearest_of(clip_index_, clips, name, (*files_)[from]);
}

std::uint32_t Declarations::find_lexicon(std::string_view name) const {
  for (std::uint32_t i = 0; i < lexicons.size(); ++i)
    if (lexicons[i].declaration.name == name) return i;
  return kUnreachable;
}

const Declaration* Declarations::find_entry(std::string_view name, std::uint32_t lexicon) const {
  for (; lexicon != kUnreachable; lexicon = lexicons[lexicon].extends) {
    const auto it = lexicons[lexicon].by_name.find(name);
    if (it != lexicons[lexicon].by_name.end()) return &entries[it->second];
  }
  return nullptr;
}

std::vector<const Declaration*> Declarations::entries_of(std::uint32_t lexicon) const {
  std::vector<const Declaration*> out;
  std::unordered_set<std::string_view> seen;
  for (; lexicon != kUnreachable; lexicon = lexicons[lexicon].extends) {
    for (const std::uint32_t e : lexicons[lexicon].entries) {
      if (!seen.insert(entries[e].name).second) continue;  // overridden
      out.push_back(&entries[e]);
    }
  }
  return out;
}

std::vector<std::string> Declarations::movement_names(std::uint32_t from) const {
  std::vector<std::string> names;
  for (const Declaration& d : movements)
    if ((*files_)[from].distance[d.file] != kUnreachable) names.emplace_back(d.name);
  return names;
}

std::vector<std::string> Declarations::entry_names(std::uint32_t lexicon) const {
  std::vector<std::string> names;
  for (const Declaration* e : entries_of(lexicon)) names.emplace_back(e->name);
  return names;
}

}  // namespace nms::compiler
