#include "ambient.h"

#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>

#include <nms/compiler/diagnostic_kinds.h>
#include <nms/lang/diagnostic_kinds.h>

#include "curve_course.h"
#include "merge.h"

namespace nms::compiler {

using lang::NodeKind;
using lang::NodeRef;
using lang::Quantity;
using lang::Unit;

namespace {

/// Bounds of `every`: nothing on a face comes more often, and an hour times the resolution of a draw fits 64 bits.
constexpr std::int64_t kShortestNs = 200'000'000;
constexpr std::int64_t kLongestNs = 3'600'000'000'000;
/// So that intervals keep some length.
constexpr double kMostJitter = 0.9;
constexpr double kLargestSeed = 1e9;
constexpr std::int64_t kMostTimes = 50'000;
constexpr std::size_t kMostComponents = 100;

/// Numbers that are drawn: SplitMix64 (Steele, Lea & Flood 2014), begun with the FNV-1a hash of what they depend on.
class Draws {
 public:
  Draws(std::uint64_t seed, std::string_view clip, std::uint64_t component) {
    for (const char c : clip) hash(static_cast<unsigned char>(c));
    for (const std::uint64_t number : {seed, component})
      for (unsigned shift = 0; shift < 64; shift += 8) hash((number >> shift) & 0xFFU);
  }

  /// Of [-most, most], evenly, in steps of most / 2^19. `most` is at most kLongestNs.
  std::int64_t around(std::int64_t most) { return most * (2 * share() - kOne) / kOne; }
  /// Of [low, high).
  std::int64_t between(std::int64_t low, std::int64_t high) { return low + (high - low) * share() / kOne; }
  double between(double low, double high) {
    return low + (high - low) * static_cast<double>(share()) / static_cast<double>(kOne);
  }

 private:
  static constexpr unsigned kBits = 20;
  static constexpr std::int64_t kOne = std::int64_t{1} << kBits;

  void hash(std::uint64_t byte) { state_ = (state_ ^ byte) * 0x100000001B3U; }
  std::int64_t share() {
    std::uint64_t z = state_ += 0x9E3779B97F4A7C15U;
    z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9U;
    z = (z ^ (z >> 27U)) * 0x94D049BB133111EBU;
    return static_cast<std::int64_t>((z ^ (z >> 31U)) >> (64U - kBits));
  }

  std::uint64_t state_ = 0xCBF29CE484222325U;
};

/// Times in which a component may not be: what language does on one track, and how near is too near.
struct Guard {
  std::uint32_t track = 0;
  bool changes = false;  ///< only where the track moves; else wherever it is used
  std::int64_t apart_ns = 0;
};

/// One line of an ambient: what it repeats, and when.
struct Component {
  NodeRef node;
  Movement movement;
  bool fill = false;
  std::int64_t every_ns = 0;
  std::int64_t jitter_ns = 0;  ///< an interval is that much longer or shorter at most
  double smallest = 1.0, largest = 1.0;
  std::vector<Guard> guards;
};

/// Reads the components of an ambient with the values that its parameters have.
class ComponentReader {
 public:
  ComponentReader(const Scope& scope, Evaluator& evaluator) : scope_(scope), evaluator_(evaluator) {}

  std::optional<Component> read(NodeRef node) {
    const NodeRef sum = node.child(NodeKind::sum);
    if (node.has(lang::kFlagError) || !sum) return std::nullopt;
    auto movement = evaluator_.sum(sum, scope_);
    if (!movement) return std::nullopt;
    if (!repeatable(*movement)) {
      evaluator_.report(scope_, sum,
                        WrongKind{std::string(sum.text()), "nothing that an ambient could repeat", "a motion in steps",
                                  "an ambient repeats what comes and goes: (90ms: AU45; 200ms: 0% AU45)"});
      return std::nullopt;
    }
    Component out;
    out.node = node;
    out.movement = std::move(*movement);
    out.fill = static_cast<bool>(node.child(NodeKind::fill));
    good_ = true;
    jitter_ = 0.0;
    if (const NodeRef options = node.child(NodeKind::options))
      for (NodeRef p : options.children()) option(p, out);
    if (good_ && out.every_ns == 0) {
      evaluator_.report(scope_, node, MissingProperty{"every", "a component of an ambient"});
      good_ = false;
    }
    out.jitter_ns = static_cast<std::int64_t>(static_cast<double>(out.every_ns) * jitter_);
    if (!good_) return std::nullopt;
    return out;
  }

