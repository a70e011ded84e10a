#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include <nms/program/records.h>

namespace nms::compiler {

/// An action unit as FACS coders write it: number, side, intensity letter.
struct ActionUnit {
  std::uint16_t number = 0;
  program::Side side = program::Side::none;
  double intensity = 1.0;  ///< letters A to E are equal fifths: 0.2, 0.4 ... 1; no letter is 1
};

/// Reads `AU12`, `AU14RC`, `AU20LB`, `LAU12`. Nothing for anything else.
[[nodiscard]] std::optional<ActionUnit> read_action_unit(std::string_view text);

}  // namespace nms::compiler
