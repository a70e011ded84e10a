#pragma once

#include <memory>
#include <optional>

#include <nms/compiler/time_table.h>
#include <nms/lang/diagnostic.h>

namespace nms::cli {

/// A table of times: CSV (RFC 4180, the first line names the columns) or JSON (an array of objects, whose fields are
/// those columns), by the ending of its path.
///
/// | column | |
/// | name | of a mark; `time` says when |
/// | sign, index | of a sign: its gloss or alias, or which sign of its hand, from 1; `start`, `end`, and `hold` if held
/// | | hand | `nd`: the other hand | | clip | the clip or utterance; a mark without one is any clip's |
///
/// A time has its unit, `0.70s`, or its column has: `time_s`, `start_ms`, `end_us`.
///
/// @returns nothing if an error was reported: `table_syntax`, `table_column` or `table_value`. At most 1 000 000 rows.
[[nodiscard]] std::optional<compiler::TimeTable> read_time_table(std::shared_ptr<const lang::Source> source,
                                                                 lang::Diagnostics& diagnostics);

}  // namespace nms::cli
