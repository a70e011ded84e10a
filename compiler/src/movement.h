#pragma once

#include <cassert>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string_view>
#include <tuple>
#include <unordered_set>
#include <utility>
#include <vector>

#include <nms/lang/quantity.h>

#include "channels.h"
#include "curve.h"
#include "declarations.h"
#include "facs_string.h"
#include "outside_times.h"
#include "places.h"
#include "pose_store.h"

namespace nms::compiler {

/// One step of a sequence: the face is in `pose` at the step's end.
struct Step {
  double share = -1.0;  ///< of the whole, or -1: it has a time of its own
  std::int64_t own_ns = -1;
  Pose pose;
  Easing easing = Easing::smooth;
  lang::NodeRef node;
  std::uint32_t file = 0;
};

/// Steps in sequence, and how long they take: -1 where only the placement can say.
struct Sequence {
  std::vector<Step> steps;
  std::int64_t duration_ns = -1;
  std::string_view name;
  bool mouthing = false;  ///< of a spoken word: it has a layer of its own, below a sign's gestures
};

/// `count` cycles of one axis at `rate_hz`, the first half cycle towards `by`, each cycle smaller by `decay`.
struct Oscillation {
  std::uint32_t channel = 0;
  double count = 1.0;
  double rate_hz = 1.0;
  double by = 0.0;     ///< share of full scale
  double decay = 0.0;  ///< share of the amplitude lost with each cycle
  std::string_view name;
};

/// What a sum of poses, expressions and motions comes to.
struct Movement {
  Pose pose;
  std::vector<Sequence> sequences;
  std::vector<Oscillation> oscillations;

  [[nodiscard]] bool still() const { return sequences.empty() && oscillations.empty(); }
};

/// A parameter's value: a quantity or a bare word.
struct Argument {
  std::string_view name;
  lang::Quantity quantity;
  std::string_view word;  ///< not empty: it is a word
};

/// What names mean at one place: parameters, and the file whose movements are seen.
struct Scope {
  std::uint32_t file = 0;
  std::vector<Argument> arguments;
  bool left_handed = false;        ///< of the signer: dominant( ) and contra( ) follow the hand
  const Places* places = nullptr;  ///< of the discourse, if any: `gaze NAME` goes there
};

/// Which rules there are that have to be tried when a pose is played, bits of one byte. Most poses have none.
class PoseRules {
 public:
  static constexpr std::uint8_t kCutOff = 1;  ///< an amount lies outside its channel's range
  static constexpr std::uint8_t kBrief = 2;   ///< a channel may not last long
  static constexpr std::uint8_t kHidden = 4;  ///< a channel may be hidden by another
  static constexpr std::uint8_t kHides = 8;   ///< a channel may hide another

  explicit PoseRules(const Channels& channels);
  /// Rules of a channel within its range.
  [[nodiscard]] std::uint8_t of(std::uint32_t channel) const { return by_channel_[channel]; }
  [[nodiscard]] std::uint8_t of(const Pose& pose, const Channels& channels) const;

 private:
  std::vector<std::uint8_t> by_channel_;
};

/// What a compilation is for.
enum class Product : std::uint8_t {
  program,      ///< a program: all curves are drawn
  diagnostics,  ///< to know what is wrong: nothing is drawn or kept that cannot be wrong
};

/// Turns sums into movements: names, arguments, units, sides. One for a compilation; keeps what it has worked out.
class Evaluator {
 public:
  Evaluator(const std::vector<LoadedFile>& files, const Declarations& declarations, const Channels& channels,
            OutsideTimes& outside, lang::Diagnostics& diagnostics, Product product = Product::program)
      : files_(files),
        declarations_(declarations),
        channels_(channels),
        outside_(outside),
        diagnostics_(diagnostics),
        product_(product),
        rules_(channels) {}

  /// A `sum` node. Nothing if anything in it is wrong; it has been reported then.
  [[nodiscard]] std::optional<Movement> sum(lang::NodeRef node, const Scope& scope);
  /// A movement's declaration with the scope its call made.
  [[nodiscard]] std::optional<Movement> declaration(const Declaration& d, const Scope& scope);
  /// Of an expression that was worked out for the sake of diagnostics alone: how many knots its clip has at most, 0 if
  /// it makes none. Nothing: it has to be drawn to say.
  [[nodiscard]] std::optional<std::size_t> most_knots(const Declaration& d) const;
  /// The steps of an expression, or of a motion in brackets.
  [[nodiscard]] std::optional<Sequence> sequence(lang::NodeRef parent, std::string_view name,
                                                 std::optional<std::int64_t> duration_ns, const Scope& scope);

