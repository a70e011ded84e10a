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

/// SARIF 2.1.0 for build servers: one run, a rule for each kind that occurs. Columns count code points, as SARIF asks.
/// @param version  of the tool, as `nmsc --version` says it
[[nodiscard]] std::string render_sarif(const Diagnostics& diagnostics, std::string_view version);

}  // namespace nms::lang
