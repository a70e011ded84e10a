#include "report.h"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <mutex>
#include <set>
#include <string>

#include <fmt/format.h>

#include <nms/lang/render.h>

#include "diagnostic_pages.h"
#include "warning_policy.h"

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

namespace {

/// The page of a kind, as a rule of SARIF says it.
lang::RuleText rule_text(std::string_view kind) {
  const DiagnosticPage* page = find_diagnostic_page(kind);
  if (page == nullptr) return {};
  return {page->summary(), page_text(*page, false), std::string(page->text), std::string(page->group())};
}

/// The kinds that were reported and have a page: told on a terminal only, where somebody may ask.
std::string hint(const lang::Diagnostics& diagnostics, bool color) {
  std::set<std::string_view> kinds;
  for (const lang::Diagnostic& d : diagnostics.all())
    if (find_diagnostic_page(d.kind) != nullptr) kinds.insert(d.kind);
  if (kinds.size() != 1) return kinds.empty() ? "" : "\nnmsc explain KIND says more of each.\n";
  return fmt::format("\n{}nmsc explain {} says more.{}\n", color ? "\x1b[2m" : "", *kinds.begin(),
                     color ? "\x1b[0m" : "");
}

}  // namespace

std::FILE* told(const GlobalOptions& global) { return global.error_format == ErrorFormat::text ? stderr : stdout; }

int finish(const GlobalOptions& global, lang::Diagnostics& diagnostics) {
  const auto verdict = [&](std::string_view kind) { return verdict_on(kind, global.denied, global.allowed); };
  diagnostics.leave_out_warnings([&](std::string_view kind) { return verdict(kind) == Verdict::left_out; });
  diagnostics.sort();
  if (global.error_format != ErrorFormat::text) {
    const std::string text = global.error_format == ErrorFormat::json
                                 ? lang::render_json(diagnostics)
                                 : lang::render_sarif(diagnostics, NMS_VERSION, &rule_text);
    std::fwrite(text.data(), 1, text.size(), stderr);
    if (text.empty() || text.back() != '\n') std::fputc('\n', stderr);
  } else if (!diagnostics.all().empty()) {
    const bool color = ::isatty(STDERR_FILENO) != 0 && std::getenv("NO_COLOR") == nullptr;
    std::string text = lang::render_text(diagnostics, color);
    if (::isatty(STDERR_FILENO) != 0) text += hint(diagnostics, color);
    std::fwrite(text.data(), 1, text.size(), stderr);
  }
  const bool denied = std::any_of(diagnostics.all().begin(), diagnostics.all().end(), [&](const lang::Diagnostic& d) {
    return d.severity == lang::Severity::warning && verdict(d.kind) == Verdict::denied;
  });
  return diagnostics.error_count() == 0 && !denied ? kSuccess : kErrors;
}

}  // namespace nms::cli
