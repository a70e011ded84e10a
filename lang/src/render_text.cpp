#include <algorithm>

#include <fmt/format.h>
#include <nms/lang/render.h>

namespace nms::lang {
namespace {

// A source line is shown whole up to this many columns; of a longer one, this many around the place.
constexpr std::size_t kMostColumns = 120;

struct Glyph {
  std::string_view bytes;   // as shown
  std::uint32_t begin = 0;  // in the line
  std::uint8_t width = 1;   // terminal columns
};

bool in(std::uint32_t c, std::uint32_t first, std::uint32_t last) { return c >= first && c <= last; }

std::uint8_t width_of(std::uint32_t c) {
  if (in(c, 0x300, 0x36F) || in(c, 0x483, 0x489) || in(c, 0x591, 0x5BD) || in(c, 0x610, 0x61A) || in(c, 0x64B, 0x65F) ||
      in(c, 0x1AB0, 0x1AFF) || in(c, 0x1DC0, 0x1DFF) || in(c, 0x200B, 0x200D) || in(c, 0x20D0, 0x20FF) ||
      in(c, 0xFE00, 0xFE0F) || in(c, 0xFE20, 0xFE2F))
    return 0;
  if (in(c, 0x1100, 0x115F) || in(c, 0x2E80, 0x303E) || in(c, 0x3041, 0xA4CF) || in(c, 0xAC00, 0xD7A3) ||
      in(c, 0xF900, 0xFAFF) || in(c, 0xFE30, 0xFE6F) || in(c, 0xFF00, 0xFF60) || in(c, 0xFFE0, 0xFFE6) ||
      in(c, 0x1F300, 0x1F64F) || in(c, 0x1F900, 0x1F9FF) || in(c, 0x20000, 0x3FFFD))
    return 2;
  return 1;
}

// What would move the cursor or turn the text round is shown as a replacement character.
bool is_control(std::uint32_t c) {
  return c < 32 || in(c, 0x7F, 0x9F) || in(c, 0x200E, 0x200F) || in(c, 0x2028, 0x202E) || in(c, 0x2066, 0x2069) ||
         c == 0xFEFF;
}

Glyph glyph_at(std::string_view line, std::uint32_t at) {
  constexpr std::string_view kReplacement = "\xEF\xBF\xBD";
  const auto byte = [&](std::size_t i) {
    return i < line.size() ? static_cast<std::uint32_t>(static_cast<unsigned char>(line[i])) : 0U;
  };
  const std::uint32_t first = byte(at);
  if (first == '\t') return {line.substr(at, 1), at, 1};
  if (first < 0x80) return is_control(first) ? Glyph{kReplacement, at, 1} : Glyph{line.substr(at, 1), at, 1};
  const std::size_t length = in(first, 0xC2, 0xDF) ? 2 : in(first, 0xE0, 0xEF) ? 3 : in(first, 0xF0, 0xF4) ? 4 : 0;
  std::uint32_t point = length == 2 ? first & 0x1FU : length == 3 ? first & 0x0FU : first & 0x07U;
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(at + i) & 0xC0U) != 0x80U) return {kReplacement, at, 1};
    point = point << 6U | (byte(at + i) & 0x3FU);
  }
  const bool overlong = (length == 3 && point < 0x800) || (length == 4 && point < 0x10000);
  if (length == 0 || overlong || in(point, 0xD800, 0xDFFF) || point > 0x10FFFF) return {kReplacement, at, 1};
  const std::string_view bytes = line.substr(at, length);
  // Its bytes still count as read, so that what follows is aligned.
  return is_control(point) ? Glyph{kReplacement, at, 1} : Glyph{bytes, at, width_of(point)};
}

std::uint32_t glyph_bytes(std::string_view line, const Glyph& g) {
  // A replaced character stands for one byte, or for the whole of a control character of several.
  const auto lead = static_cast<unsigned char>(line[g.begin]);
  if (g.bytes != "\xEF\xBF\xBD" || lead < 0x80)
    return g.bytes == "\xEF\xBF\xBD" ? 1 : static_cast<std::uint32_t>(g.bytes.size());
  std::uint32_t n = 1;
  while (n < 4 && g.begin + n < line.size() && (static_cast<unsigned char>(line[g.begin + n]) & 0xC0U) == 0x80U) ++n;
  return n;
}

struct Style {
  std::string_view bold, red, yellow, blue, cyan, off;
};
constexpr Style kPlain{"", "", "", "", "", ""};
constexpr Style kColors{"\x1b[1m", "\x1b[1;31m", "\x1b[1;33m", "\x1b[1;34m", "\x1b[1;36m", "\x1b[0m"};

