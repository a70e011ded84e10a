#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <nms/lang/diagnostic.h>
#include <nms/lang/source.h>

namespace nms::cli {

/// A table that is no CSV or no JSON.
struct TableSyntax {
  static constexpr std::string_view kKind = "table_syntax";
  static constexpr lang::Severity kSeverity = lang::Severity::error;
  std::string cause;
  std::string remedy;
  [[nodiscard]] lang::Description describe() const { return {cause, {remedy}, {}}; }
};

/// One field of one row: its text, without quotes, and where it stands.
struct TableCell {
  std::string column;
  std::string text;
  lang::Range range;
  lang::Range column_range;  ///< where the column's name stands, or the field
};

/// A row with the fields that are not empty.
struct TableRow {
  std::vector<TableCell> cells;
  lang::Range range;
};

/// Most rows of one table.
inline constexpr std::size_t kMaxTableRows = 1'000'000;

/// Rows of a CSV file, as RFC 4180 says; line ends may be LF alone, and empty lines are no rows.
/// @returns what was read up to the first error
[[nodiscard]] std::vector<TableRow> read_csv_rows(const std::shared_ptr<const lang::Source>& source,
                                                  lang::Diagnostics& diagnostics);
/// Rows of a JSON file: an array of objects of texts and numbers; null is an empty field.
/// @returns what was read up to the first error
[[nodiscard]] std::vector<TableRow> read_json_rows(const std::shared_ptr<const lang::Source>& source,
                                                   lang::Diagnostics& diagnostics);

}  // namespace nms::cli
