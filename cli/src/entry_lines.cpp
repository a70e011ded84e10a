#include "entry_lines.h"

#include <string_view>

#include <fmt/format.h>

namespace nms::cli {
namespace {

using lang::NodeKind;
using lang::NodeRef;

std::string_view unquoted(std::string_view text) {
  return text.size() >= 2 && text.front() == '"' ? text.substr(1, text.size() - 2) : text;
}

/// All values of the entry's properties of that name, with a blank between them.
std::string values(NodeRef entry, std::string_view property) {
  std::string out;
  for (NodeRef item : entry.children()) {
    if (!item.is(NodeKind::property) || !item.at(0) || item.at(0).text() != property) continue;
    for (NodeRef value : item.children()) {
      if (value == item.at(0)) continue;
      if (!out.empty()) out += ' ';
      out += unquoted(value.text());
    }
  }
  return out;
}

std::string line(std::string_view lexicon, NodeRef entry) {
  const NodeRef function = entry.child(NodeKind::function);
  return fmt::format("{}\t{}\t{}\t{}\t{}\t{}\t{}\n", lexicon, entry.child(NodeKind::name).text(),
                     function ? function.text() : std::string_view("lexical"), values(entry, "evidence"),
                     values(entry, "id"), values(entry, "label"), values(entry, "meaning"));
}

/// The lines of `include mm, th from asl`; what the other lexicon includes itself is followed, `depth` files far.
std::string included(std::string_view lexicon, NodeRef include, const FindLexicon& find, int depth) {
  NodeRef from;
  for (NodeRef name : include.children()) from = name;
  const auto tree = depth > 0 && from ? find(from.text()) : nullptr;
  if (!tree) return {};
  std::string out;
  for (NodeRef name : include.children()) {
    if (name == from) break;
    for (NodeRef other : tree->root().children()) {
      if (!other.is(NodeKind::lexicon) || other.child(NodeKind::name).text() != from.text()) continue;
      for (NodeRef part : other.children()) {
        if (part.is(NodeKind::entry) && part.child(NodeKind::name).text() == name.text()) out += line(lexicon, part);
        if (!part.is(NodeKind::include)) continue;
        for (NodeRef again : part.children())
          if (again.text() == name.text() && again != from) out += included(lexicon, part, find, depth - 1);
      }
    }
  }
  return out;
}

}  // namespace

std::string entry_lines(const lang::Tree& tree, const FindLexicon& find) {
  constexpr int kMostFiles = 10;  // of lexicons that include from one another
  std::string out;
  for (NodeRef lexicon : tree.root().children()) {
    if (!lexicon.is(NodeKind::lexicon)) continue;
    const std::string_view name = lexicon.child(NodeKind::name).text();
    for (NodeRef part : lexicon.children()) {
      if (part.has(lang::kFlagError)) continue;
      if (part.is(NodeKind::entry)) out += line(name, part);
      if (part.is(NodeKind::include)) out += included(name, part, find, kMostFiles);
    }
  }
  return out;
}

}  // namespace nms::cli
