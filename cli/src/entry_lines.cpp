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

}  // namespace

std::string entry_lines(const lang::Tree& tree) {
  std::string out;
  for (NodeRef lexicon : tree.root().children()) {
    if (!lexicon.is(NodeKind::lexicon)) continue;
    const NodeRef lexicon_name = lexicon.child(NodeKind::name);
    for (NodeRef entry : lexicon.children()) {
      if (!entry.is(NodeKind::entry) || entry.has(lang::kFlagError)) continue;
      const NodeRef function = entry.child(NodeKind::function);
      out += fmt::format("{}\t{}\t{}\t{}\t{}\t{}\t{}\n", lexicon_name.text(), entry.child(NodeKind::name).text(),
                         function ? function.text() : std::string_view("lexical"), values(entry, "evidence"),
                         values(entry, "id"), values(entry, "label"), values(entry, "meaning"));
    }
  }
  return out;
}

}  // namespace nms::cli
