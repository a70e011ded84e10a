#include <cstdio>

#include <fmt/format.h>

#include "commands.h"
#include "loading.h"
#include "overbar.h"
#include "report.h"
#include "tiers.h"

namespace nms::cli {

int gloss(const GlobalOptions& global, const std::string& file, const std::string& clip_name) {
  SourceFiles sources(global.stdlib);
  lang::Diagnostics diagnostics;
  const auto image = load_program(global, {file}, "", sources, diagnostics, Reuse::program_beside);
  if (!image) return finish(global, diagnostics);
  const program::Program& program = image->program();
  const program::Clip* only = nullptr;
  if (!clip_name.empty()) {
    only = find_clip(program, clip_name, file, diagnostics);
    if (only == nullptr) return finish(global, diagnostics);
  }
  std::string out;
  for (const program::Clip& clip : program.clips) {
    const bool is_signed = clip.kind == program::ClipKind::utterance || clip.kind == program::ClipKind::discourse;
    if (only != nullptr ? &clip != only : !is_signed) continue;
    if (!is_signed) {
      add_failure(diagnostics, {"no_signs", file, fmt::format("{} has no signs: it is no utterance", clip_name),
                                fmt::format("nmsc list {} says what each clip is", file)});
      break;
    }
    if (!out.empty()) out += '\n';
    out += fmt::format("// {}\n{}", printable(program.string(clip.name)), overbar_text(program, clip));
  }
  std::fwrite(out.data(), 1, out.size(), stdout);
  return finish(global, diagnostics);
}

}  // namespace nms::cli
