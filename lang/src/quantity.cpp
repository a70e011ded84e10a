#include <nms/lang/quantity.h>

#include <cmath>
#include <cstring>
#include <string>
#include <system_error>

#include <fast_float/fast_float.h>

namespace nms::lang {
namespace {

struct UnitRow {
  char text[4];
  Unit unit;
  int exponent;  // of ten, to the base unit
};
constexpr UnitRow kUnits[] = {
    {"", Unit::none, 0},     {"%", Unit::percent, -2}, {"s", Unit::time, 0},       {"ms", Unit::time, -3},
    {"us", Unit::time, -6},  {"deg", Unit::angle, 0},  {"Hz", Unit::frequency, 0}, {"x", Unit::count, 0},
    {"mm", Unit::length, 0}, {"cm", Unit::length, 1},
};

const UnitRow* find_unit(std::string_view text) {
  if (text.size() >= sizeof UnitRow::text) return nullptr;
  char padded[sizeof UnitRow::text] = {};
  for (std::size_t i = 0; i < text.size(); ++i) padded[i] = text[i];
  for (const UnitRow& u : kUnits)
    if (std::memcmp(u.text, padded, sizeof padded) == 0) return &u;
  return nullptr;
}

constexpr double kMost = 1e9;
constexpr std::int64_t kMostNanoseconds = 1'000'000'000'000'000;  // 1e6 s

constexpr double kTens[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                            1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

// Digits times ten to the exponent, rounded once.
double scaled(std::uint64_t digits, bool all_kept, std::string_view number, int decimals, int exponent) {
  const int power = exponent - decimals;
  // Both operands are exact, so that the one operation rounds correctly.
  if (all_kept && digits <= (std::uint64_t{1} << 53U) && power >= -22 && power <= 22) {
    const auto d = static_cast<double>(digits);
    return power < 0 ? d / kTens[-power] : d * kTens[power];
  }
  std::string text(number);
  text += 'e';
  text += std::to_string(exponent);
  double value = 0;
  const auto r = fast_float::from_chars(text.data(), text.data() + text.size(), value);
  return r.ec == std::errc() ? value : HUGE_VAL;
}

/// `60%`, the commonest by far, has a way of its own, with the same result.
std::optional<Quantity> short_percentage(std::string_view text) {
  constexpr std::size_t kMostDigits = 6;
  if (text.size() < 2 || text.size() > kMostDigits + 1 || text.back() != '%') return std::nullopt;
  std::uint32_t digits = 0;
  for (const char c : text.substr(0, text.size() - 1)) {
    const unsigned d = static_cast<unsigned char>(c) - unsigned{'0'};
    if (d > 9) return std::nullopt;
    digits = digits * 10 + d;
  }
  return Quantity{static_cast<double>(digits) / 100.0, Unit::percent, 0};
}

/// So has `2.4s`, as expressions say their lengths.
std::optional<Quantity> short_seconds(std::string_view text) {
  constexpr std::size_t kMostBytes = 7;
  if (text.size() < 2 || text.size() > kMostBytes || text.back() != 's') return std::nullopt;
  std::int64_t digits = 0;
  std::int64_t unit_ns = 1'000'000'000;
  std::size_t point = 0;  // none: it cannot come first
  for (std::size_t i = 0; i + 1 < text.size(); ++i) {
    if (text[i] == '.' && point == 0 && i != 0 && i + 2 < text.size()) {
      point = i;
      continue;
    }
    const unsigned d = static_cast<unsigned char>(text[i]) - unsigned{'0'};
    if (d > 9) return std::nullopt;
    digits = digits * 10 + d;
    if (point != 0) unit_ns /= 10;
  }
  const std::size_t decimals = point == 0 ? 0 : text.size() - 2 - point;
  return Quantity{static_cast<double>(digits) / kTens[decimals], Unit::time, digits * unit_ns};
}

}  // namespace

std::optional<Quantity> read_quantity(std::string_view text) {
  if (const auto percent = short_percentage(text)) return percent;
  if (const auto seconds = short_seconds(text)) return seconds;
  bool negative = false;
  if (!text.empty() && (text.front() == '-' || text.front() == '+')) {
    negative = text.front() == '-';
    text.remove_prefix(1);
  }
  std::size_t at = 0;
  std::uint64_t digits = 0;
  bool all_kept = true;
  int decimals = 0;
  bool point = false;
  const auto is_digit = [&](std::size_t i) { return i < text.size() && text[i] >= '0' && text[i] <= '9'; };
  if (!is_digit(0)) return std::nullopt;
  for (;; ++at) {
    if (is_digit(at)) {
      const auto d = static_cast<unsigned>(text[at] - '0');
      if (digits > (UINT64_MAX - 9) / 10)
        all_kept = false;
      else if (all_kept)
        digits = digits * 10 + d;
      if (point) ++decimals;
    } else if (at < text.size() && text[at] == '.' && !point && is_digit(at + 1)) {
      point = true;
    } else {
      break;
    }
  }
  const std::string_view number = text.substr(0, at);
  const std::string_view unit = text.substr(at);
  const UnitRow* const row = find_unit(unit);
  if (row == nullptr) return std::nullopt;

  Quantity q;
  q.unit = row->unit;
  q.value = scaled(digits, all_kept, number, decimals, row->exponent);
  if (!(q.value <= kMost)) return std::nullopt;
  if (row->unit == Unit::time) {
    // Whole nanoseconds from the decimal digits themselves: those before the cut, then half away from zero by the next.
    const int shift = 9 + row->exponent;
    std::int64_t ns = 0;
    int seen_decimals = 0;
    int round_digit = 0;
    bool after_point = false;
    bool rounded = false;
    for (const char c : number) {
      if (c == '.') {
        after_point = true;
        continue;
      }
      if (after_point && seen_decimals == shift) {
        round_digit = c - '0';
        rounded = true;
        break;
      }
      ns = ns * 10 + (c - '0');
      if (after_point) ++seen_decimals;
      if (ns > kMostNanoseconds) return std::nullopt;
    }
    for (; seen_decimals < shift; ++seen_decimals) {
      ns *= 10;
      if (ns > kMostNanoseconds) return std::nullopt;
    }
    if (rounded && round_digit >= 5) ++ns;
    if (ns > kMostNanoseconds) return std::nullopt;
    q.nanoseconds = negative ? -ns : ns;
  }
  if (negative) q.value = -q.value;
  return q;
}

std::string_view describe(Unit unit) {
  switch (unit) {
    case Unit::none:
      return "a plain number (0.5)";
    case Unit::percent:
      return "a share (60%)";
    case Unit::time:
      return "a time (250ms)";
    case Unit::angle:
      return "an angle (15deg)";
    case Unit::frequency:
      return "a frequency (2Hz)";
    case Unit::count:
      return "a count (3x)";
    case Unit::length:
      return "a length (8mm)";
  }
  return "";
}

}  // namespace nms::lang
