#include <nms/compiler/lexicon_index.h>

#include <string_view>

#include "declarations.h"
#include "load_sources.h"

namespace nms::compiler {

using lang::NodeKind;
using lang::NodeRef;

namespace {

/// The values of a property, strings without their quotes.
std::vector<std::string> values_of(NodeRef property) {
  std::vector<std::string> values;
  bool first = true;
  for (NodeRef value : property.children()) {
    if (!first) values.emplace_back(value.is(NodeKind::string) ? unquoted(value) : value.text());
    first = false;  // the property's own name
  }
  return values;
}

/// The text of `licence "..."`, or nothing.
std::string licence_of(NodeRef declaration) {
  for (NodeRef p : declaration.children()) {
    if (!is_property(p) || p.at(0).text() != "licence") continue;
    const std::vector<std::string> values = values_of(p);
    if (!values.empty()) return values.front();
  }
  return {};
}

EntryRecord record_of(const Declaration& e, const Declarations& all) {
  EntryRecord out;
  out.name = e.name;
  if (const NodeRef function = e.node.child(NodeKind::function)) out.function = function.text();
  for (NodeRef p : e.node.children()) {
    if (!is_property(p)) continue;
    const std::string_view name = p.at(0).text();
    std::vector<std::string> values = values_of(p);
    if (values.empty()) continue;
    if (name == "meaning") out.meaning = values.front();
    if (name == "spreads") out.spreads = values.front();
    if (name == "evidence") out.evidence = values.front();
    if (name == "id") out.ids.insert(out.ids.end(), values.begin(), values.end());
    if (name == "label") out.labels.insert(out.labels.end(), values.begin(), values.end());
    if (name == "alias") out.aliases.insert(out.aliases.end(), values.begin(), values.end());
    if (name == "source") out.sources.insert(out.sources.end(), values.begin(), values.end());
  }
  out.range = e.node.range();
  for (NodeRef doc : e.node.children()) {
    if (!doc.is(NodeKind::doc_comment)) break;
    std::string_view line = doc.text();
    while (!line.empty() && (line.front() == '/' || line.front() == ' ')) line.remove_prefix(1);
    out.comment += (out.comment.empty() ? "" : " ") + std::string(line);
  }
  out.source = e.node.tree().source_pointer();
  const lang::Source& source = *out.source;
  out.file = source.path();
  out.line = source.position(e.node.range().begin).line;
  out.lexicon = all.lexicons[e.lexicon].declaration.name;
  return out;
}

}  // namespace

std::vector<LexiconRecord> index_lexicons(const std::vector<std::shared_ptr<const lang::Source>>& roots,
                                          lang::SourceProvider& provider, lang::Diagnostics& diagnostics,
                                          TreeCache* trees) {
  std::vector<LoadedFile> files = load_sources(roots, provider, diagnostics, trees);
  const Declarations all = Declarations::collect(files, provider, diagnostics, trees);
  std::vector<LexiconRecord> out;
  for (std::uint32_t i = 0; i < all.lexicons.size(); ++i) {
    const LexiconDeclaration& l = all.lexicons[i];
    LexiconRecord record;
    record.name = l.declaration.name;
    record.root = files[l.declaration.file].root;
    if (const NodeRef title = l.declaration.node.child(NodeKind::string)) record.title = unquoted(title);
    if (l.extends != kUnreachable) record.extends = all.lexicons[l.extends].declaration.name;
    record.licence = licence_of(l.declaration.node);
    // Own entries stand first, in order: those that are declared, then those that are included.
    for (const Declaration* e : all.entries_of(i)) {
      record.entries.push_back(record_of(*e, all));
      record.entries.back().inherited = record.entries.size() > l.entries.size();
    }
    out.push_back(std::move(record));
  }
  return out;
}

std::vector<FaceRecord> index_faces(const std::vector<std::shared_ptr<const lang::Source>>& roots,
                                    lang::SourceProvider& provider, lang::Diagnostics& diagnostics, TreeCache* trees) {
  std::vector<LoadedFile> files = load_sources(roots, provider, diagnostics, trees);
  std::vector<FaceRecord> out;
  for (const Declaration& face : Declarations::collect(files, provider, diagnostics, trees).faces)
    if (files[face.file].root) out.push_back({std::string(face.name), licence_of(face.node)});
  return out;
}

}  // namespace nms::compiler
