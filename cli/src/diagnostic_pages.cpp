#include "diagnostic_pages.h"

#include <algorithm>

#include <fmt/format.h>

namespace nms::cli {
namespace {

/// The n-th line from 0, without its end.
std::string_view line_of(std::string_view text, std::size_t n) {
  for (; n > 0; --n) {
    const std::size_t end = text.find('\n');
    if (end == std::string_view::npos) return {};
    text.remove_prefix(end + 1);
  }
  return text.substr(0, text.find('\n'));
}

}  // namespace

std::string DiagnosticPage::summary() const {
  std::string out;
  for (std::size_t n = 4; !line_of(text, n).empty(); ++n) {
    if (!out.empty()) out += ' ';
    out += line_of(text, n);
    if (const std::size_t end = out.find(". "); end != std::string::npos) return out.substr(0, end + 1);
  }
  return out;
}

std::string_view DiagnosticPage::group() const {
  const std::string_view line = line_of(text, 2);
  const std::size_t begin = line.find('`');
  if (begin == std::string_view::npos) return {};
  return line.substr(begin + 1, line.rfind('`') - begin - 1);
}

const DiagnosticPage* find_diagnostic_page(std::string_view kind) {
  for (const DiagnosticPage& page : diagnostic_pages())
    if (page.kind == kind) return &page;
  return nullptr;
}

std::vector<std::string_view> warning_groups() {
  std::vector<std::string_view> out;
  for (const DiagnosticPage& page : diagnostic_pages())
    if (!page.group().empty()) out.push_back(page.group());
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

std::string page_text(const DiagnosticPage& page, bool color) {
  const std::string_view bold = color ? "\x1b[1m" : "";
  const std::string_view code = color ? "\x1b[36m" : "";
  const std::string_view off = color ? "\x1b[0m" : "";
  std::string out;
  bool in_code = false;
  std::string_view rest = page.text;
  while (!rest.empty()) {
    std::string_view line = rest.substr(0, rest.find('\n'));
    rest.remove_prefix(std::min(rest.size(), line.size() + 1));
    if (line.starts_with("```")) {
      in_code = !in_code;
      continue;
    }
    if (in_code)
      out += fmt::format("    {}{}{}", code, line, off);
    else if (line.starts_with("# "))
      out += fmt::format("{}{}{}", bold, line.substr(2), off);
    else
      out += line;
    out += '\n';
  }
  return out;
}

}  // namespace nms::cli
