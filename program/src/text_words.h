#pragma once

#include <string_view>

/// What writer and reader of the text form agree on, letter by letter.
namespace nms::program {

inline constexpr std::string_view kTextHead = "nms program 1";

/// Letters of a name that needs no quotes.
[[nodiscard]] constexpr bool is_bare(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '.' ||
         c == '/' || c == '+' || c == '-';
}

}  // namespace nms::program
