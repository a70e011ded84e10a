#include <cstdio>
#include <span>

#include "commands.h"
#include "loading.h"
#include "output_file.h"
#include "plot_svg.h"
#include "report.h"

namespace nms::cli {

int plot(const GlobalOptions& global, const PlotOptions& options) {
  SourceFiles sources(global.stdlib);
  lang::Diagnostics diagnostics;
  const auto image = load_program(global, {options.file}, "", sources, diagnostics, Reuse::program_beside);
  if (!image) return finish(global, diagnostics);
  const program::Clip* clip = find_clip(image->program(), options.clip, options.file, diagnostics);
  if (clip == nullptr) return finish(global, diagnostics);
  const std::string svg = plot_svg(image->program(), *clip, options.width);
  if (options.output == "-")
    std::fwrite(svg.data(), 1, svg.size(), stdout);
  else if (const auto failure = write_file(options.output, std::as_bytes(std::span(svg.data(), svg.size()))))
    add_failure(diagnostics, *failure);
  return finish(global, diagnostics);
}

}  // namespace nms::cli
