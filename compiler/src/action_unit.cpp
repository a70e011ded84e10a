#include "action_unit.h"

namespace nms::compiler {
namespace {

/// Side, digits, then side and letter in either order; each at most once.
std::optional<ActionUnit> read(std::string_view text) {
  ActionUnit unit;
  const auto side = [&unit](char c) {
    if (unit.side != program::Side::none || (c != 'L' && c != 'R')) return false;
    unit.side = c == 'L' ? program::Side::left : program::Side::right;
    return true;
  };
  std::size_t i = 0;
  if (i < text.size() && side(text[i])) ++i;
  const std::size_t first = i;
  std::uint32_t number = 0;
  while (i < text.size() && text[i] >= '0' && text[i] <= '9' && i - first < 4)
    number = number * 10 + static_cast<std::uint32_t>(text[i++] - '0');
  if (i == first || number == 0 || number > 999) return std::nullopt;
  unit.number = static_cast<std::uint16_t>(number);
  bool letter = false;
  for (; i < text.size(); ++i) {
    const char c = text[i];
    if (c >= 'A' && c <= 'E' && !letter) {
      unit.intensity = (c - 'A' + 1) / 5.0;
      letter = true;
    } else if (!side(c)) {
      return std::nullopt;
    }
  }
  return unit;
}

}  // namespace

std::optional<ActionUnit> read_action_unit(std::string_view text) {
  if (text.starts_with("AU")) return read(text.substr(2));
  if (text.size() > 3 && text.substr(1, 2) == "AU" && (text[0] == 'L' || text[0] == 'R')) {
    auto unit = read(text.substr(3));
    if (!unit || unit->side != program::Side::none) return std::nullopt;
    unit->side = text[0] == 'L' ? program::Side::left : program::Side::right;
    return unit;
  }
  return std::nullopt;
}

}  // namespace nms::compiler
