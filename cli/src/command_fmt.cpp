#include <cstdint>
#include <cstdio>
#include <optional>
#include <utility>

#include <nms/lang/parse.h>

#include "commands.h"
#include "output_file.h"
#include "report.h"
#include "source_files.h"

namespace nms::cli {
namespace {

/// "3:5" as two lines; nothing for anything else.
std::optional<std::pair<std::uint32_t, std::uint32_t>> line_range(const std::string& text) {
  unsigned first = 0;
  unsigned last = 0;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%9u:%9u%c", &first, &last, &rest) != 2 || first == 0 || last < first)
    return std::nullopt;
  return std::pair{first, last};
}

}  // namespace

std::string wrong_line_range(const std::string& text) {
  return line_range(text) ? std::string() : text + " is no range of lines: write the first and the last, as 3:5";
}

int format(const GlobalOptions& global, const std::vector<std::string>& files, const FormatOptions& options) {
  const auto range = line_range(options.lines);
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
    const std::string text = range ? lang::format_range(*tree, range->first, range->second) : lang::format(*tree);
    if (options.check_only) {
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
