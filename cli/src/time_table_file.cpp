#include "time_table_file.h"

#include <array>
#include <charconv>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nms/lang/quantity.h>

#include "time_table_rows.h"

namespace nms::cli {
namespace {

/// A column that there is not, or one that a row lacks or has twice.
struct TableColumn {
  static constexpr std::string_view kKind = "table_column";
  static constexpr lang::Severity kSeverity = lang::Severity::error;
  std::string cause;
  std::string remedy;
  [[nodiscard]] lang::Description describe() const { return {cause, {remedy}, {}}; }
};

/// A field that does not say what its column means.
struct TableValue {
  static constexpr std::string_view kKind = "table_value";
  static constexpr lang::Severity kSeverity = lang::Severity::error;
  std::string column;
  std::string found;
  std::string expected;
  [[nodiscard]] lang::Description describe() const {
    return {fmt::format("\"{}\" is not {}", found, expected),
            {fmt::format("write {} in the column {}", expected, column)},
            {{"column", column}, {"found", found}}};
  }
};

constexpr std::array<std::string_view, 5> kTexts{"name", "clip", "sign", "index", "hand"};
constexpr std::array<std::string_view, 4> kTimes{"time", "start", "end", "hold"};

struct ColumnName {
  std::string_view name;  ///< without its unit; empty: there is no such column
  std::string_view unit;  ///< "s", "ms", "us", or none
};

ColumnName column_name(std::string_view text) {
  for (const std::string_view known : kTexts)
    if (text == known) return {known, {}};
  for (const std::string_view known : kTimes) {
    if (text == known) return {known, {}};
    for (const std::string_view unit : {"s", "ms", "us"})
      if (text == fmt::format("{}_{}", known, unit)) return {known, unit};
  }
  return {};
}

std::vector<std::string> column_names() {
  std::vector<std::string> names(kTexts.begin(), kTexts.end());
  for (const std::string_view t : kTimes)
    for (const char* unit : {"", "_s", "_ms", "_us"}) names.push_back(fmt::format("{}{}", t, unit));
  return names;
}

class TableReader {
 public:
  TableReader(std::shared_ptr<const lang::Source> source, lang::Diagnostics& diagnostics) : diagnostics_(diagnostics) {
    table_.source = std::move(source);
  }

  std::optional<compiler::TimeTable> read() {
    const std::size_t before = diagnostics_.error_count();
    const std::string& path = table_.source->path();
    const bool json = path.ends_with(".json");
    if (!json && !path.ends_with(".csv")) {
      report({0, 0}, TableSyntax{fmt::format("{} is neither .csv nor .json", path),
                                 "give the table of times as a .csv or a .json file"});
      return std::nullopt;
    }
    for (const TableRow& row :
         json ? read_json_rows(table_.source, diagnostics_) : read_csv_rows(table_.source, diagnostics_))
      add(row);
    if (diagnostics_.error_count() != before) return std::nullopt;
    return std::move(table_);
  }

 private:
  template <typename Kind>
  void report(lang::Range range, const Kind& kind) {
    diagnostics_.report(table_.source, range, kind);
  }

  /// The fields of one row by the columns they stand in.
  struct Fields {
    const TableCell* name = nullptr;
    const TableCell* clip = nullptr;
    const TableCell* sign = nullptr;
    const TableCell* index = nullptr;
    const TableCell* hand = nullptr;
    std::optional<std::int64_t> time, start, end, hold;
  };

  bool collect(const TableRow& row, Fields& f) {
    bool good = true;
    std::vector<std::string_view> seen;
    for (const TableCell& cell : row.cells) {
      const ColumnName column = column_name(cell.column);
      if (column.name.empty()) {
        good = false;
        unknown_column(cell);
        continue;
      }
      for (const std::string_view other : seen)
        if (other == column.name) {
          good = false;
          report(cell.range, TableColumn{fmt::format("this row has its {} twice", column.name),
                                         fmt::format("give {} in one column", column.name)});
        }
      seen.push_back(column.name);
      if (column.name == "name") f.name = &cell;
      if (column.name == "clip") f.clip = &cell;
      if (column.name == "sign") f.sign = &cell;
      if (column.name == "index") f.index = &cell;
      if (column.name == "hand") f.hand = &cell;
      std::optional<std::int64_t>* time = column.name == "time"    ? &f.time
                                          : column.name == "start" ? &f.start
                                          : column.name == "end"   ? &f.end
                                          : column.name == "hold"  ? &f.hold
                                                                   : nullptr;
      if (time != nullptr) good = read_time(cell, column.unit, *time) && good;
    }
    return good;
  }

