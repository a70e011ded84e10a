#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <nms/lang/diagnostic.h>
#include <nms/lang/source.h>

/// Times that come from outside the sources: whoever moves the hands knows when.
namespace nms::compiler {

/// The time of a name, for `mark NAME`.
struct MarkTime {
  std::string name;
  std::string clip;  ///< the clip on whose clock it is; empty: any clip
  std::int64_t time_ns = 0;
  lang::Range range;  ///< where the table says so
};

/// The times of one sign of an utterance; they take the place of those in the source.
struct SignTiming {
  std::string clip;           ///< the utterance
  std::string sign;           ///< its gloss or alias; may be empty where `index` is given
  std::uint32_t index = 0;    ///< counts the signs of one hand from 1; 0: not given
  bool non_dominant = false;  ///< of `signs nd { }`
  std::int64_t start_ns = 0;
  std::int64_t stroke_end_ns = 0;
  std::int64_t end_ns = 0;  ///< with the hold; the same as stroke_end_ns without one
  lang::Range range;
};

/// One table, in any order. `source` is its text, for messages.
struct TimeTable {
  std::shared_ptr<const lang::Source> source;
  std::vector<MarkTime> marks;
  std::vector<SignTiming> signs;
};

}  // namespace nms::compiler
