#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "action_unit.h"

namespace nms::compiler {

/// One unit of a FACS string.
struct FacsUnit {
  enum class Lip : std::uint8_t { both, upper, lower };
  std::string_view text;  ///< as it is written
  ActionUnit unit;
  Lip lip = Lip::both;    ///< T23 is of the upper lip alone, B23 of the lower one
  bool movement = false;  ///< M59: a movement code
};

/// A FACS string as it is read: the units that count, and those of the alternatives that do not.
struct FacsString {
  std::vector<FacsUnit> units;
  std::vector<FacsUnit> others;
  // What cannot be read, and why; nothing: all of it can.
  std::string_view bad;
  std::string_view reason;
};

/// Any intensity, `12*`: C, the middle of the five.
inline constexpr double kAnyIntensity = 0.6;

/// Reads what FACS coders write. `text` outlives the result. Linear in its length.
///
///   string      = combination { ("," | ";") [ "or" ] combination }      the first counts
///   combination = part { [ "+" ] part }
///   part        = choice | "(" choice { [ "+" ] choice } ")"            what stands in brackets is optional, and
///   counts choice      = unit { "/" letter | ("/" | "@" | "or") unit }          the first counts unit        = [ "AU" ]
///   [ side ] number [ side ] [ letter ] [ side ] [ "*" ]   letters and sides in either case side        = L | R | U
///   (one side, no matter which: read as the right) | in front alone: T, B (one lip), M
[[nodiscard]] FacsString read_facs_string(std::string_view text);

}  // namespace nms::compiler
