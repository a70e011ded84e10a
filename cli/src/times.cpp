#include "times.h"

#include <fmt/format.h>

#include <nms/lang/quantity.h>

#include "report.h"

namespace nms::cli {
namespace {

std::optional<std::int64_t> read_time(std::string_view text) {
  const auto q = lang::read_quantity(text);
  if (q && q->unit == lang::Unit::time) return q->nanoseconds;
  // Of "0.5m" and "0.5u" an s would make milli- and microseconds.
  if (!q || q->unit != lang::Unit::none) return std::nullopt;
  const auto seconds = lang::read_quantity(std::string(text) + "s");
  if (seconds && seconds->unit == lang::Unit::time) return seconds->nanoseconds;
  return std::nullopt;
}

}  // namespace

std::vector<std::string_view> split_at_commas(std::string_view text) {
  std::vector<std::string_view> parts;
  while (true) {
    const std::size_t comma = text.find(',');
    std::string_view one = text.substr(0, comma);
    while (!one.empty() && one.front() == ' ') one.remove_prefix(1);
    while (!one.empty() && one.back() == ' ') one.remove_suffix(1);
    parts.push_back(one);
    if (comma == std::string_view::npos) return parts;
    text.remove_prefix(comma + 1);
  }
}

std::optional<std::vector<std::int64_t>> read_times(const std::string& text, lang::Diagnostics& diagnostics) {
  std::vector<std::int64_t> times;
  for (const std::string_view one : split_at_commas(text)) {
    const auto t = read_time(one);
    if (!t) {
      add_failure(diagnostics, {"bad_time", "--at", fmt::format("\"{}\" is not a time", one),
                                "write seconds, or a unit: --at 0.234,2106ms"});
      return std::nullopt;
    }
    times.push_back(*t);
  }
  return times;
}

}  // namespace nms::cli