// The line of `range`'s beginning and the place in it, underlined: `^~~~` for the first, `~~~` for a label.
void draw(std::string& out, const Source& source, Range range, std::size_t gutter, bool primary, std::string_view note,
          std::string_view color, const Style& style) {
  const Position place = source.position(range.begin);
  const std::string_view whole = source.line(place.line);
  const std::uint32_t from = std::min(place.column - 1, static_cast<std::uint32_t>(whole.size()));
  const std::uint32_t to = std::min(from + (range.end > range.begin ? range.end - range.begin : 0),
                                    static_cast<std::uint32_t>(whole.size()));
  // Far from the place a long line is not even looked at.
  constexpr std::uint32_t kReach = 4 * static_cast<std::uint32_t>(kMostColumns);
  std::uint32_t begin = from > kReach ? from - kReach : 0;
  while (begin > 0 && begin < from && (static_cast<unsigned char>(whole[begin]) & 0xC0U) == 0x80U) ++begin;
  std::vector<Glyph> glyphs;
  std::size_t columns = 0;
  std::size_t column_of_place = 0;
  for (std::uint32_t at = begin; at < whole.size() && at < from + kReach;) {
    const Glyph g = glyph_at(whole, at);
    if (at < from) column_of_place += g.width;
    columns += g.width;
    glyphs.push_back(g);
    at += glyph_bytes(whole, g);
  }
  const std::uint32_t seen_end = glyphs.empty() ? 0 : glyphs.back().begin + glyph_bytes(whole, glyphs.back());
  std::size_t first = 0;
  std::size_t last = glyphs.size();
  bool cut_before = begin > 0;
  bool cut_after = seen_end < whole.size();
  if (columns > kMostColumns || cut_before || cut_after) {
    constexpr std::size_t kBefore = kMostColumns / 2;
    std::size_t column = 0;
    while (first < glyphs.size() && column + kBefore < column_of_place) column += glyphs[first++].width;
    cut_before = cut_before || first > 0;
    std::size_t shown = 0;
    last = first;
    while (last < glyphs.size() && shown < kMostColumns) shown += glyphs[last++].width;
    cut_after = cut_after || last < glyphs.size();
  }
  fmt::format_to(std::back_inserter(out), "{}{:>{}} |{} ", style.blue, place.line, gutter, style.off);
  if (cut_before) out += "...";
  for (std::size_t i = first; i < last; ++i) out += glyphs[i].bytes;
  if (cut_after) out += "...";
  out += '\n';
  fmt::format_to(std::back_inserter(out), "{}{:>{}} |{} ", style.blue, "", gutter, style.off);
  if (cut_before) out += "   ";
  std::string mark;
  for (std::size_t i = first; i < last; ++i) {
    const Glyph& g = glyphs[i];
    if (g.begin < from)
      g.bytes == "\t" ? out += '\t' : out.append(g.width, ' ');
    else if (g.begin < to)
      g.bytes == "\t" ? mark += '\t' : mark.append(g.width, '~');
  }
  if (mark.empty()) mark = "~";
  if (primary && mark.front() == '~') mark.front() = '^';
  out += color;
  out += mark;
  if (!note.empty()) {
    out += ' ';
    out += note;
  }
  out += style.off;
  out += '\n';
}

std::size_t digits_of(std::uint32_t n) {
  std::size_t digits = 1;
  for (; n >= 10; n /= 10) ++digits;
  return digits;
}

// A path or message on one line of its own, without what would move the cursor.
void put_line(std::string& out, std::string_view text) {
  for (std::uint32_t at = 0; at < text.size();) {
    const Glyph g = glyph_at(text, at);
    out += g.bytes == "\t" ? std::string_view(" ") : g.bytes;
    at += glyph_bytes(text, g);
  }
}

void render(std::string& out, const Diagnostic& d, const Style& style) {
  const bool is_error = d.severity == Severity::error;
  out += style.bold;
  // What is said of a file as a whole has no text to show a place in.
  const bool has_text = d.source != nullptr && !d.source->text().empty();
  if (d.source != nullptr) {
    put_line(out, d.source->path());
    if (has_text) {
      const Position p = d.source->position(d.range.begin);
      fmt::format_to(std::back_inserter(out), ":{}:{}", p.line, p.column);
    }
    out += ": ";
  }
  const std::string_view color = is_error ? style.red : style.yellow;
  out += style.off;
  fmt::format_to(std::back_inserter(out), "{}{}{} {}: ", color, is_error ? "error" : "warning", style.off, d.kind);
  out += style.bold;
  put_line(out, d.message);
  out += style.off;
  out += '\n';
  if (has_text) {
    std::uint32_t most = d.source->position(d.range.begin).line;
    for (const Label& l : d.labels)
      if (l.source != nullptr) most = std::max(most, l.source->position(l.range.begin).line);
    const std::size_t gutter = std::max<std::size_t>(3, digits_of(most) + 1);
    draw(out, *d.source, d.range, gutter, true, "", color, style);
    const Source* last = d.source.get();
    for (const Label& l : d.labels) {
      if (l.source == nullptr) continue;
      if (l.source.get() != last) {
        const Position p = l.source->position(l.range.begin);
        out.append(gutter, ' ');
        out += "--> ";
        put_line(out, l.source->path());
        fmt::format_to(std::back_inserter(out), ":{}:{}\n", p.line, p.column);
        last = l.source.get();
      }
      draw(out, *l.source, l.range, gutter, false, l.text, style.blue, style);
    }
  }
  for (const std::string& help : d.helps) {
    fmt::format_to(std::back_inserter(out), "{}help:{} ", style.cyan, style.off);
    put_line(out, help);
    out += '\n';
  }
}

}  // namespace

std::string render_text(const Diagnostics& diagnostics, bool color) {
  std::string out;
  const Style& style = color ? kColors : kPlain;
  bool first = true;
  for (const Diagnostic& d : diagnostics.all()) {
    if (!first) out += '\n';
    first = false;
    render(out, d, style);
  }
  if (diagnostics.dropped() > 0)
    fmt::format_to(std::back_inserter(out), "\n{} more are not shown\n", diagnostics.dropped());
  return out;
}

}  // namespace nms::lang
