#include "junit.h"

#include <iterator>
#include <string_view>

#include <fmt/format.h>

#include <nms/lang/render.h>

#include "xml_text.h"

namespace nms::cli {

std::string junit(const std::vector<TestedFile>& files) {
  std::size_t all = 0;
  std::size_t all_failed = 0;
  std::string suites;
  const auto out = std::back_inserter(suites);
  for (const TestedFile& file : files) {
    std::size_t failed = 0;
    for (const compiler::TestResult& t : file.tests) failed += t.passed() ? 0 : 1;
    all += file.tests.size();
    all_failed += failed;
    const std::string path = xml_escaped(file.path);
    fmt::format_to(out,
                   "  <testsuite name=\"{}\" tests=\"{}\" failures=\"{}\" errors=\"0\" skipped=\"0\" time=\"0\">\n",
                   path, file.tests.size(), failed);
    for (const compiler::TestResult& t : file.tests) {
      const lang::Position at = t.source->position(t.range.begin);
      fmt::format_to(out, "    <testcase name=\"{}\" classname=\"{}\" file=\"{}\" line=\"{}\" time=\"0\"",
                     xml_escaped(t.name), path, path, at.line);
      if (t.passed()) {
        fmt::format_to(out, "/>\n");
        continue;
      }
      fmt::format_to(out, ">\n");
      lang::Diagnostics failures;
      for (const compiler::Expectation& e : t.expectations)
        if (!e.passed) compiler::report_failure(e, failures);
      // Servers differ in whether they read more than one failure of a case: all are in its text.
      fmt::format_to(out, "      <failure type=\"expectation_failed\" message=\"{}\">{}</failure>\n    </testcase>\n",
                     xml_escaped(failures.all().front().message), xml_escaped(lang::render_text(failures, false)));
    }
    fmt::format_to(out, "  </testsuite>\n");
  }
  return fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
      "<testsuites tests=\"{}\" failures=\"{}\" errors=\"0\" time=\"0\">\n{}</testsuites>\n",
      all, all_failed, suites);
}

}  // namespace nms::cli
