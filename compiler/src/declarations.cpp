#include "declarations.h"

#include <algorithm>
#include <array>
#include <functional>
#include <unordered_set>

#include <fmt/format.h>

#include <nms/compiler/diagnostic_kinds.h>

#include "link_lexicons.h"

namespace nms::compiler {

using lang::NodeKind;
using lang::NodeRef;

bool is_property(NodeRef node) { return node.is(NodeKind::property) && node.at(0).exists(); }

std::string_view gloss_text(NodeRef node) {
  std::string_view text = node.text();
  if (text.size() >= 2 && text.front() == '`' && text.back() == '`') text = text.substr(1, text.size() - 2);
  return text;
}

std::string unquoted(NodeRef node) {
  const std::string_view text = node.text();
  if (text.size() < 2 || text.front() != '"' || text.back() != '"') return std::string(gloss_text(node));
  std::string out;
  out.reserve(text.size());
  for (std::size_t i = 1; i + 1 < text.size(); ++i) {
    if (text[i] == '\\' && i + 2 < text.size() && (text[i + 1] == '"' || text[i + 1] == '\\')) ++i;
    out += text[i];
  }
  return out;
}

namespace {

std::string_view name_of(NodeRef declaration) {
  const NodeRef name = declaration.child(NodeKind::name);
  return name ? name.text() : std::string_view();
}

/// Parameters stand right behind the name.
NodeRef params_of(NodeRef movement) {
  if (movement.has(lang::kFlagError)) return movement.child(NodeKind::params);
  bool named = false;
  for (NodeRef part : movement.children()) {
    if (named) return part.is(NodeKind::params) ? part : NodeRef();
    named = part.is(NodeKind::name);
  }
  return {};
}

void report_duplicate(const char* what, std::string_view name, const std::vector<LoadedFile>& files, std::uint32_t file,
                      NodeRef first, NodeRef again, lang::Diagnostics& diagnostics) {
  const NodeRef first_name = first.child(NodeKind::name);
  const NodeRef this_name = again.child(NodeKind::name);
  const auto& source = files[file].tree->source_pointer();
  auto& d = diagnostics.report(source, (this_name ? this_name : again).range(), DuplicateName{what, std::string(name)});
  d.labels.push_back({source, (first_name ? first_name : first).range(), "the first one"});
}

/// Reports the second declaration of a name in one file.
class Uniqueness {
 public:
  Uniqueness(const std::vector<LoadedFile>& files, lang::Diagnostics& diagnostics)
      : files_(files), diagnostics_(diagnostics) {}

  bool fresh(const char* space, const char* what, std::string_view name, std::uint32_t file, NodeRef node) {
    const auto [it, added] = seen_.try_emplace(fmt::format("{}\n{}\n{}", space, file, name), node);
    if (added) return true;
    report_duplicate(what, name, files_, file, it->second, node, diagnostics_);
    return false;
  }