  /// Said once for a column.
  void unknown_column(const TableCell& cell) {
    for (const std::string& known : unknown_)
      if (known == cell.column) return;
    if (unknown_.size() < 100) unknown_.push_back(cell.column);
    const auto close = lang::nearest(cell.column, column_names());
    report(cell.column_range,
           TableColumn{fmt::format("a table of times has no column \"{}\"", cell.column),
                       close.empty() ? fmt::format("the columns are {}, {}; a time's unit may stand in its column's "
                                                   "name: time_ms",
                                                   fmt::join(kTexts, ", "), fmt::join(kTimes, ", "))
                                     : fmt::format("did you mean {}?", fmt::join(close, " or "))});
  }

  bool read_time(const TableCell& cell, std::string_view unit, std::optional<std::int64_t>& out) {
    const auto q = lang::read_quantity(fmt::format("{}{}", cell.text, unit));
    if (q && q->unit == lang::Unit::time) {
      out = q->nanoseconds;
      return true;
    }
    report(cell.range, TableValue{cell.column, cell.text,
                                  unit.empty() ? std::string("a time with its unit, as 0.70s or 700ms")
                                               : fmt::format("a number of {}", unit == "s"    ? "seconds"
                                                                               : unit == "ms" ? "milliseconds"
                                                                                              : "microseconds")});
    return false;
  }

  void add(const TableRow& row) {
    Fields f;
    if (!collect(row, f)) return;
    const bool of_sign = f.sign != nullptr || f.index != nullptr;
    if (of_sign == (f.name != nullptr)) {
      report(row.range, TableColumn{of_sign ? "this row has a name and a sign" : "this row has no name and no sign",
                                    "a row is a mark, with name and time, or a sign, with clip, sign, start and end"});
      return;
    }
    if (of_sign)
      add_sign(row, f);
    else
      add_mark(row, f);
  }

  void add_mark(const TableRow& row, const Fields& f) {
    if (!f.time) {
      report(row.range, TableColumn{fmt::format("the mark {} has no time", f.name->text),
                                    "give it in the column time, or time_ms"});
      return;
    }
    if (f.start || f.end || f.hold || f.hand != nullptr) {
      report(row.range, TableColumn{fmt::format("the mark {} has times of a sign", f.name->text),
                                    "a mark has name, time and clip only"});
      return;
    }
    table_.marks.push_back({f.name->text, f.clip != nullptr ? f.clip->text : std::string(), *f.time, row.range});
  }

  void add_sign(const TableRow& row, const Fields& f) {
    const std::string& shown = f.sign != nullptr ? f.sign->text : f.index->text;
    if (f.clip == nullptr || !f.start || !f.end || f.time) {
      report(row.range,
             TableColumn{f.time ? fmt::format("the sign {} has a time of a mark", shown)
                                : fmt::format("the sign {} has no {}", shown,
                                              f.clip == nullptr ? "clip"
                                              : !f.start        ? "start"
                                                                : "end"),
                         "a sign has clip (its utterance), sign or index, start, end, and hold where it is held"});
      return;
    }
    compiler::SignTiming t;
    t.clip = f.clip->text;
    if (f.sign != nullptr) t.sign = f.sign->text;
    t.start_ns = *f.start;
    t.stroke_end_ns = *f.end;
    t.end_ns = f.hold.value_or(*f.end);
    t.range = row.range;
    if (f.index != nullptr) {
      const std::string& text = f.index->text;
      const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), t.index);
      if (error != std::errc() || end != text.data() + text.size() || t.index == 0) {
        report(f.index->range, TableValue{"index", text, "a whole number from 1"});
        return;
      }
    }
    if (f.hand != nullptr) {
      t.non_dominant = f.hand->text == "nd";
      if (!t.non_dominant) {
        report(f.hand->range, TableValue{"hand", f.hand->text, "nd, for the other hand, or nothing"});
        return;
      }
    }
    table_.signs.push_back(std::move(t));
  }

  compiler::TimeTable table_;
  lang::Diagnostics& diagnostics_;
  std::vector<std::string> unknown_;
};

}  // namespace

std::optional<compiler::TimeTable> read_time_table(std::shared_ptr<const lang::Source> source,
                                                   lang::Diagnostics& diagnostics) {
  return TableReader(std::move(source), diagnostics).read();
}

}  // namespace nms::cli
