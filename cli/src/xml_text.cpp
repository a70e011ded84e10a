#include "xml_text.h"

#include <cstddef>

#include <fmt/format.h>

namespace nms::cli {
namespace {

/// Bytes of the UTF-8 sequence at the start of `text`; 0: it is none, or a character that XML does not have.
std::size_t xml_character(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(i < text.size() ? text[i] : 0); };
  const auto follows = [&](std::size_t i) { return (byte(i) & 0xC0U) == 0x80U; };
  const unsigned first = byte(0);
  if (first < 0x80) return first >= 0x20 || first == '\t' || first == '\n' || first == '\r' ? 1 : 0;
  if (first >= 0xC2 && first < 0xE0) return follows(1) ? 2 : 0;
  if (first >= 0xE0 && first < 0xF0) {
    if (!follows(1) || !follows(2)) return 0;
    const unsigned code = (first & 0x0FU) << 12U | (byte(1) & 0x3FU) << 6U | (byte(2) & 0x3FU);
    return code >= 0x800 && (code < 0xD800 || code > 0xDFFF) && code < 0xFFFE ? 3 : 0;
  }
  if (first >= 0xF0 && first < 0xF5) {
    if (!follows(1) || !follows(2) || !follows(3)) return 0;
    const unsigned top = (first & 0x07U) << 6U | (byte(1) & 0x3FU);
    return top >= 0x10 && top <= 0x10F ? 4 : 0;
  }
  return 0;
}

}  // namespace

std::string xml_escaped(std::string_view text) {
  std::string out;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t size = xml_character(text.substr(at));
    const char c = text[at];
    if (size == 0)
      out += '?';
    else if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (c == '"')
      out += "&quot;";
    else if (c == '\'')
      out += "&apos;";
    else if (c == '\n' || c == '\t' || c == '\r')  // in an attribute they would be read as blanks
      out += fmt::format("&#{};", static_cast<int>(c));
    else
      out += text.substr(at, size);
    at += size == 0 ? 1 : size;
  }
  return out;
}

}  // namespace nms::cli
