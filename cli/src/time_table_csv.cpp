#include "time_table_rows.h"

#include <fmt/format.h>

namespace nms::cli {
namespace {

/// Fields from left to right, rows from top to bottom.
class CsvReader {
 public:
  CsvReader(const std::shared_ptr<const lang::Source>& source, lang::Diagnostics& diagnostics)
      : source_(source), text_(source->text()), diagnostics_(diagnostics) {
    if (text_.substr(0, 3) == "\xEF\xBB\xBF") at_ = 3;
  }

  std::vector<TableRow> read() {
    std::vector<TableRow> rows;
    std::vector<TableCell> cells;
    std::vector<TableCell> columns;
    if (!next_row(columns)) {
      if (at_ == text_.size() && !failed_)
        fail({0, 0}, "the table is empty", "its first line names the columns: name,time,clip");
      return rows;
    }
    while (next_row(cells)) {
      const lang::Range range{cells.front().range.begin, cells.back().range.end};
      if (cells.size() != columns.size()) {
        fail(range,
             fmt::format("this row has {} field{}, and the first line names {}", cells.size(),
                         cells.size() == 1 ? "" : "s", columns.size()),
             "give every row as many fields as there are columns; a field with a comma stands in quotes");
        break;
      }
      if (rows.size() == kMaxTableRows) {
        fail(range, fmt::format("the table has more than {} rows", kMaxTableRows), "split it into several tables");
        break;
      }
      TableRow row;
      row.range = range;
      for (std::size_t i = 0; i < cells.size(); ++i) {
        if (cells[i].text.empty()) continue;
        cells[i].column = columns[i].text;
        cells[i].column_range = columns[i].range;
        row.cells.push_back(std::move(cells[i]));
      }
      rows.push_back(std::move(row));
    }
    return rows;
  }

 private:
  void fail(lang::Range range, std::string cause, std::string remedy) {
    diagnostics_.report(source_, range, TableSyntax{std::move(cause), std::move(remedy)});
    at_ = text_.size();
    failed_ = true;
  }

  bool line_end() const {
    return text_[at_] == '\n' || (text_[at_] == '\r' && at_ + 1 < text_.size() && text_[at_ + 1] == '\n');
  }
  void skip_line_end() { at_ += text_[at_] == '\r' ? 2 : 1; }

  /// The fields of the next line that is not empty; false at the end, and after an error.
  bool next_row(std::vector<TableCell>& cells) {
    cells.clear();
    while (at_ < text_.size() && line_end()) skip_line_end();
    if (at_ == text_.size()) return false;
    while (true) {
      TableCell cell;
      cell.range.begin = static_cast<std::uint32_t>(at_);
      if (!(at_ < text_.size() && text_[at_] == '"' ? quoted(cell) : plain(cell))) return false;
      cell.range.end = static_cast<std::uint32_t>(at_);
      cells.push_back(std::move(cell));
      if (at_ == text_.size()) return true;
      if (line_end()) {
        skip_line_end();
        return true;
      }
      ++at_;  // the comma
    }
  }

  bool plain(TableCell& cell) {
    const std::size_t begin = at_;
    while (at_ < text_.size() && text_[at_] != ',' && !line_end()) {
      if (text_[at_] == '"') {
        const auto here = static_cast<std::uint32_t>(at_);
        fail({here, here + 1}, "a quote inside a field without quotes",
             "put the whole field in quotes, and write each quote in it twice");
        return false;
      }
      ++at_;
    }
    cell.text = std::string(text_.substr(begin, at_ - begin));
    return true;
  }

  bool quoted(TableCell& cell) {
    const auto begin = static_cast<std::uint32_t>(at_++);
    while (true) {
      if (at_ == text_.size()) {
        fail({begin, begin + 1}, "this quote is never closed", "close the field with a quote");
        return false;
      }
      if (text_[at_] != '"') {
        cell.text += text_[at_++];
        continue;
      }
      ++at_;
      if (at_ < text_.size() && text_[at_] == '"') {
        cell.text += text_[at_++];
        continue;
      }
      if (at_ == text_.size() || text_[at_] == ',' || line_end()) return true;
      const auto here = static_cast<std::uint32_t>(at_);
      fail({here, here + 1}, "text after the quote that closes a field", "write a quote inside a field twice");
      return false;
    }
  }

  const std::shared_ptr<const lang::Source>& source_;
  std::string_view text_;
  lang::Diagnostics& diagnostics_;
  std::size_t at_ = 0;
  bool failed_ = false;
};

}  // namespace

std::vector<TableRow> read_csv_rows(const std::shared_ptr<const lang::Source>& source, lang::Diagnostics& diagnostics) {
  return CsvReader(source, diagnostics).read();
}

}  // namespace nms::cli
