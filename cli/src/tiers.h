#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <nms/program/program.h>

namespace nms::cli {

/// A sign, or the use of an entry, in a clip's time.
struct TierSpan {
  std::string name;  ///< fit to print: valid UTF-8 without control characters
  std::int64_t start_ns = 0;
  std::int64_t stroke_end_ns = 0;  ///< of a sign: the hold begins; else the end
  std::int64_t end_ns = 0;
  program::Hand hand = program::Hand::signing;
};

/// What a clip's markers say of signs and of entries used over them; both by their start, outer uses before inner.
struct Tiers {
  std::vector<TierSpan> signs;
  std::vector<TierSpan> uses;

  /// Whether both hands sign, so that a page needs a row for each.
  [[nodiscard]] bool two_handed() const;
};

[[nodiscard]] Tiers read_tiers(const program::Program& program, const program::Clip& clip);

/// A stretch of a row, in whatever unit.
struct Stretch {
  double begin = 0.0;
  double end = 0.0;
};

/// Overbar notation stacks by nesting: the row of each stretch, 0 the lowest; a longer stretch, and of equal ones the
/// earlier, stands above all that it overlaps.
[[nodiscard]] std::vector<std::size_t> stack_by_nesting(const std::vector<Stretch>& stretches);

/// Text of unknown origin made fit for a terminal and for XML: what is no character becomes U+FFFD.
[[nodiscard]] std::string printable(std::string_view text);

/// Columns that valid UTF-8 takes in a fixed-width font.
[[nodiscard]] std::size_t text_columns(std::string_view text);

}  // namespace nms::cli
