#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nms/program/program.h>

/// What changed in meaning between two programs: what a person sees, not where its numbers stand.
namespace nms::program {

/// Below these nothing has changed.
struct CompareTolerance {
  double value = 1e-3;               ///< of an action unit, or of an axis' full scale: 0.1 %
  std::int64_t time_ns = 1'000'000;  ///< 1 ms
};

/// What of a clip, of one of its channels, or of a channel as such is different.
enum class Property : std::uint8_t {
  // Of a clip:
  added,
  removed,
  renamed,  ///< `before_name` plays as it did under another name
  kind,     ///< utterance, entry ...: `before_name`, `after_name`
  start,    ///< [ns] on its own clock
  end,      ///< [ns]
  sign,     ///< a sign, or the use of an entry, named by `marker`: its times, or that it is there
  // Of a channel in a clip:
  channel_added,    ///< `after` is its peak
  channel_removed,  ///< `before` is its peak
  peak,             ///< the value farthest from rest [-1, 1]
  onset,            ///< it leaves rest [ns]
  apex,             ///< it is first within the tolerance of its peak [ns]
  release,          ///< it is last within the tolerance of its peak [ns]
  offset,           ///< it is back at rest [ns]
  swings,           ///< how often it goes away from rest and turns back, by more than 1 %
  course,           ///< all of the above are the same, and its values differ: `after` is the largest difference
  // Of a channel as such:
  full_scale,  ///< [rad] or [m]
  track,       ///< `before_name`, `after_name`
};

struct Difference {
  Property property = Property::added;
  std::string clip{};     ///< empty: of a channel as such
  std::string track{};    ///< of a channel
  std::string channel{};  ///< "AU4" where both sides changed alike, else "AU4L"; an axis' name
  std::string marker{};   ///< of `sign`: its name; the second of that name is "NAME (2)"
  MarkerKind marker_kind = MarkerKind::mark;
  bool has_before = true;  ///< of `sign`: it was there
  bool has_after = true;
  double before = 0.0;  ///< times in nanoseconds, which are exact; values and counts as they are
  double after = 0.0;
  std::string before_name{};
  std::string after_name{};
};

/// Every difference, in the order of the new program's clips (those that are gone last), then of its channels, then of
/// the list above; deterministic. Names of components, which mark phases, are no meaning; nor are places in sources,
/// muscles and landmarks.
/// Cost O(n log n) in knots and markers.
[[nodiscard]] std::vector<Difference> compare(const Program& before, const Program& after,
                                              const CompareTolerance& tolerance = {});

}  // namespace nms::program