 private:
  static bool repeatable(const Movement& m) {
    return m.pose.empty() && m.oscillations.empty() && m.sequences.size() == 1 && !m.sequences.front().steps.empty();
  }

  void option(NodeRef p, Component& out) {
    if (!is_property(p)) {
      if (p.is(NodeKind::profile)) unknown(p, "profile");
      return;
    }
    const std::string_view name = p.at(0).text();
    if (name == "every") {
      if (const auto q = value(p, 1, 1, Unit::time, "a time (4s)"))
        out.every_ns = within(p.at(1), q->nanoseconds, kShortestNs, kLongestNs);
    } else if (name == "jitter") {
      if (const auto q = value(p, 1, 1, Unit::percent, "a share (50%)")) jitter_ = share(p.at(1), *q, kMostJitter);
    } else if (name == "size") {
      const auto smallest = value(p, 1, 2, Unit::percent, "two shares (60% 100%)");
      const auto largest = value(p, 2, 2, Unit::percent, "two shares (60% 100%)");
      if (!smallest || !largest) return;
      out.smallest = share(p.at(1), *smallest, 1.0);
      out.largest = share(p.at(2), *largest, 1.0);
    } else if (name == "free" || name == "still") {
      guard(p, name == "still", out);
    } else {
      unknown(p.at(0), name);
    }
  }

  /// `free lids 300ms`, `still gaze 100ms`.
  void guard(NodeRef p, bool changes, Component& out) {
    const auto q = value(p, 2, 2, Unit::time, "a track and a time (lids 300ms)");
    if (!q) return;
    const std::vector<TrackInfo>& tracks = evaluator_.channels().tracks;
    for (std::uint32_t i = 0; i < tracks.size(); ++i)
      if (tracks[i].name == p.at(1).text()) {
        for (const Guard& g : out.guards)
          if (g.track == i && g.changes == changes) {
            evaluator_.report(scope_, p, lang::DuplicateProperty{fmt::format("{} {}", p.at(0).text(), tracks[i].name)});
            good_ = false;
            return;
          }
        out.guards.push_back({i, changes, within(p.at(2), q->nanoseconds, 0, kLongestNs)});
        return;
      }
    const auto known = [&] {
      std::vector<std::string> names;
      for (const TrackInfo& t : tracks) names.push_back(t.name);
      return names;
    };
    evaluator_.report(scope_, p.at(1),
                      UnknownName{"track", std::string(p.at(1).text()), evaluator_.similar(p.at(1).text(), known)});
    good_ = false;
  }

  /// The quantity at `at`, of `last` values in all; a parameter stands for its own.
  std::optional<Quantity> value(NodeRef p, std::uint32_t at, std::uint32_t last, Unit unit, std::string_view expected) {
    const NodeRef node = p.at(at);
    const auto found = node && !p.at(last + 1) ? evaluator_.arithmetic(node, scope_) : std::nullopt;
    if (found && found->word.empty() && found->quantity.unit == unit) return found->quantity;
    if (good_)
      evaluator_.report(
          scope_, p,
          BadProperty{std::string(p.at(0).text()), node ? std::string(node.text()) : "nothing", std::string(expected)});
    good_ = false;
    return std::nullopt;
  }

