#pragma once

#include <string>

#include <nms/lang/diagnostic.h>

namespace nms::lang {

/// Text for people: `path:line:column: error unknown_name: ...`, the source line, the place underlined, labels, help.
/// Tabs are kept in the source line and its underline; wide and combining characters are counted as terminals do.
[[nodiscard]] std::string render_text(const Diagnostics& diagnostics, bool color);

/// JSON for programs: an object {"diagnostics": [...], "errors": n, "warnings": n}. Every diagnostic has kind, severity,
/// file, range {start {line, column, offset}, end}, message, labels, help, fields. UTF-8, invalid bytes replaced.
[[nodiscard]] std::string render_json(const Diagnostics& diagnostics);

}  // namespace nms::lang
