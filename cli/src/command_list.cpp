#include <cstdio>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <nms/compiler/lexicon_index.h>
#include <nms/program/enum_names.h>

#include "commands.h"
#include "decimal_seconds.h"
#include "loading.h"
#include "report.h"

namespace nms::cli {
namespace {

std::string joined(const std::vector<std::string>& words) { return fmt::format("{}", fmt::join(words, " ")); }

/// A line for each entry that a file's lexicons declare or include, in order: lexicon, name, function, evidence, ids,
/// labels, meaning, between tabs. What an entry does not state is empty.
std::string entry_lines(const std::vector<compiler::LexiconRecord>& lexicons) {
  std::string out;
  for (const compiler::LexiconRecord& lexicon : lexicons) {
    if (!lexicon.root) continue;
    for (const compiler::EntryRecord& e : lexicon.entries)
      if (!e.inherited)
        out += fmt::format("{}\t{}\t{}\t{}\t{}\t{}\t{}\n", lexicon.name, e.name,
                           e.function.empty() ? "lexical" : e.function, e.evidence, joined(e.ids), joined(e.labels),
                           e.meaning);
  }
  return out;
}

}  // namespace

int list(const GlobalOptions& global, const std::vector<std::string>& files, bool entries) {
  SourceFiles sources(global.stdlib);
  lang::Diagnostics diagnostics;
  if (entries) {
    compiler::TreeCache trees;
    std::string out;
    for (const auto& root : load_roots(files, sources, diagnostics))  // one by one: in the order they were named
      out += entry_lines(compiler::index_lexicons({root}, sources, diagnostics, &trees));
    std::fwrite(out.data(), 1, out.size(), stdout);
    return finish(global, diagnostics);
  }
  if (const auto image = load_program(global, files, "", sources, diagnostics, Reuse::program_beside)) {
    const program::Program& p = image->program();
    std::string out;
    for (const program::Clip& c : p.clips)
      out += fmt::format("{}\t{}\t{}\n", p.string(c.name), program::enum_name(c.kind),
                         decimal_seconds(c.end_ns - c.start_ns));
    std::fwrite(out.data(), 1, out.size(), stdout);
  }
  return finish(global, diagnostics);
}

}  // namespace nms::cli
