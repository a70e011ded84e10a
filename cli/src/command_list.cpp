#include <cstdio>
#include <string_view>

#include <fmt/format.h>
#include <nms/lang/parse.h>

#include "commands.h"
#include "decimal_seconds.h"
#include "entry_lines.h"
#include "loading.h"
#include "report.h"

namespace nms::cli {
namespace {

std::string_view kind_name(program::ClipKind kind) {
  static constexpr std::string_view kNames[] = {"pose", "expression", "timeline", "entry", "utterance", "discourse"};
  return kNames[static_cast<std::size_t>(kind)];
}

}  // namespace

int list(const GlobalOptions& global, const std::vector<std::string>& files, bool entries) {
  SourceFiles sources(global.stdlib);
  lang::Diagnostics diagnostics;
  if (entries) {
    std::string out;
    for (const auto& source : load_roots(files, sources, diagnostics))
      out += entry_lines(*lang::parse(source, diagnostics), [&](std::string_view name) {
        auto file = sources.find(fmt::format("{}.nms", name), source->path());
        if (!file) file = sources.find(fmt::format("lexicons/{}.nms", name), source->path());
        return file ? lang::parse(file, diagnostics) : nullptr;
      });
    std::fwrite(out.data(), 1, out.size(), stdout);
    return finish(global, diagnostics);
  }
  if (const auto image = load_program(global, files, "", sources, diagnostics, Reuse::program_beside)) {
    const program::Program& p = image->program();
    std::string out;
    for (const program::Clip& c : p.clips)
      out += fmt::format("{}\t{}\t{}\n", p.string(c.name), kind_name(c.kind), decimal_seconds(c.end_ns - c.start_ns));
    std::fwrite(out.data(), 1, out.size(), stdout);
  }
  return finish(global, diagnostics);
}

}  // namespace nms::cli
