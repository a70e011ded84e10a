#include "report.h"

#include <unistd.h>

#include <cstdlib>
#include <mutex>
#include <set>
#include <string>

#include <fmt/format.h>

#include <nms/lang/render.h>

namespace nms::cli {

void add_failure(lang::Diagnostics& diagnostics, const program::Failure& failure, lang::Severity severity) {
  // Kinds are static strings for the text's own diagnostics; a failure's kind is kept for the life of the process.
  static std::set<std::string, std::less<>> kinds;
  lang::Diagnostic d;
  d.kind = *kinds.insert(failure.kind).first;
  d.severity = severity;
  if (!failure.place.empty()) d.source = std::make_shared<const lang::Source>(failure.place, std::string());
  d.message = failure.cause;
  if (!failure.remedy.empty()) d.helps.push_back(failure.remedy);
  d.fields = {{"place", failure.place}};
  diagnostics.add(std::move(d));
}

int finish(const GlobalOptions& global, lang::Diagnostics& diagnostics) {
  diagnostics.sort();
  if (global.error_format != ErrorFormat::text) {
    const std::string text = global.error_format == ErrorFormat::json ? lang::render_json(diagnostics)
                                                                      : lang::render_sarif(diagnostics, NMS_VERSION);
    std::fwrite(text.data(), 1, text.size(), stderr);
    if (text.empty() || text.back() != '\n') std::fputc('\n', stderr);
  } else if (!diagnostics.all().empty()) {
    const bool color = ::isatty(STDERR_FILENO) != 0 && std::getenv("NO_COLOR") == nullptr;
    const std::string text = lang::render_text(diagnostics, color);
    std::fwrite(text.data(), 1, text.size(), stderr);
  }
  const bool denied = global.deny_warnings && diagnostics.warning_count() != 0;
  return diagnostics.error_count() == 0 && !denied ? kSuccess : kErrors;
}

}  // namespace nms::cli