  /// Arguments of a call (its `argument` children) matched to the parameters of a declaration: by name, by unit, in
  /// order; then defaults. `skip_first`: the first argument picked a variant. `degrees`: a degree's name is none of
  /// them.
  [[nodiscard]] std::optional<Scope> bind(lang::NodeRef call, bool skip_first, std::string_view callee,
                                          lang::NodeRef params, std::uint32_t params_file, const Scope& scope,
                                          bool degrees = false);
  /// A sum as arithmetic: `-1 * by`, `2 * count`, `60%`.
  [[nodiscard]] std::optional<Argument> arithmetic(lang::NodeRef sum, const Scope& scope);
  /// A quantity node of the unit wanted; anything else is reported.
  [[nodiscard]] std::optional<lang::Quantity> quantity(lang::NodeRef node, lang::Unit unit, const Scope& scope);

  /// A degree's factor. Nothing: it is no factor, which has been reported.
  std::optional<double> degree_of(const Declaration& d);
  /// The factor of an argument that is a degree's name, neg(slightly); nothing for any other.
  [[nodiscard]] std::optional<double> degree(lang::NodeRef argument, const Scope& scope);
  /// The factor of the degree that stands in front of something, slightly neg. Nothing: it is none, which is reported.
  [[nodiscard]] std::optional<double> degree_in_front(lang::NodeRef factor, const Scope& scope);

  /// The easing that a step's or component's options name.
  [[nodiscard]] std::optional<Easing> easing(lang::NodeRef value, const Scope& scope);

  /// Reports at a node. An entry used twice is worked out twice; what is wrong with it is said once.
  template <typename Kind>
  lang::Diagnostic& report(const Scope&, lang::NodeRef at, const Kind& kind) {
    if (!at) {  // what is not there did not parse, and that has been reported
      assert(diagnostics_.error_count() != 0);
      return repeated_;
    }
    if (!fresh(at, Kind::kKind)) {
      repeated_ = {};  // whoever adds to it adds to nothing
      return repeated_;
    }
    return diagnostics_.report(at.tree().source_pointer(), at.range(), kind);
  }

  /// Reports at a node what only the place of its use brings about: each such place gets its label.
  template <typename Kind>
  void report_in_use(const Scope& scope, lang::NodeRef at, lang::NodeRef use, const Kind& kind) {
    static_cast<void>(report(scope, at, kind));
    if (use) label_reported(at, Kind::kKind, {use.tree().source_pointer(), use.range(), "used here"});
  }

  /// Names like `word` among those that `names()` lists. After many errors none are looked for: whoever has a thousand
  /// misses a `use`, and each search walks all names.
  template <typename Names>
  [[nodiscard]] std::vector<std::string> similar(std::string_view word, Names names) const {
    constexpr std::size_t kMostSearches = 100;
    if (diagnostics_.error_count() >= kMostSearches) return {};
    return lang::nearest(word, names());
  }

  [[nodiscard]] const Channels& channels() const { return channels_; }
  [[nodiscard]] const Declarations& declarations() const { return declarations_; }
  [[nodiscard]] OutsideTimes& outside() { return outside_; }
  [[nodiscard]] lang::Diagnostics& diagnostics() { return diagnostics_; }
  [[nodiscard]] const std::vector<LoadedFile>& files() const { return files_; }

 private:
  friend class PlainMovements;
  /// A factor's number, and the unit it carries if it scales an axis (12deg AU51).
  struct Scale {
    double factor = 1.0;
    double absolute = 0.0;
    lang::Unit unit = lang::Unit::none;
    lang::NodeRef node;
  };

