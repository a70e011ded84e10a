#pragma once

#include <cstdint>
#include <string>

#include <fmt/format.h>

namespace nms::cli {

/// Nanoseconds as decimal seconds, exactly, with no more digits than they need: 2340000000 is "2.34".
[[nodiscard]] inline std::string decimal_seconds(std::int64_t ns) {
  const std::uint64_t magnitude = ns < 0 ? 0U - static_cast<std::uint64_t>(ns) : static_cast<std::uint64_t>(ns);
  std::string text =
      fmt::format("{}{}.{:09}", ns < 0 ? "-" : "", magnitude / 1'000'000'000U, magnitude % 1'000'000'000U);
  while (text.back() == '0') text.pop_back();
  if (text.back() == '.') text.pop_back();
  return text;
}

}  // namespace nms::cli
