#include "commands.h"
#include "loading.h"
#include "report.h"

namespace nms::cli {

int check(const GlobalOptions& global, const std::vector<std::string>& files) {
  SourceFiles sources(global.stdlib);
  lang::Diagnostics diagnostics;
  check_files(global, files, sources, diagnostics);
  return finish(global, diagnostics);
}

}  // namespace nms::cli
