#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace nms::lang {

enum class Unit : std::uint8_t { none, percent, time, angle, frequency, count, length };

/// A number with its unit, in the base unit: percent -> share of 1, time -> seconds, angle -> degrees, frequency -> Hz,
/// count -> times, length -> millimetres.
struct Quantity {
  double value = 0.0;
  Unit unit = Unit::none;
  /// Times only: exact integer nanoseconds (2.34s is 2 340 000 000), rounded half away from zero below 1 ns.
  std::int64_t nanoseconds = 0;
};

/// Reads `60%`, `250ms`, `2.34s`, `15deg`, `2Hz`, `3x`, `8mm`, `1.5cm`, `10us`, `0.5`, with an optional sign.
/// Decimal digits are exact: no binary rounding comes between the text and the nanoseconds. Nothing for a malformed
/// number, an unknown unit, or a magnitude over 1e9 base units (1e6 s for times).
[[nodiscard]] std::optional<Quantity> read_quantity(std::string_view text);

/// What a person calls a unit: "a share (60%)", "a time (250ms)" ...
[[nodiscard]] std::string_view describe(Unit unit);

}  // namespace nms::lang
