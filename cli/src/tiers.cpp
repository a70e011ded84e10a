#include "tiers.h"

#include <algorithm>
#include <numeric>

namespace nms::cli {
namespace {

/// One character of UTF-8 and how many bytes it takes; U+FFFD and one byte where there is none.
struct Character {
  char32_t code = 0xFFFD;
  std::size_t bytes = 1;
};

Character decode(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char lead = byte(0);
  if (lead < 0x80) return {lead, 1};
  const std::size_t length = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : 2;
  if (lead < 0xC2 || lead > 0xF4 || text.size() < length) return {};
  char32_t code = lead & (0xFFU >> (length + 1));
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0U) != 0x80U) return {};
    code = (code << 6U) | (byte(i) & 0x3FU);
  }
  const bool overlong = (length == 3 && code < 0x800) || (length == 4 && code < 0x10000);
  if (overlong || code > 0x10FFFF || (code >= 0xD800 && code <= 0xDFFF)) return {};
  return {code, length};
}

/// The first that is open under this name: starts and ends pair in order.
void close(std::vector<TierSpan>& spans, std::vector<std::size_t>& open, std::string_view name,
           const program::Marker& end) {
  const auto it = std::find_if(open.begin(), open.end(),
                               [&](std::size_t i) { return spans[i].name == name && spans[i].hand == end.hand; });
  if (it == open.end()) return;
  spans[*it].end_ns = end.time_ns;
  spans[*it].stroke_end_ns = std::min(spans[*it].stroke_end_ns, end.time_ns);
  open.erase(it);
}

void order(std::vector<TierSpan>& spans) {
  std::stable_sort(spans.begin(), spans.end(), [](const TierSpan& a, const TierSpan& b) {
    return a.start_ns != b.start_ns ? a.start_ns < b.start_ns : a.end_ns > b.end_ns;
  });
}

}  // namespace

Tiers read_tiers(const program::Program& program, const program::Clip& clip) {
  Tiers tiers;
  std::vector<std::size_t> open_signs;
  std::vector<std::size_t> open_uses;
  for (const program::Marker& m : program.markers.subspan(clip.first_marker, clip.marker_count)) {
    const std::string name = printable(program.string(m.name));
    switch (m.kind) {
      case program::MarkerKind::sign_start:
        open_signs.push_back(tiers.signs.size());
        tiers.signs.push_back({name, m.time_ns, clip.end_ns, clip.end_ns, m.hand});
        break;
      case program::MarkerKind::stroke_end:
        for (const std::size_t i : open_signs)
          if (tiers.signs[i].name == name && tiers.signs[i].hand == m.hand &&
              tiers.signs[i].stroke_end_ns == clip.end_ns) {
            tiers.signs[i].stroke_end_ns = m.time_ns;
            break;
          }
        break;
      case program::MarkerKind::sign_end:
        close(tiers.signs, open_signs, name, m);
        break;
      case program::MarkerKind::use_start:
        open_uses.push_back(tiers.uses.size());
        tiers.uses.push_back({name, m.time_ns, clip.end_ns, clip.end_ns});
        break;
      case program::MarkerKind::use_end:
        close(tiers.uses, open_uses, name, m);
        break;
      default:
        break;
    }
  }
  order(tiers.signs);
  order(tiers.uses);
  return tiers;
}

bool Tiers::two_handed() const {
  const auto other = [](const TierSpan& s) { return s.hand == program::Hand::other; };
  return std::any_of(signs.begin(), signs.end(), other) && !std::all_of(signs.begin(), signs.end(), other);
}

std::vector<std::size_t> stack_by_nesting(const std::vector<Stretch>& stretches) {
  std::vector<std::size_t> inner_first(stretches.size());
  std::iota(inner_first.rbegin(), inner_first.rend(), std::size_t{0});
  std::stable_sort(inner_first.begin(), inner_first.end(), [&](std::size_t a, std::size_t b) {
    return stretches[a].end - stretches[a].begin < stretches[b].end - stretches[b].begin;
  });
  std::vector<std::size_t> row(stretches.size());
  for (std::size_t k = 0; k < inner_first.size(); ++k) {
    const Stretch& own = stretches[inner_first[k]];
    std::size_t lowest = 0;
    for (std::size_t j = 0; j < k; ++j) {
      const Stretch& other = stretches[inner_first[j]];
      if (other.begin < own.end && own.begin < other.end) lowest = std::max(lowest, row[inner_first[j]] + 1);
    }
    row[inner_first[k]] = lowest;
  }
  return row;
}

std::string printable(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    const Character c = decode(text);
    const bool bad = c.code < 0x20 || (c.code >= 0x7F && c.code < 0xA0) || c.code >= 0x110000 || c.code == 0xFFFD ||
                     c.code == 0xFFFE || c.code == 0xFFFF;
    if (bad)
      out += "\xEF\xBF\xBD";
    else
      out += text.substr(0, c.bytes);
    text.remove_prefix(c.bytes);
  }
  return out;
}

std::size_t text_columns(std::string_view text) {
  std::size_t columns = 0;
  while (!text.empty()) {
    const Character c = decode(text);
    text.remove_prefix(c.bytes);
    if ((c.code >= 0x300 && c.code < 0x370) || (c.code >= 0x200B && c.code < 0x2010)) continue;  // combining
    const bool wide = (c.code >= 0x1100 && c.code < 0x1160) || (c.code >= 0x2E80 && c.code < 0xA4D0) ||
                      (c.code >= 0xAC00 && c.code < 0xD7A4) || (c.code >= 0xF900 && c.code < 0xFB00) ||
                      (c.code >= 0xFF00 && c.code < 0xFF61) || c.code >= 0x1F300;
    columns += wide ? 2 : 1;
  }
  return columns;
}

}  // namespace nms::cli