  std::int64_t within(NodeRef at, std::int64_t ns, std::int64_t low, std::int64_t high) {
    if (ns >= low && ns <= high) return ns;
    out_of_range(at, fmt::format("{}ms to {}s", low / 1'000'000, high / 1'000'000'000));
    return low;
  }
  double share(NodeRef at, const Quantity& q, double most) {
    if (q.value >= 0.0 && q.value <= most) return q.value;
    out_of_range(at, fmt::format("0% to {:.4g}%", most * 100.0));
    return 0.0;
  }
  void out_of_range(NodeRef at, std::string range) {
    evaluator_.report(scope_, at, OutOfRange{std::string(at.text()), std::move(range)});
    good_ = false;
  }
  void unknown(NodeRef at, std::string_view name) {
    evaluator_.report(
        scope_, at,
        UnknownProperty{std::string(name), "a component of an ambient", {"every", "jitter", "size", "free", "still"}});
    good_ = false;
  }

  const Scope& scope_;
  Evaluator& evaluator_;
  double jitter_ = 0.0;
  bool good_ = true;
};

std::vector<Component> read_components(const Declaration& ambient, const Scope& scope, Evaluator& evaluator) {
  std::vector<Component> out;
  ComponentReader reader(scope, evaluator);
  for (NodeRef item : ambient.node.children()) {
    if (!item.is(NodeKind::placement)) continue;
    if (out.size() == kMostComponents) {
      evaluator.report(scope, item,
                       TooLarge{"the number of components of an ambient", fmt::format("{}", kMostComponents)});
      break;
    }
    if (auto component = reader.read(item)) out.push_back(std::move(*component));
  }
  return out;
}

/// `seed`: every ambient has one; where it declares none it is 0.
std::optional<std::uint64_t> read_seed(const Scope& scope, NodeRef at, Evaluator& evaluator) {
  for (const Argument& a : scope.arguments) {
    if (a.name != "seed") continue;
    const double seed = a.quantity.value;
    const bool whole =
        seed >= 0.0 && seed <= kLargestSeed && static_cast<double>(static_cast<std::int64_t>(seed)) == seed;
    if (a.word.empty() && a.quantity.unit == Unit::none && whole) return static_cast<std::uint64_t>(seed);
    evaluator.report(scope, at,
                     BadProperty{"seed", a.word.empty() ? fmt::format("{:.6g}", seed) : std::string(a.word),
                                 "a whole number from 0 to 1000000000"});
    return std::nullopt;
  }
  return 0;
}

/// Times that are taken, apart from each other and in order.
class Taken {
 public:
  void add(const Taken& other, std::int64_t margin_ns) {
    for (const TimeRange& r : other.ranges_) add(r.start_ns - margin_ns, r.end_ns + margin_ns);
  }
  void add(std::int64_t start_ns, std::int64_t end_ns) { ranges_.push_back({start_ns, end_ns}); }
  void settle() {
    std::sort(ranges_.begin(), ranges_.end(), [](const TimeRange& a, const TimeRange& b) {
      return a.start_ns != b.start_ns ? a.start_ns < b.start_ns : a.end_ns < b.end_ns;
    });
    std::size_t kept = 0;
    for (const TimeRange& r : ranges_)
      if (kept > 0 && r.start_ns <= ranges_[kept - 1].end_ns)
        ranges_[kept - 1].end_ns = std::max(ranges_[kept - 1].end_ns, r.end_ns);
      else
        ranges_[kept++] = r;
    ranges_.resize(kept);
  }
  [[nodiscard]] bool meets(std::int64_t start_ns, std::int64_t end_ns) const {
    const auto it = std::upper_bound(ranges_.begin(), ranges_.end(), start_ns,
                                     [](std::int64_t t, const TimeRange& r) { return t < r.end_ns; });
    return it != ranges_.end() && it->start_ns < end_ns;
  }

 private:
  std::vector<TimeRange> ranges_;
};

constexpr std::int64_t kBefore = std::numeric_limits<std::int64_t>::min() / 4;
constexpr std::int64_t kAfter = std::numeric_limits<std::int64_t>::max() / 4;

/// Where a curve moves, or is anywhere but at rest.
void add_course(const Curve& curve, bool changes, Taken& taken) {
  const std::vector<CurveKnot>& knots = curve.knots;
  if (knots.empty()) return;
  if (!changes && knots.front().value != 0.0) taken.add(kBefore, knots.front().time_ns);
  if (!changes && knots.back().value != 0.0) taken.add(knots.back().time_ns, kAfter);
  for (std::size_t i = 0; i + 1 < knots.size(); ++i) {
    const CurveKnot& k = knots[i];
    const double rest = changes ? k.value : 0.0;
    if (k.value != rest || k.b1 != rest || k.b2 != rest || knots[i + 1].value != rest)
      taken.add(k.time_ns, knots[i + 1].time_ns);
  }
}

/// What language takes of the tracks of one clip, worked out once for each.
class LanguageOnTracks {
 public:
  LanguageOnTracks(const ClipDraft& clip, const Channels& channels) : clip_(clip), channels_(channels) {}

  /// Read off what its contributions come to: poses that are joined leave no gap.
  const Taken& of(const Guard& guard) {
    const auto [known, added] = known_.try_emplace({guard.track, guard.changes});
    Taken& taken = known->second;
    if (!added) return taken;
    ClipDraft own;
    for (const Contribution& c : clip_.contributions) {
      if (channels_.channels[c.channel].track != guard.track || !(c.stated || linguistic(c.layer))) continue;
      own.contributions.push_back(c);
      // What is stated to be at rest is a use too.
      if (!guard.changes) taken.add(c.start_ns, c.held ? kAfter : c.end_ns);
    }
    for (const MergedCurve& m : merge(own, channels_)) add_course(m.curve, guard.changes, taken);
    taken.settle();
    return taken;
  }

 private:
  const ClipDraft& clip_;
  const Channels& channels_;
  std::map<std::pair<std::uint32_t, bool>, Taken> known_;
};

/// Puts one component into a clip.
class ComponentPlacement {
 public:
  ComponentPlacement(ClipDraft& clip, const Component& component, Placed placed, Draws draws,
                     LanguageOnTracks& language, const Scope& scope, Evaluator& evaluator)
      : clip_(clip),
        component_(component),
        placed_(std::move(placed)),
        draws_(draws),
        scope_(scope),
        evaluator_(evaluator) {
    placed_.node = component.node;
    placed_.extent = component.fill ? Extent::span : Extent::natural;
    for (const Guard& g : component.guards) taken_.add(language.of(g), g.apart_ns);
    taken_.settle();
  }

  void run() {
    if (component_.fill)
      fill();
    else
      repeat();
  }

 private:
  /// At intervals: the first after a part of one.
  void repeat() {
    const std::int64_t length = length_ns();
    std::int64_t at = draws_.between(std::int64_t{0}, component_.every_ns);
    while (at < clip_.end_ns && !clip_.full) {
      play(at, at + length);
      at += std::max(length, component_.every_ns + draws_.around(component_.jitter_ns));
    }
  }

  /// End to end from the clip's beginning to its end, as many as come nearest to their interval: none in less than two
  /// thirds of one, so that none is faster than that.
  void fill() {
    const std::int64_t whole = clip_.end_ns;
    if (whole < component_.every_ns / 3 * 2) return;
    const std::int64_t count = std::max<std::int64_t>(1, (whole + component_.every_ns / 2) / component_.every_ns);
    const std::int64_t each = whole / count;
    // Each border is moved by half the jitter at most, so that no part changes by more than all of it.
    const std::int64_t most = std::min(component_.jitter_ns, each) / 2;
    std::int64_t from = 0;
    for (std::int64_t i = 1; i <= count && !clip_.full; ++i) {
      const std::int64_t to = i == count ? whole : each * i + draws_.around(most);
      play(from, to);
      from = to;
    }
  }

  [[nodiscard]] std::int64_t length_ns() const {
    return std::max<std::int64_t>(component_.movement.sequences.front().duration_ns, 1);
  }

  /// Draws a size in any case: what is left out changes nothing later.
  void play(std::int64_t start_ns, std::int64_t end_ns) {
    const double size = draws_.between(component_.smallest, component_.largest);
    const std::size_t before = clip_.contributions.size();
    const std::size_t markers = clip_.markers.size();
    const std::size_t sources = clip_.sources.size();
    Movement movement = component_.movement;
    for (Step& step : movement.sequences.front().steps)
      for (Amount& a : step.pose) a.value *= size;
    placed_.span = {start_ns, end_ns, kUnreachable, kUnreachable};
    schedule(clip_, movement, placed_, scope_, evaluator_);
    clip_.markers.resize(markers);  // times that nobody asks for
    std::int64_t last = end_ns;     // a motion that does not end at rest goes on to it
    for (std::size_t i = before; i < clip_.contributions.size(); ++i)
      last = std::max(last, clip_.contributions[i].end_ns);
    if (taken_.meets(start_ns, last) || last > clip_.end_ns) {
      clip_.contributions.resize(before);
      clip_.sources.resize(sources);
      clip_.counted = std::min(clip_.counted, before);
    }
  }

  ClipDraft& clip_;
  const Component& component_;
  Placed placed_;
  Draws draws_;
  const Scope& scope_;
  Evaluator& evaluator_;
  Taken taken_;
};

void place(ClipDraft& clip, NodeRef use, const Scope& scope, Evaluator& evaluator) {
  const NodeRef name = use.at(0);
  if (use.has(lang::kFlagError) || !name) return;
  const Declaration* ambient = evaluator.declarations().find_ambient(name.text(), scope.file);
  if (ambient == nullptr) {
    const auto known = [&] { return evaluator.declarations().ambient_names(scope.file); };
    evaluator.report(scope, name,
                     UnknownName{"ambient", std::string(name.text()), evaluator.similar(name.text(), known)});
    return;
  }
  if (ambient->node.has(lang::kFlagError)) return;
  const auto inner =
      evaluator.bind(use, false, ambient->name, ambient->node.child(NodeKind::params), ambient->file, scope);
  if (!inner) return;
  const auto seed = read_seed(*inner, use, evaluator);
  if (!seed) return;
  Placed placed;
  placed.name = ambient->name;
  placed.layer = Layer::ambient;
  placed.entry = ambient->name;
  placed.used = use;
  LanguageOnTracks language(clip, evaluator.channels());
  std::uint64_t index = 0;
  for (const Component& c : read_components(*ambient, *inner, evaluator)) {
    if (!c.fill && c.movement.sequences.front().duration_ns < 0)
      evaluator.report(*inner, c.node, MissingDuration{std::string(c.node.child(NodeKind::sum).text())});
    else if (clip.end_ns / c.every_ns > kMostTimes)
      evaluator.report(*inner, c.node, TooLarge{"the number of times in one clip", fmt::format("{}", kMostTimes)});
    else if (!clip.full)
      ComponentPlacement(clip, c, placed, Draws(*seed, clip.name, index), language, *inner, evaluator).run();
    ++index;
  }
}

}  // namespace

void place_ambient(ClipDraft& clip, const std::vector<NodeRef>& blocks, const Scope& scope, Evaluator& evaluator) {
  NodeRef first;
  for (NodeRef block : blocks)
    for (NodeRef item : block.children()) {
      if (!item.is(NodeKind::ambience)) continue;
      if (!first) {
        first = item;
        place(clip, item, scope, evaluator);
        continue;
      }
      lang::Diagnostic& d = evaluator.report(scope, item, lang::DuplicateProperty{"ambient"});
      d.labels.push_back({first.tree().source_pointer(), first.range(), "first said here"});
    }
}

void check_ambient(const Declaration& ambient, Evaluator& evaluator) {
  if (ambient.node.has(lang::kFlagError)) return;
  Scope outer;
  outer.file = ambient.file;
  const NodeRef params = ambient.node.child(NodeKind::params);
  if (params)  // a parameter without a default has no value to try
    for (NodeRef p : params.children())
      if (p.is(NodeKind::param) && !p.at(1)) return;
  const auto scope = evaluator.bind({}, false, ambient.name, params, ambient.file, outer);
  if (!scope) return;
  static_cast<void>(read_seed(*scope, params ? params : ambient.node, evaluator));
  static_cast<void>(read_components(ambient, *scope, evaluator));
}

}  // namespace nms::compiler
