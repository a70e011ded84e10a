#include "warning_policy.h"

#include <algorithm>

#include <fmt/format.h>

#include <nms/lang/diagnostic.h>

#include "diagnostic_pages.h"

namespace nms::cli {
namespace {

bool names(const std::vector<std::string>& words, std::string_view word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

}  // namespace

Verdict verdict_on(std::string_view kind, const std::vector<std::string>& denied,
                   const std::vector<std::string>& allowed) {
  const DiagnosticPage* page = find_diagnostic_page(kind);
  const std::string_view group = page != nullptr ? page->group() : std::string_view();
  if (names(denied, kind)) return Verdict::denied;
  if (names(allowed, kind)) return Verdict::left_out;
  if (names(denied, group)) return Verdict::denied;
  if (names(allowed, group)) return Verdict::left_out;
  return names(denied, "warnings") ? Verdict::denied : Verdict::shown;
}

std::string wrong_warning_name(const std::string& word, bool all_may_be_meant) {
  if (all_may_be_meant && word == "warnings") return {};
  std::vector<std::string> known;
  for (const std::string_view group : warning_groups()) known.emplace_back(group);
  std::string groups;
  for (const std::string& group : known) groups += (groups.empty() ? "" : ", ") + group;
  for (const DiagnosticPage& page : diagnostic_pages()) {
    if (page.kind == word && page.group().empty()) return word + " is an error, which cannot be left out";
    if (!page.group().empty()) known.emplace_back(page.kind);
  }
  if (std::find(known.begin(), known.end(), word) != known.end()) return {};
  const auto close = lang::nearest(word, known);
  return fmt::format(
      "{} is no group and no kind of warning; {}", word,
      close.empty() ? fmt::format("the groups are {}", groups) : fmt::format("did you mean {}?", close.front()));
}

}  // namespace nms::cli
