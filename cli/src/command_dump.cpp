#include <cstdio>

#include <nms/program/text.h>

#include "commands.h"
#include "loading.h"
#include "report.h"

namespace nms::cli {

int dump(const GlobalOptions& global, const std::string& file) {
  SourceFiles sources(global.stdlib);
  lang::Diagnostics diagnostics;
  if (const auto image = load_program(global, {file}, "", sources, diagnostics)) {
    const std::string text = program::to_text(image->program());
    std::fwrite(text.data(), 1, text.size(), stdout);
  }
  return finish(global, diagnostics);
}

}  // namespace nms::cli
