#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <string_view>

#include <fmt/format.h>

#include <nms/compiler/test.h>
#include <nms/lang/render.h>

#include "commands.h"
#include "junit.h"
#include "loading.h"
#include "output_file.h"
#include "report.h"

namespace nms::cli {
namespace {

void print_failure(const compiler::TestResult& test, bool color) {
  lang::Diagnostics failures;
  for (const compiler::Expectation& e : test.expectations)
    if (!e.passed) compiler::report_failure(e, failures);
  const std::string text = fmt::format("failed: {}\n{}\n", test.name, lang::render_text(failures, color));
  std::fwrite(text.data(), 1, text.size(), stdout);
}

}  // namespace

int test(const GlobalOptions& global, const TestCommandOptions& options) {
  SourceFiles sources(global.stdlib);
  lang::Diagnostics diagnostics;
  std::vector<TestedFile> tested;
  std::size_t passed = 0;
  std::size_t failed = 0;
  const bool color = ::isatty(STDOUT_FILENO) != 0 && std::getenv("NO_COLOR") == nullptr;
  lang::Diagnostics failures;
  const auto tables = load_time_tables(global, sources, diagnostics);
  // Each file by itself: names of clips in one have nothing to do with those in another.
  for (const auto& root : load_roots(options.files, sources, diagnostics)) {
    if (!tables) break;
    lang::Diagnostics own;
    TestedFile file{root->path(), compiler::run_tests({root}, sources, own, {options.filter, *tables})};
    for (const lang::Diagnostic& d : own.all()) diagnostics.add(d);
    for (const compiler::TestResult& t : file.tests) {
      ++(t.passed() ? passed : failed);
      if (t.passed()) continue;
      print_failure(t, color);
      for (const compiler::Expectation& e : t.expectations)
        if (!e.passed) compiler::report_failure(e, failures);
    }
    tested.push_back(std::move(file));
  }
  if (passed + failed == 0 && diagnostics.error_count() == 0)
    add_failure(diagnostics,
                {"no_tests", options.files.front(),
                 options.filter.empty() ? std::string("there are no tests in what is given")
                                        : fmt::format("no test's name holds \"{}\"", options.filter),
                 "write one: test \"NAME\" { play CLIP; expect AU4 >= 50% }"},
                lang::Severity::warning);
  // Results of sources with errors are no results: none are written.
  if (diagnostics.error_count() == 0 && !options.junit.empty()) {
    const std::string xml = junit(tested);
    if (const auto failure = write_file(options.junit, std::as_bytes(std::span(xml.data(), xml.size()))))
      add_failure(diagnostics, *failure);
  }
  fmt::print("{} passed, {} failed\n", passed, failed);
  // Programs read what failed where they read everything else; people have read it.
  if (global.error_format != ErrorFormat::text)
    for (const lang::Diagnostic& d : failures.all()) diagnostics.add(d);
  const int code = finish(global, diagnostics);
  return failed != 0 ? kErrors : code;
}

}  // namespace nms::cli
