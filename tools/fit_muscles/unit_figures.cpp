#include "unit_figures.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include <fmt/format.h>
#include <glm/geometric.hpp>

namespace nms::fit_muscles {

using program::Failure;

namespace {

constexpr std::size_t kFields = 13;
constexpr double kLargest_mm = 200.0;

std::vector<std::string> fields_of(std::string_view line) {
  std::vector<std::string> fields;
  line = line.substr(0, line.find('#'));
  for (std::size_t at = 0; (at = line.find_first_not_of(" \t\r", at)) != std::string_view::npos;) {
    const std::size_t end = std::min(line.find_first_of(" \t\r", at), line.size());
    fields.emplace_back(line.substr(at, end - at));
    at = end;
  }
  return fields;
}

/// Reads a line's fields one after the other and remembers the first that is wrong.
class Line {
 public:
  explicit Line(std::vector<std::string> fields) : fields_(std::move(fields)) {}

  std::string word() { return fields_[at_++]; }

  std::optional<double> number_or_none(double low, double high) {
    if (fields_[at_] == "-") {
      ++at_;
      return std::nullopt;
    }
    return number(low, high);
  }

  double number(double low, double high) {
    const std::string& field = fields_[at_++];
    char* end = nullptr;
    const double value = std::strtod(field.c_str(), &end);
    const bool good = end == field.c_str() + field.size() && value >= low && value <= high;  // not for NaN
    if (!good && wrong.empty()) wrong = fmt::format("\"{}\" is not a number from {} to {}", field, low, high);
    return good ? value : low;
  }

  std::string wrong;

 private:
  std::vector<std::string> fields_;
  std::size_t at_ = 0;
};

UnitFigures read_line(Line& line) {
  UnitFigures f;
  f.unit = line.word();
  f.largest_mm = line.number(0.1, kLargest_mm);
  for (int axis = 0; axis < 3; ++axis) f.direction[axis] = line.number(-1.0, 1.0);
  f.near = line.word();
  f.reach_mm = line.number(1.0, kLargest_mm);
  if (const auto percent = line.number_or_none(0.1, 100.0)) f.area = *percent / 100.0;
  f.gap_mm = line.number_or_none(-kLargest_mm, kLargest_mm);
  if (const auto percent = line.number_or_none(-100.0, 100.0)) f.width = *percent / 100.0;
  if (const auto percent = line.number_or_none(0.0, 300.0)) f.opening = *percent / 100.0;
  if (const std::string still = line.word(); still != "-") {
    for (std::size_t at = 0; at <= still.size();) {
      const std::size_t end = std::min(still.find(',', at), still.size());
      f.still.push_back(still.substr(at, end - at));
      at = end + 1;
    }
  }
  const std::string kind = line.word();
  f.own = kind == "own";
  const double length = std::sqrt(glm::dot(f.direction, f.direction));
  if (length > 0.1) f.direction /= length;
  if (!line.wrong.empty()) return f;
  if (!f.own && kind != "measured") line.wrong = fmt::format("\"{}\" is neither measured nor own", kind);
  if (length <= 0.1) line.wrong = "the direction has no length";
  return f;
}

}  // namespace

tl::expected<std::vector<UnitFigures>, Failure> read_unit_figures(std::string_view text, std::string_view name) {
  std::vector<UnitFigures> all;
  std::size_t number = 0;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    std::vector<std::string> fields = fields_of(text.substr(at, end - at));
    at = end + 1;
    ++number;
    if (fields.empty()) continue;
    const std::string place = fmt::format("{}:{}", name, number);
    const std::string form =
        "unit, largest mm, x, y, z, landmark, reach mm, area %, gap mm, width %, opening %, still landmarks, measured "
        "or own";
    if (fields.size() != kFields) {
      return tl::unexpected(
          Failure{"figures_bad_line", place, fmt::format("it has {} fields and not {}", fields.size(), kFields), form});
    }
    Line line(std::move(fields));
    UnitFigures f = read_line(line);
    if (!line.wrong.empty()) return tl::unexpected(Failure{"figures_bad_line", place, line.wrong, form});
    if (std::any_of(all.begin(), all.end(), [&](const UnitFigures& o) { return o.unit == f.unit; })) {
      return tl::unexpected(Failure{"figures_twice", place, f.unit + " stands there already", "give one line a unit"});
    }
    all.push_back(std::move(f));
  }
  if (all.empty()) {
    return tl::unexpected(Failure{"figures_none", std::string(name), "it has no figures", "write one unit a line"});
  }
  return all;
}

}  // namespace nms::fit_muscles
