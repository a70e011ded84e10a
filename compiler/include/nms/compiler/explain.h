#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nms/lang/diagnostic.h>
#include <nms/lang/source.h>
#include <nms/program/program.h>

#include <nms/compiler/time_table.h>

/// Why a channel has the value it has at a time: every cause, and how merging made one value of them.
namespace nms::compiler {

struct ExplainOptions {
  std::string clip;
  std::int64_t time_ns = 0;  ///< on the clip's own clock
  /// Times from outside, for marks and for signs.
  std::vector<TimeTable> times = {};
};

/// One cause of one channel's movement, as it is at the time asked for. Values are shares: AUs in [0, 1], axes in
/// [-1, 1], before merging.
struct Cause {
  enum class Movement : std::uint8_t { pose, steps, swing };
  enum class Phase : std::uint8_t {
    before,  ///< it has yet to begin
    onset,
    apex,
    offset,
    held,    ///< it stands, its span being over
    moving,  ///< of steps and swings: it is under way
    after,   ///< it is over
  };
  /// What became of it before the operators.
  enum class Fate : std::uint8_t {
    counted,
    repeated,  ///< left out: the same motion is asked for by another that outlasts it
    let_go,    ///< it was held, and goes since another comes
    joined,    ///< co-articulated: with its neighbour it goes from apex to apex
  };

  /// What a `combine` has let another entry take of it: `value` is what was left.
  struct Given {
    std::string to;  ///< the entry
    double taken = 0.0;
    std::shared_ptr<const lang::Source> source;
    lang::Range range;  ///< the rule, `head from neg`
  };

  std::shared_ptr<const lang::Source> source;
  lang::Range range;  ///< the component or step that moves it at the time
  std::string entry;  ///< the entry, or the expression; may be empty
  std::shared_ptr<const lang::Source> used_source;
  lang::Range used_range;  ///< where the utterance uses the entry; `used_source` is null where there is no such place
  std::string_view layer;  ///< "syntactic"
  bool stated = false;     ///< by the utterance itself
  Movement movement = Movement::pose;
  Phase phase = Phase::after;
  Fate fate = Fate::counted;
  std::vector<Given> given;  ///< in the order of the rules
  double value = 0.0;        ///< of its own curve
  double envelope = 0.0;     ///< how far it has come, 0 to 1; an envelope takes no part in a profile
  double peak = 0.0;         ///< the value of its own curve that is farthest from rest
  std::int64_t start_ns = 0;
  std::int64_t apex_ns = 0;     ///< of a pose
  std::int64_t release_ns = 0;  ///< of a pose
  std::int64_t end_ns = 0;
  std::int64_t span_start_ns = 0;  ///< of what it was placed over; it begins earlier by its lead
  std::int64_t span_end_ns = 0;

  /// It has a part in what happens at the time.
  [[nodiscard]] bool active() const { return phase != Phase::before && phase != Phase::after; }
};

/// One step of merging at the time.
struct MergeStep {
  enum class Kind : std::uint8_t {
    strongest,  ///< within a layer: the largest
    sum,        ///< within a layer: all of them
    latest,     ///< within a layer: the later to start takes the place of the earlier
    either,     ///< between layers of an action unit: 1 - prod(1 - v)
    add,        ///< between layers of an axis
    replace,    ///< what is stated takes the place of the rest: base (1 - envelope) + stated
    highest,    ///< between layers: the higher takes the place of those below: base (1 - envelope) + higher
    scale,      ///< of a layer: another takes some of it, its slot's first or an antagonist above: value (1 - envelope)
    hide,       ///< at last: what hides it takes some of it: value (1 - envelope)
  };
  struct Operand {
    double value = 0.0;
    std::size_t cause = 0;  ///< within a layer: index into causes (the first of those that were joined)
  };
  Kind kind = Kind::strongest;
  std::string_view name;  ///< within a layer: the layer, or "stated"; else empty
  std::vector<Operand> operands;
  double envelope = 1.0;  ///< of `replace`, `highest`, `scale` and `hide`
  double result = 0.0;    ///< of a layer after it was held within the channel's range; of others before
};

struct ChannelExplanation {
  std::uint32_t channel = 0;  ///< index into the program's channels
  std::vector<Cause> causes;  ///< as they are scheduled
  std::vector<MergeStep> steps;
};

struct Explanation {
  program::Draft program;
  std::vector<std::string> clips;            ///< the names of all clips
  bool found = false;                        ///< there is a clip of that name
  std::vector<ChannelExplanation> channels;  ///< those that the clip speaks of, in the program's order
};

/// Compiles sources as `compile` does, and keeps what merging did for one clip at one time.
/// @returns nothing if an error was reported; that there is no such clip is none
[[nodiscard]] std::optional<Explanation> explain(const std::vector<std::shared_ptr<const lang::Source>>& roots,
                                                 lang::SourceProvider& provider, lang::Diagnostics& diagnostics,
                                                 const ExplainOptions& options);

}  // namespace nms::compiler
