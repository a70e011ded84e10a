#include "commands.h"
#include "loading.h"
#include "output_file.h"
#include "report.h"

namespace nms::cli {

int compile(const GlobalOptions& global, const std::vector<std::string>& files, const std::string& face,
            const std::string& output) {
  SourceFiles sources(global.stdlib);
  lang::Diagnostics diagnostics;
  if (const auto image = load_program(global, files, face, sources, diagnostics, Reuse::note_inputs))
    if (const auto failure = write_file(output, image->bytes())) add_failure(diagnostics, *failure);
  return finish(global, diagnostics);
}

}  // namespace nms::cli