  [[nodiscard]] bool term(lang::NodeRef node, const Scope& scope, Movement& into);
  [[nodiscard]] bool multiply_by(lang::NodeRef factor, const Scope& scope, Scale& scale);
  [[nodiscard]] bool action_unit(lang::NodeRef token, const Scale& scale, const Scope& scope, Movement& into);
  [[nodiscard]] bool add_unit(std::string_view text, std::uint32_t number, program::Side side, double value,
                              const Scale& scale, lang::NodeRef at, const Scope& scope, Pose& into);
  [[nodiscard]] bool mouthing(lang::NodeRef node, const Scale& scale, const Scope& scope, Movement& into);
  [[nodiscard]] bool facs(lang::NodeRef node, const Scale& scale, const Scope& scope, Movement& into);
  [[nodiscard]] bool facs_unit(const FacsUnit& u, const Scale& scale, lang::NodeRef at, const Scope& scope,
                               Movement& into);
  [[nodiscard]] bool named(lang::NodeRef name, lang::NodeRef call, const Scale& scale, const Scope& scope,
                           Movement& into);
  /// `gaze j`: towards a place of the discourse, by the movement `gaze_towards`.
  [[nodiscard]] bool towards(lang::NodeRef name, lang::NodeRef call, const Place& place, const Scale& scale,
                             const Scope& scope, Movement& into);
  [[nodiscard]] bool oscillate(lang::NodeRef call, const Scale& scale, const Scope& scope, Movement& into);
  [[nodiscard]] bool take(Movement&& part, const Scale& scale, lang::NodeRef at, const Scope& scope, Movement& into);
  [[nodiscard]] std::optional<Movement> sum_within(lang::NodeRef node, const Scope& scope);
  /// What is known of a declaration that was worked out without arguments: it is worked out once.
  struct Known {
    enum class State : std::uint8_t {
      untried,
      wrong,
      plain,     ///< a pose that is right, and not kept
      pose,      ///< `at` is its number in poses_
      movement,  ///< `at` is its index in movements_
      checked,   ///< right, and not kept; its clip has at most `at` knots
    };
    State state = State::untried;
    std::uint8_t rules = 0;     ///< of a pose: which PoseRules speak of it
    std::uint16_t amounts = 0;  ///< of a pose: how many channels it moves
    std::uint32_t at = 0;

    [[nodiscard]] bool is_pose() const { return state == State::plain || state == State::pose; }
  };
  class Recall;
  /// Null for what is no declared movement.
  [[nodiscard]] Known* known(const Declaration& d, const Scope& scope);
  void keep(Known& known, const Declaration& d, const std::optional<Movement>& result);
  [[nodiscard]] std::optional<Movement> work_out(const Declaration& d, const Scope& scope, Known* known);
  [[nodiscard]] std::optional<std::uint32_t> most_knots(const Movement& expression) const;
  [[nodiscard]] bool scales_without_unit(const Scale& scale, const Scope& scope);
  [[nodiscard]] const Argument* argument(std::string_view name, const Scope& scope) const;
  [[nodiscard]] bool fresh(lang::NodeRef at, std::string_view kind);
  void label_reported(lang::NodeRef at, std::string_view kind, lang::Label label);
  /// Counts steps of work; false once a definition has taken more than any sensible one.
  [[nodiscard]] bool spend(lang::NodeRef at, const Scope& scope, std::size_t steps = 1) {
    spent_ += static_cast<std::uint32_t>(steps);
    spent_in_all_ += steps;
    return (spent_ <= kMaxWork && spent_in_all_ <= kMaxWorkInAll) || overspend(at, scope);
  }
  /// Says so, once; false.
  [[nodiscard]] bool overspend(lang::NodeRef at, const Scope& scope);
  /// Steps of work one declaration may take: calls with arguments can multiply, and must end.
  static constexpr std::uint32_t kMaxWork = 200'000;
  static constexpr std::uint64_t kMaxWorkInAll = 20'000'000;

  const std::vector<LoadedFile>& files_;
  const Declarations& declarations_;
  const Channels& channels_;
  OutsideTimes& outside_;
  lang::Diagnostics& diagnostics_;
  Product product_;
  PoseRules rules_;
  std::vector<Known> known_[2];  ///< of right- and of left-handed signers, by index in Declarations::movements
  PoseStore poses_;
  std::deque<Movement> movements_;
  std::unordered_set<std::uint64_t> too_heavy_;  ///< declarations that took too much work: reported, not tried again
  std::vector<lang::NodeRef> open_;              ///< declarations being worked out, to find circles
  /// What has been said of which node, and where it stands among the diagnostics.
  std::map<std::tuple<const lang::Tree*, std::uint32_t, std::string_view>, std::size_t> reported_;
  lang::Diagnostic repeated_;  ///< what `report` hands back for a thing already said
  std::uint32_t spent_ = 0;
  std::uint32_t depth_ = 0;  ///< sums open at once
  bool overspent_ = false;
  std::uint64_t spent_in_all_ = 0;
  bool overspent_in_all_ = false;
};

/// Most that amounts may add up to, in full scales. Anything near it is a slip; far above it numbers would overflow.
inline constexpr double kMaxAmount = 1e6;

/// Shares, counts and plain numbers: any of them may scale a thing.
[[nodiscard]] inline bool is_scalar(lang::Unit u) {
  return u == lang::Unit::none || u == lang::Unit::percent || u == lang::Unit::count;
}

}  // namespace nms::compiler
