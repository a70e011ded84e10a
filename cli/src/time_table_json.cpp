#include <cstddef>
#include <iterator>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "time_table_rows.h"

namespace nms::cli {
namespace {

/// Bytes that know how many of them have been read, so that what is wrong has a place.
class CountedBytes {
 public:
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;

  CountedBytes(const char* at, const char** farthest) : at_(at), farthest_(farthest) {}
  reference operator*() const { return *at_; }
  CountedBytes& operator++() {
    *farthest_ = ++at_;
    return *this;
  }
  CountedBytes operator++(int) {
    CountedBytes old = *this;
    ++*this;
    return old;
  }
  bool operator==(const CountedBytes& other) const { return at_ == other.at_; }

 private:
  const char* at_;
  const char** farthest_;
};

/// Builds rows as the parser comes by their parts.
class RowBuilder {
 public:
  using number_integer_t = nlohmann::json::number_integer_t;
  using number_unsigned_t = nlohmann::json::number_unsigned_t;
  using number_float_t = nlohmann::json::number_float_t;
  using string_t = nlohmann::json::string_t;
  using binary_t = nlohmann::json::binary_t;

  RowBuilder(const std::shared_ptr<const lang::Source>& source, lang::Diagnostics& diagnostics)
      : source_(source), diagnostics_(diagnostics), farthest_(source->text().data()) {}

  [[nodiscard]] const char** farthest() { return &farthest_; }
  /// All rows that were read to their end.
  [[nodiscard]] std::vector<TableRow> rows() {
    if (depth_ > 1 && !rows_.empty()) rows_.pop_back();
    return std::move(rows_);
  }

  bool null() { return value({}); }
  bool boolean(bool v) { return value(v ? "true" : "false"); }
  bool number_integer(number_integer_t v) { return value(fmt::format("{}", v)); }
  bool number_unsigned(number_unsigned_t v) { return value(fmt::format("{}", v)); }
  bool number_float(number_float_t, const string_t& text) { return value(text); }
  bool string(string_t& text) { return value(std::move(text)); }
  bool binary(binary_t&) { return fail(); }

  bool start_array(std::size_t) {
    if (depth_ != 0) return fail();
    ++depth_;
    last_ = here();
    return true;
  }
  bool end_array() {
    --depth_;
    return true;
  }
  bool start_object(std::size_t) {
    if (depth_ != 1) return fail();
    if (rows_.size() == kMaxTableRows)
      return fail(fmt::format("the table has more than {} rows", kMaxTableRows), "split it into several tables");
    ++depth_;
    rows_.emplace_back();
    rows_.back().range.begin = here() - 1;
    last_ = here();
    return true;
  }
  bool end_object() {
    --depth_;
    rows_.back().range.end = here();
    last_ = here();
    return true;
  }
  bool key(string_t& name) {
    column_ = std::move(name);
    last_ = here();
    return true;
  }
  bool parse_error(std::size_t position, const std::string&, const nlohmann::json::exception& error) {
    const auto size = static_cast<std::uint32_t>(source_->text().size());
    const auto at = static_cast<std::uint32_t>(position == 0 ? 0 : position - 1);
    const std::uint32_t begin = at < size ? at : size;
    std::string_view why(error.what());  // "[json.exception.parse_error.101] parse error at line 1, column 2: WHY"
    if (const std::size_t colon = why.find(": "); colon != std::string_view::npos) why.remove_prefix(colon + 2);
    diagnostics_.report(source_, {begin, begin < size ? begin + 1 : begin},
                        TableSyntax{fmt::format("this is no JSON: {}", why), kShape});
    return false;
  }

 private:
  static constexpr const char* kShape =
      "a table is an array of objects: [{\"name\": \"beat\", \"time\": \"0.70s\", \"clip\": \"my_utterance\"}]";

  [[nodiscard]] std::uint32_t here() const { return static_cast<std::uint32_t>(farthest_ - source_->text().data()); }

  /// From the last thing read to here, without the blanks and the punctuation between.
  [[nodiscard]] lang::Range range() const {
    const std::string_view text = source_->text();
    std::uint32_t begin = last_;
    std::uint32_t end = here();
    constexpr std::string_view kBetween = " \t\r\n,:[]{}";
    while (begin < end && kBetween.find(text[begin]) != std::string_view::npos) ++begin;
    while (end > begin && kBetween.find(text[end - 1]) != std::string_view::npos) --end;  // after a number stands one
    return {begin, end};
  }

  bool value(std::string text) {
    if (depth_ != 2) return fail();
    const lang::Range at = range();
    last_ = here();
    if (!text.empty()) rows_.back().cells.push_back({column_, std::move(text), at, at});
    return true;
  }

  bool fail(std::string cause = "a table is one array of objects, and their fields are texts and numbers",
            std::string remedy = kShape) {
    lang::Range at = range();
    if (at.begin == at.end && at.end < source_->text().size()) ++at.end;
    diagnostics_.report(source_, at, TableSyntax{std::move(cause), std::move(remedy)});
    return false;
  }

  const std::shared_ptr<const lang::Source>& source_;
  lang::Diagnostics& diagnostics_;
  const char* farthest_;
  std::vector<TableRow> rows_;
  std::string column_;
  std::uint32_t last_ = 0;  ///< where the last thing ended
  int depth_ = 0;
};

}  // namespace

std::vector<TableRow> read_json_rows(const std::shared_ptr<const lang::Source>& source,
                                     lang::Diagnostics& diagnostics) {
  RowBuilder builder(source, diagnostics);
  const std::string_view text = source->text();
  const CountedBytes begin(text.data(), builder.farthest());
  const CountedBytes end(text.data() + text.size(), builder.farthest());
  nlohmann::json::sax_parse(begin, end, &builder);
  return builder.rows();
}

}  // namespace nms::cli
