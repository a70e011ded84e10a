#include "overbar.h"

#include <algorithm>
#include <vector>

#include "tiers.h"

namespace nms::cli {
namespace {

/// A use over columns [first, last].
struct Bar {
  std::string label;
  std::size_t first = 0;
  std::size_t last = 0;
};

bool covers(const TierSpan& use, const TierSpan& sign) {
  if (use.start_ns == use.end_ns) return sign.start_ns <= use.start_ns && use.start_ns < sign.end_ns;
  return use.start_ns < sign.end_ns && sign.start_ns < use.end_ns;
}

/// Adds what has no column beneath it, in order of time.
void insert(std::vector<TierSpan>& columns, TierSpan span) {
  const auto after =
      std::find_if(columns.begin(), columns.end(), [&](const TierSpan& s) { return s.start_ns >= span.start_ns; });
  columns.insert(after, std::move(span));
}

/// The signs of one hand, those of the other that are signed alone, and a `-` for each use that no sign lies under.
std::vector<TierSpan> columns_of(const Tiers& tiers) {
  std::vector<TierSpan> columns;
  for (const TierSpan& s : tiers.signs)
    if (!tiers.two_handed() || s.hand == program::Hand::signing) columns.push_back(s);
  for (const TierSpan& s : tiers.signs) {
    if (!tiers.two_handed() || s.hand == program::Hand::signing) continue;
    if (std::none_of(columns.begin(), columns.end(), [&](const TierSpan& c) { return covers(s, c); }))
      insert(columns, {"", s.start_ns, s.end_ns, s.end_ns, s.hand});
  }
  for (const TierSpan& use : tiers.uses) {
    if (std::any_of(columns.begin(), columns.end(), [&](const TierSpan& s) { return covers(use, s); })) continue;
    // A use of no length still needs a column of its own.
    insert(columns, {"-", use.start_ns, use.end_ns, std::max(use.end_ns, use.start_ns + 1)});
  }
  return columns;
}

std::vector<Bar> bars_of(const std::vector<TierSpan>& uses, const std::vector<TierSpan>& columns) {
  std::vector<Bar> bars;
  for (const TierSpan& use : uses) {
    Bar bar{use.name, columns.size(), 0};
    for (std::size_t i = 0; i < columns.size(); ++i) {
      if (!covers(use, columns[i])) continue;
      bar.first = std::min(bar.first, i);
      bar.last = i;
    }
    if (bar.first != columns.size()) bars.push_back(std::move(bar));
  }
  return bars;
}

void pad_to(std::string& line, std::size_t& at, std::size_t column, char with) {
  for (; at < column; ++at) line += with;
}

}  // namespace

std::string overbar_text(const program::Program& program, const program::Clip& clip) {
  const Tiers tiers = read_tiers(program, clip);
  const std::vector<TierSpan> columns = columns_of(tiers);
  const std::vector<Bar> bars = bars_of(tiers.uses, columns);
  std::vector<TierSpan> beside;  // what the other hand signs
  for (const TierSpan& s : tiers.signs)
    if (tiers.two_handed() && s.hand == program::Hand::other) beside.push_back(s);
  const std::vector<Bar> others = bars_of(beside, columns);

  // Bars that end side by side need a wider gap than glosses do.
  std::vector<std::size_t> gap(columns.size() + 1, 1);
  std::vector<std::size_t> width;
  for (const TierSpan& c : columns) width.push_back(text_columns(c.name));
  for (const Bar& bar : bars) {
    if (bar.first != 0) gap[bar.first] = 2;
    if (bar.last + 1 < columns.size()) gap[bar.last + 1] = 2;
  }
  // A bar is at least its label and three strokes: its last column grows until it fits.
  const auto make_room = [&](const Bar& bar, std::size_t strokes) {
    std::size_t length = width[bar.first];
    for (std::size_t i = bar.first + 1; i <= bar.last; ++i) length += gap[i] + width[i];
    const std::size_t needed = text_columns(bar.label) + strokes;
    if (length < needed) width[bar.last] += needed - length;
  };
  for (const Bar& bar : bars) make_room(bar, 3);
  for (const Bar& other : others) make_room(other, 0);
  std::vector<std::size_t> begin(columns.size());
  std::size_t at = 0;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    begin[i] = at + gap[i];
    at = begin[i] + width[i];
  }

  std::vector<Stretch> stretches;
  for (const Bar& bar : bars)
    stretches.push_back({static_cast<double>(bar.first), static_cast<double>(bar.last) + 1.0});
  const std::vector<std::size_t> row = stack_by_nesting(stretches);
  std::string out;
  const std::size_t rows = row.empty() ? 0 : *std::max_element(row.begin(), row.end()) + 1;
  std::vector<std::vector<std::size_t>> in_row(rows);
  for (std::size_t i = 0; i < bars.size(); ++i) in_row[row[i]].push_back(i);
  for (std::size_t r = rows; r-- > 0;) {
    std::sort(in_row[r].begin(), in_row[r].end(),
              [&](std::size_t a, std::size_t b) { return bars[a].first < bars[b].first; });
    std::string line;
    at = 0;
    for (const std::size_t i : in_row[r]) {
      const std::size_t end = begin[bars[i].last] + width[bars[i].last];
      pad_to(line, at, begin[bars[i].first], ' ');
      pad_to(line, at, end - text_columns(bars[i].label), '_');
      line += bars[i].label;
      at = end;
    }
    out += line + '\n';
  }
  std::string line;
  at = 0;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (columns[i].name.empty()) continue;
    pad_to(line, at, begin[i], ' ');
    line += columns[i].name;
    at += text_columns(columns[i].name);
  }
  if (!line.empty()) out += line + '\n';
  // Below, what the other hand signs, as long as it is there: FIRST-----.
  line.clear();
  at = 0;
  for (const Bar& other : others) {
    pad_to(line, at, std::max(begin[other.first], line.empty() ? 0 : at + 1), ' ');
    line += other.label;
    at += text_columns(other.label);
    if (other.last != other.first) pad_to(line, at, begin[other.last] + width[other.last], '-');
  }
  if (!line.empty()) out += line + '\n';
  return out;
}

}  // namespace nms::cli
