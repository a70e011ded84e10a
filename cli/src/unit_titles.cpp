#include "unit_titles.h"

#include <string_view>

#include <fmt/format.h>

#include <nms/lang/parse.h>

namespace nms::cli {

std::map<std::string, std::string> unit_titles(const SourceFiles& sources) {
  std::map<std::string, std::string> titles;
  for (const auto& source : sources.sources_read()) {
    lang::Diagnostics told_before;
    const auto tree = lang::parse(source, told_before);
    for (const lang::NodeRef node : tree->root().children()) {
      if (!node.is(lang::NodeKind::au)) continue;
      const lang::NodeRef string = node.child(lang::NodeKind::string);
      if (!string.exists() || string.text().size() < 2) continue;
      const std::string_view quoted = string.text();
      titles.try_emplace(fmt::format("AU{}", node.child(lang::NodeKind::quantity).text()),
                         quoted.substr(1, quoted.size() - 2));
    }
  }
  return titles;
}

}  // namespace nms::cli
