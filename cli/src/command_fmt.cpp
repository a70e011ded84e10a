#include <cstdio>

#include <nms/lang/parse.h>

#include "commands.h"
#include "output_file.h"
#include "report.h"
#include "source_files.h"

namespace nms::cli {

int format(const GlobalOptions& global, const std::vector<std::string>& files, bool check_only) {
  SourceFiles sources(global.stdlib);
  lang::Diagnostics diagnostics;
  if (!global.marks.empty()) {
    add_failure(diagnostics,
                {"wrong_input", global.marks.front(), "formatting asks for no times", "leave --marks out"});
    return finish(global, diagnostics);
  }
  for (const std::string& file : files) {
    const auto source = sources.open(file);
    if (!source) {
      add_failure(diagnostics, source.error());
      continue;
    }
    const std::size_t before = diagnostics.error_count();
    const auto tree = lang::parse(*source, diagnostics);
    if (diagnostics.error_count() != before) continue;
    const std::string text = lang::format(*tree);
    if (check_only) {
      if (text != (*source)->text())
        add_failure(diagnostics, {"not_formatted", file, "it is not in canonical form", "nmsc fmt " + file});
    } else if (file == "-") {
      std::fwrite(text.data(), 1, text.size(), stdout);
    } else if (text != (*source)->text()) {
      if (const auto failure = write_file(file, std::as_bytes(std::span(text.data(), text.size()))))
        add_failure(diagnostics, *failure);
    }
  }
  return finish(global, diagnostics);
}

}  // namespace nms::cli
