#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nms/program/records.h>

#include "curve.h"
#include "layer.h"
#include "movement.h"
#include "placement.h"

namespace nms::compiler {

/// One cause of movement: a use of an entry with all its components, or a placement that stands by itself.
struct DraftCause {
  std::string_view name;               ///< what the author calls it
  lang::NodeRef node;                  ///< where it is used or placed, for messages
  Span span;                           ///< what it is over, without lead and lag
  const Declaration* entry = nullptr;  ///< none of a placement
  std::uint32_t utterance = 0;         ///< which of a discourse's it stands in
};

/// One cause's movement of one channel: its curve in the clip's time.
struct Contribution {
  std::uint32_t channel = 0;
  Curve curve;
  Curve envelope;  ///< how far it takes the place of what lies under it, 0 to 1
  Layer layer = Layer::syntactic;
  bool stated = false;  ///< stated by the utterance itself: replaces what entries supply
  std::int64_t start_ns = 0;
  std::int64_t end_ns = 0;
  std::int64_t apex_ns = 0;        ///< of a pose: its onset ends here
  std::int64_t release_ns = 0;     ///< of a pose and of what is held: it goes, or would go, from here
  std::int64_t span_start_ns = 0;  ///< of what it was placed over, without leads and lags
  std::int64_t span_end_ns = 0;
  lang::NodeRef used;  ///< where an utterance uses the entry that it is of; none where there is no such place
  /// Whether it may be joined with its neighbours from apex to apex: what has given way is no longer what its apex
  /// says.
  [[nodiscard]] bool joins() const { return pose && gave_way == kUnreachable; }
  std::uint32_t gave_way = kUnreachable;  ///< index into the clip's givings: the last that took some of it
  Easing easing = Easing::smooth;
  bool pose = false;
  bool held = false;                    ///< no offset: it stands until another comes
  std::string_view motion;              ///< of an oscillation: its name; the same motion asked for twice is one
  std::uint32_t cause = kUnreachable;   ///< index into the clip's causes; kUnreachable: the clip has only one
  std::uint32_t marker = kUnreachable;  ///< of the pose's channel that its four phase markers show: the first of them
};

/// Moves all times of a contribution.
void shift_in_time(Contribution& c, std::int64_t by_ns);

/// Phases and shifts, as far as they are written. The nearest wins: component, then use, then entry, then track.
struct Timing {
  std::optional<std::int64_t> onset_ns, offset_ns, lead_ns, lag_ns;
  std::optional<std::int64_t> apex_ns;  ///< of a component at a point: how long it stays once it has come
  std::optional<Easing> easing;
  bool held = false;             ///< no offset: the value stands at the end of the clip
  std::optional<Curve> profile;  ///< factors over time, straight between its points

  /// What is not written here is taken from `farther`.
  [[nodiscard]] Timing over(const Timing& farther) const;
};

/// A marker before it is in a program.
struct DraftMarker {
  std::int64_t time_ns = 0;
  std::string name;
  program::MarkerKind kind = program::MarkerKind::mark;
  program::Hand hand = program::Hand::signing;
};

/// Where a segment came from, before it is in a program.
struct DraftSource {
  lang::NodeRef node;
  std::string_view entry;
};

/// What another entry has taken of a contribution.
struct Giving {
  lang::NodeRef rule;  ///< `head from neg`
  const Declaration* to = nullptr;
  Curve taken;                          ///< the share, 0 to 1
  std::uint32_t before = kUnreachable;  ///< index of the one before it, of the same contribution
};

/// One clip while it is made.
struct ClipDraft {
  std::string name;
  program::ClipKind kind = program::ClipKind::expression;
  std::int64_t start_ns = 0;
  std::int64_t end_ns = 0;
  std::vector<Contribution> contributions;
  std::vector<DraftCause> causes;
  std::vector<Giving> givings;
  std::vector<DraftMarker> markers;
  std::vector<DraftSource> sources;
  std::size_t counted = 0;  ///< contributions whose knots are counted
  std::size_t knots = 0;
  bool full = false;  ///< it has more than fits, and that has been said
};

/// What made the segment that a curve is in at a time (before it begins: its first). Null: nothing with a place.
[[nodiscard]] const DraftSource* source_at(const ClipDraft& clip, const Curve& curve, std::int64_t time_ns);

/// How long a movement lasts where it is placed.
enum class Extent : std::uint8_t {
  span,     ///< stated: it fills the span
  natural,  ///< its own length if it has one, from the span's start; else it fills the span
  point,    ///< at a point: its own length; a pose has one if it states its apex
};

/// One thing to be placed.
struct Placed {
  std::string_view name;  ///< what the author calls it, for markers and messages
  lang::NodeRef node;     ///< for messages
  Span span;
  Extent extent = Extent::span;
  bool fill = false;
  std::uint32_t cycles = 0;  ///< not 0: it plays so often in its span, once for each cycle of a sign
  Timing timing;
  Layer layer = Layer::syntactic;
  bool stated = false;
  std::string_view entry;  ///< of the lexicon, for the source map
  lang::NodeRef used;      ///< where an utterance uses that entry, for messages; none where it is played alone
  std::uint32_t cause = kUnreachable;  ///< index into the clip's causes
};

/// The cycles that are played of a count: a multiple of a half, and how long they take.
[[nodiscard]] double played_cycles(double count);
[[nodiscard]] std::int64_t length_of(const Oscillation& o);

/// Puts a movement into a clip. Reports what does not fit.
void schedule(ClipDraft& clip, const Movement& movement, const Placed& placed, const Scope& scope,
              Evaluator& evaluator);

/// A sequence from neutral at `start_ns`, each pose reached at its step's end; `rest` adds the way back to neutral
/// after the last step, with the tracks' own offsets (or `offset_ns`).
void play_sequence(ClipDraft& clip, const Sequence& sequence, std::int64_t start_ns, std::int64_t duration_ns,
                   bool rest, const Placed& placed, Evaluator& evaluator);

/// Whose properties are read: each has some that the others do not.
enum class PropertyOwner : std::uint8_t { component, use, entry, condition };

/// The options `{ onset 167ms lead 233ms }` of a component or a use, or the properties of an entry or a condition.
[[nodiscard]] Timing read_timing(lang::NodeRef parent, const Scope& scope, Evaluator& evaluator, PropertyOwner owner);

}  // namespace nms::compiler
