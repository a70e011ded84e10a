#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace nms::cli {

/// What there is to say of one kind of diagnostic: a file of docs/diagnostics/. Its third line says how severe it is,
/// and of a warning the group: "A warning, of the group `timing`.".
struct DiagnosticPage {
  std::string_view kind;
  std::string_view text;  ///< Markdown; static storage

  /// The first sentence of what it says.
  [[nodiscard]] std::string summary() const;
  /// The group of a warning, or nothing.
  [[nodiscard]] std::string_view group() const;
};

/// Every page, ordered by kind.
[[nodiscard]] std::span<const DiagnosticPage> diagnostic_pages();
/// The page of a kind, or null.
[[nodiscard]] const DiagnosticPage* find_diagnostic_page(std::string_view kind);
/// The groups that warnings belong to, in alphabetical order, each once.
[[nodiscard]] std::vector<std::string_view> warning_groups();

/// The page as a terminal shows it: titles and code set off, marks of Markdown left out.
[[nodiscard]] std::string page_text(const DiagnosticPage& page, bool color);

}  // namespace nms::cli
