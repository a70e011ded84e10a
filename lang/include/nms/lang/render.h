#pragma once

#include <string>
#include <string_view>

#include <nms/lang/diagnostic.h>

namespace nms::lang {

/// Text for people: `path:line:column: error unknown_name: ...`, the source line, the place underlined, labels, help.
/// Tabs are kept in the source line and its underline; wide and combining characters are counted as terminals do.
[[nodiscard]] std::string render_text(const Diagnostics& diagnostics, bool color);

/// JSON for programs: an object {"diagnostics": [...], "errors": n, "warnings": n}. Every diagnostic has kind,
/// severity, file, range {start {line, column, offset}, end}, message, labels, help, fields. UTF-8, invalid bytes
/// replaced.
[[nodiscard]] std::string render_json(const Diagnostics& diagnostics);

/// What a rule of SARIF says of a kind of diagnostic; what is empty is left out.
struct RuleText {
  std::string summary;   ///< a sentence
  std::string text;      ///< all of it, without marks
  std::string markdown;  ///< the same in Markdown
  std::string group;     ///< of a warning
};

/// SARIF 2.1.0 for build servers: one run, a rule for each kind that occurs. Columns count code points, as SARIF asks.
/// @param version  of the tool, as `nmsc --version` says it
/// @param text_of  what to say of a kind in its rule, see RuleText; null: nothing
[[nodiscard]] std::string render_sarif(const Diagnostics& diagnostics, std::string_view version,
                                       RuleText (*text_of)(std::string_view kind) = nullptr);

}  // namespace nms::lang