 private:
  const std::vector<LoadedFile>& files_;
  lang::Diagnostics& diagnostics_;
  std::unordered_map<std::string, NodeRef> seen_;
};

/// Names of lexicons that a file speaks of without declaring or using them.
void named_lexicons(const lang::Tree& tree, std::vector<std::string>& out) {
  for (const std::uint32_t declared : tree.declarations()) {
    const NodeRef d = tree.at(declared);
    if (!d.is(NodeKind::utterance) && !d.is(NodeKind::discourse) && !d.is(NodeKind::lexicon)) continue;
    for (const NodeKind k : {NodeKind::in, NodeKind::extends})
      if (const NodeRef part = d.child(k))
        if (const NodeRef name = part.child(NodeKind::name)) out.emplace_back(name.text());
    for (NodeRef part : d.children())
      if (part.is(NodeKind::include))
        if (const NodeRef name = included_from(part)) out.emplace_back(name.text());
  }
}

bool declares_lexicon(const std::vector<LoadedFile>& files, std::string_view name) {
  for (const LoadedFile& f : files)
    for (const std::uint32_t d : f.tree->declarations())
      if (f.tree->at(d).is(NodeKind::lexicon) && name_of(f.tree->at(d)) == name) return true;
  return false;
}

}  // namespace

Declarations Declarations::collect(std::vector<LoadedFile>& files, lang::SourceProvider& provider,
                                   lang::Diagnostics& diagnostics, TreeCache* trees) {
  for (std::uint32_t i = 0; i < files.size(); ++i) {  // `files` grows
    std::vector<std::string> names;
    named_lexicons(*files[i].tree, names);
    for (const std::string& name : names)
      if (!declares_lexicon(files, name))
        load_named(files, i, fmt::format("lexicons/{}.nms", name), provider, diagnostics, trees);
  }

  Declarations all;
  all.files_ = &files;
  Uniqueness unique(files, diagnostics);
  std::size_t movements = 0;
  for (const LoadedFile& file : files)
    for (const std::uint32_t d : file.tree->declarations()) {
      const NodeKind kind = file.tree->at(d).kind();
      movements += kind == NodeKind::pose || kind == NodeKind::expression || kind == NodeKind::motion;
    }
  all.movements.reserve(movements);
  all.has_namesake_.reserve(movements);
  all.has_params_.reserve(movements);
  all.movement_index_.reserve(movements);
  for (std::uint32_t i = 0; i < files.size(); ++i) {
    const lang::Tree& tree = *files[i].tree;
    const std::vector<std::uint32_t>& declarations = tree.declarations();
    // The index of a large file is larger than the processor's cache: memory is asked for it in good time.
    constexpr std::size_t kAhead = 8;
    std::array<NameKey, kAhead> names;
    const auto look_at = [&](std::size_t k) {
      if (k >= declarations.size()) return;
      names[k % kAhead] = NameKey(name_of(tree.at(declarations[k])));
      all.movement_index_.prefetch(names[k % kAhead]);
    };
    for (std::size_t k = 0; k < kAhead; ++k) look_at(k);
    for (std::size_t k = 0; k < declarations.size(); ++k) {
      const NameKey key = names[k % kAhead];
      look_at(k + kAhead);
      const NodeRef node = tree.at(declarations[k]);
      const Declaration d{node, key.name(), i};
      switch (node.kind()) {
        case NodeKind::pose:
        case NodeKind::expression:
        case NodeKind::motion:
          if (!d.name.empty()) all.movement(d, key, files, diagnostics);
          break;
        case NodeKind::timeline:
        case NodeKind::utterance:
        case NodeKind::discourse:
          if (!d.name.empty() && unique.fresh("clip", "timeline, utterance or discourse", d.name, i, node)) {
            all.clip_index_[d.name].push_back(static_cast<std::uint32_t>(all.clips.size()));
            all.clips.push_back(d);
          }
          break;
        case NodeKind::ambient:
          if (d.name.empty() || !unique.fresh("ambient", "ambient", d.name, i, node)) break;
          all.ambient_index_[d.name].push_back(static_cast<std::uint32_t>(all.ambients.size()));
          all.ambients.push_back(d);
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
        case NodeKind::degree:
          if (!d.name.empty() && unique.fresh("degree", "degree", d.name, i, node)) {
            all.degree_index_[d.name].push_back(static_cast<std::uint32_t>(all.degrees.size()));
            all.degrees.push_back(d);
          }
          break;
        case NodeKind::test:
          all.tests.push_back({node, d.name, i});
          break;
        case NodeKind::lexicon: {
          if (d.name.empty() || !unique.fresh("lexicon", "lexicon", d.name, i, node)) break;
          LexiconDeclaration lexicon;
          lexicon.declaration = d;
          for (NodeRef part : node.children()) {
            if (part.is(NodeKind::combine)) lexicon.combinations.push_back(part);
            if (!part.is(NodeKind::entry)) continue;
            const std::string_view name = name_of(part);
            if (name.empty() || !unique.fresh(fmt::format("entry {}", d.name).c_str(), "entry", name, i, part))
              continue;
            const auto index = static_cast<std::uint32_t>(all.entries.size());
            all.entries.push_back({part, name, i, static_cast<std::uint32_t>(all.lexicons.size())});
            lexicon.entries.push_back(index);
          }
          for (const std::uint32_t e : lexicon.entries) lexicon.by_name.emplace(all.entries[e].name, e);
          all.lexicon_index_.try_emplace(d.name, static_cast<std::uint32_t>(all.lexicons.size()));
          all.lexicons.push_back(std::move(lexicon));
          break;
        }
        default:
          break;
      }
    }
    all.movements_end_.push_back(static_cast<std::uint32_t>(all.movements.size()));
  }

  link_lexicons(all, files, diagnostics);
  return all;
}

void Declarations::movement(const Declaration& d, const NameKey& name, const std::vector<LoadedFile>& files,
                            lang::Diagnostics& diagnostics) {
  const auto index = static_cast<std::uint32_t>(movements.size());
  const std::uint32_t first =
      movement_index_.insert(name, index, [&](std::uint32_t i) { return movements[i].name == d.name; });
  std::uint32_t last = first;
  for (std::uint32_t i = first; i != kUnreachable; i = next_of_name(i)) {
    if (movements[i].file == d.file)
      return report_duplicate("pose, expression or motion", d.name, files, d.file, movements[i].node, d.node,
                              diagnostics);
    last = i;
  }
  if (last != kUnreachable) {
    next_of_name_.emplace(last, index);
    has_namesake_[last] = true;
  }
  movements.push_back(d);
  has_namesake_.push_back(last != kUnreachable);
  has_params_.push_back(params_of(d.node).exists());
}

std::uint32_t Declarations::next_of_name(std::uint32_t movement) const {
  if (next_of_name_.empty()) return kUnreachable;
  const auto it = next_of_name_.find(movement);
  return it == next_of_name_.end() ? kUnreachable : it->second;
}

std::uint32_t Declarations::only_movement(const NameKey& name) const {
  const std::uint32_t number =
      movement_index_.find(name, [&](std::uint32_t i) { return movements[i].name == name.name(); });
  return number == kUnreachable || has_namesake_[number] ? kUnreachable : number;
}

std::uint32_t Declarations::own_movement(const NameKey& name, std::uint32_t file) const {
  const std::uint32_t number = only_movement(name);
  const std::uint32_t begin = file == 0 ? 0 : movements_end_[file - 1];
  return number >= begin && number < movements_end_[file] ? number : kUnreachable;
}

std::uint32_t Declarations::movement_number(const Declaration& d) const {
  const std::less<const Declaration*> before;
  if (movements.empty() || before(&d, movements.data()) || before(&movements.back(), &d)) return kUnreachable;
  return static_cast<std::uint32_t>(&d - movements.data());
}

NodeRef Declarations::params(const Declaration& d) const {
  const std::uint32_t number = movement_number(d);
  return number != kUnreachable && !has_params_[number] ? NodeRef() : d.node.child(NodeKind::params);
}

const Declaration* Declarations::find_movement(std::string_view name, std::uint32_t from) const {
  const Declaration* best = nullptr;
  std::uint32_t best_distance = kUnreachable;
  std::uint32_t i = movement_index_.find(name, [&](std::uint32_t k) { return movements[k].name == name; });
  for (; i != kUnreachable; i = next_of_name(i)) {
    const std::uint32_t distance = (*files_)[from].distance[movements[i].file];
    if (distance < best_distance) {
      best_distance = distance;
      best = &movements[i];
    }
  }
  return best;
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

const Declaration* Declarations::find_clip(std::string_view name, std::uint32_t from) const {
  return nearest_of(clip_index_, clips, name, (*files_)[from]);
}

const Declaration* Declarations::find_degree(std::string_view name, std::uint32_t from) const {
  return nearest_of(degree_index_, degrees, name, (*files_)[from]);
}

std::vector<std::string> Declarations::degree_names(std::uint32_t from) const {
  std::vector<std::string> names;
  for (const Declaration& d : degrees)
    if ((*files_)[from].distance[d.file] != kUnreachable) names.emplace_back(d.name);
  return names;
}

const Declaration* Declarations::find_ambient(std::string_view name, std::uint32_t from) const {
  return nearest_of(ambient_index_, ambients, name, (*files_)[from]);
}

std::uint32_t Declarations::find_lexicon(std::string_view name) const {
  const auto it = lexicon_index_.find(name);
  return it == lexicon_index_.end() ? kUnreachable : it->second;
}

bool Declarations::hidden(const Declaration& entry, std::uint32_t from, std::uint32_t at) const {
  for (; from != at; from = lexicons[from].extends)
    if (lexicons[from].removed.contains(entry.name) || lexicons[from].by_name.contains(entry.name)) return true;
  return false;
}

std::vector<const Declaration*> Declarations::find_entries(std::string_view name, std::uint32_t lexicon) const {
  std::vector<const Declaration*> found;
  for (std::uint32_t at = lexicon; at != kUnreachable && found.empty(); at = lexicons[at].extends) {
    const LexiconDeclaration& l = lexicons[at];
    if (const auto it = l.by_name.find(name); it != l.by_name.end()) {
      if (!hidden(entries[it->second], lexicon, at)) found.push_back(&entries[it->second]);
      continue;
    }
    if (const auto it = l.by_label.find(name); it != l.by_label.end())
      for (const std::uint32_t e : it->second)
        if (!hidden(entries[e], lexicon, at)) found.push_back(&entries[e]);
  }
  return found;
}

const Declaration* Declarations::find_entry(std::string_view name, std::uint32_t lexicon) const {
  const auto found = find_entries(name, lexicon);
  return found.empty() ? nullptr : found.front();
}

std::vector<const Declaration*> Declarations::entries_of(std::uint32_t lexicon) const {
  std::vector<const Declaration*> out;
  std::unordered_set<std::string_view> seen;
  for (; lexicon != kUnreachable; lexicon = lexicons[lexicon].extends) {
    for (const std::uint32_t e : lexicons[lexicon].entries) {
      if (!seen.insert(entries[e].name).second) continue;  // overridden
      out.push_back(&entries[e]);
    }
    seen.insert(lexicons[lexicon].removed.begin(), lexicons[lexicon].removed.end());
  }
  return out;
}

const LexiconDeclaration* Declarations::lexicon_with(std::string_view name) const {
  for (std::uint32_t i = 0; i < lexicons.size(); ++i)
    if (find_entry(name, i) != nullptr) return &lexicons[i];
  return nullptr;
}

std::vector<std::string> Declarations::movement_names(std::uint32_t from) const {
  std::vector<std::string> names;
  for (const Declaration& d : movements)
    if ((*files_)[from].distance[d.file] != kUnreachable) names.emplace_back(d.name);
  return names;
}

std::vector<std::string> Declarations::ambient_names(std::uint32_t from) const {
  std::vector<std::string> names;
  for (const Declaration& d : ambients)
    if ((*files_)[from].distance[d.file] != kUnreachable) names.emplace_back(d.name);
  return names;
}

std::vector<std::string> Declarations::entry_names(std::uint32_t lexicon) const {
  std::vector<std::string> names;
  for (const Declaration* e : entries_of(lexicon)) names.emplace_back(e->name);
  return names;
}

}  // namespace nms::compiler
