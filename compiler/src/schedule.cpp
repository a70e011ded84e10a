#include "schedule.h"

#include <algorithm>

#include <fmt/format.h>

#include <nms/compiler/diagnostic_kinds.h>

#include "profile.h"

namespace nms::compiler {

using lang::NodeKind;
using lang::NodeRef;
using lang::Unit;

namespace {

constexpr std::size_t kMaxContributions = 400'000;
/// Knots of all contributions to one clip, before they are merged: some 200 MB.
constexpr std::size_t kMaxKnots = 2'000'000;
constexpr double kMaxCycles = 10'000.0;

std::string milliseconds(std::int64_t ns) { return fmt::format("{:.6g}ms", static_cast<double>(ns) / 1e6); }

std::int64_t rounded(double ns) { return static_cast<std::int64_t>(ns < 0.0 ? ns - 0.5 : ns + 0.5); }

std::uint32_t source_of(ClipDraft& clip, NodeRef node, std::string_view entry) {
  if (clip.sources.empty() || clip.sources.back().node != node || clip.sources.back().entry != entry)
    clip.sources.push_back({node, entry});
  return static_cast<std::uint32_t>(clip.sources.size() - 1);
}

/// 0 -> 1 -> 0 with the phases' easing; without the way back if it is held.
Curve trapezoid(std::int64_t t0, std::int64_t t1, std::int64_t t2, std::int64_t t3, double value, Easing easing,
                std::uint32_t source, bool held = false) {
  Curve c;
  ease_to(c, t0, 0.0, easing, source);
  ease_to(c, t1, value, easing, source);
  ease_to(c, t2, value, Easing::smooth, source);
  if (!held) ease_to(c, t3, 0.0, easing, source);
  return c;
}

/// Reports at a component what only the span of its use brings about.
template <typename Kind>
void report_in_use(const Scope& scope, const Placed& placed, Evaluator& evaluator, const Kind& kind) {
  evaluator.report_in_use(scope, placed.node, placed.used, kind);
}

bool room_left(ClipDraft& clip, const Placed& placed, const Scope& scope, Evaluator& evaluator) {
  for (; clip.counted < clip.contributions.size(); ++clip.counted)
    clip.knots += clip.contributions[clip.counted].curve.knots.size();
  if (clip.contributions.size() < kMaxContributions && clip.knots < kMaxKnots) return true;
  if (clip.full) return false;  // said once
  clip.full = true;
  if (clip.knots >= kMaxKnots)
    evaluator.report(scope, placed.node, TooLarge{"the number of knots in one clip", fmt::format("{}", kMaxKnots)});
  else
    evaluator.report(scope, placed.node,
                     TooLarge{"the number of contributions to one clip", fmt::format("{}", kMaxContributions)});
  return false;
}

void place_pose(ClipDraft& clip, const Pose& pose, const Placed& placed, const Scope& scope, Evaluator& evaluator) {
  const Timing& t = placed.timing;
  const std::int64_t begin = placed.span.start_ns - t.lead_ns.value_or(0);
  std::int64_t release = placed.span.end_ns + t.lag_ns.value_or(0);
  if (placed.extent == Extent::point) {  // all of it lets go together, an apex after the last has come
    std::int64_t onset = 0;
    for (const Amount& a : pose)
      onset = std::max(onset, t.onset_ns.value_or(evaluator.channels().track_of(a.channel).onset_ns));
    release = begin + onset + t.apex_ns.value_or(0) + t.lag_ns.value_or(0);
  }
  if (release <= begin) {
    evaluator.report(scope, placed.node, SpanTooShort{milliseconds(release - begin)});
    return;
  }
  const std::uint32_t source = source_of(clip, placed.node, placed.entry);
  std::int64_t marked_onset = -1;
  std::int64_t marked_offset = -1;
  std::int64_t wanted = 0;
  for (const Amount& a : pose) {
    const TrackInfo& track = evaluator.channels().track_of(a.channel);
    std::int64_t onset = t.onset_ns.value_or(track.onset_ns);
    std::int64_t offset = t.offset_ns.value_or(track.offset_ns);
    if (onset > release - begin) {
      // Too short for its phases: both shrink in proportion.
      wanted = std::max(wanted, onset);
      const double share = static_cast<double>(release - begin) / static_cast<double>(onset);
      onset = release - begin;
      offset = rounded(static_cast<double>(offset) * share);
    }
    Contribution c;
    c.channel = a.channel;
    const Easing easing = t.easing.value_or(Easing::smooth);
    if (t.held) offset = 0;
    c.curve = trapezoid(begin, begin + onset, release, release + offset, a.value, easing, source, t.held);
    c.envelope = trapezoid(begin, begin + onset, release, release + offset, 1.0, settled(easing), source, t.held);
    c.apex_ns = begin + onset;
    c.release_ns = release;
    c.easing = easing;
    c.pose = true;
    c.held = t.held;
    c.layer = placed.layer;
    c.stated = placed.stated;
    c.start_ns = begin;
    c.end_ns = release + offset;
    if (marked_onset < 0) {
      marked_onset = onset;
      marked_offset = offset;
      c.marker = static_cast<std::uint32_t>(clip.markers.size());
    }
    clip.contributions.push_back(std::move(c));
  }
  if (wanted > 0)
    report_in_use(scope, placed, evaluator,
                  PhasesShrunk{std::string(placed.name), milliseconds(wanted), milliseconds(release - begin)});
  if (marked_onset >= 0) {
    const std::string name(placed.name);
    clip.markers.push_back({begin, name, program::MarkerKind::onset});
    clip.markers.push_back({begin + marked_onset, name, program::MarkerKind::apex});
    if (t.held) return;
    clip.markers.push_back({release, name, program::MarkerKind::release});
    clip.markers.push_back({release + marked_offset, name, program::MarkerKind::offset});
  }
}

/// Cycles of a swing: quarter by quarter, each quarter of a sine in two cubics (largest error 0.1 % of the amplitude).
/// The first and the last quarter ease from and to rest. Values at an eighth of a turn and slopes there are those of
/// the sine itself: sin(pi/4) = cos(pi/4) = 0.70710678118654752; pi/8 = 0.39269908169872414 is half a quarter's arc.
void swing(Curve& out, const Oscillation& o, std::int64_t t0, std::int64_t t1, double cycles, std::uint32_t source) {
  constexpr double kRoot = 0.70710678118654752;
  constexpr double kArc = 0.39269908169872414;
  const int quarters = std::max(2, static_cast<int>(cycles * 4.0 + 0.5) / 2 * 2);
  const double span = static_cast<double>(t1 - t0);
  const auto at = [&](double quarter) { return t0 + rounded(span * quarter / quarters); };
  double amplitude = o.by;
  ease_to(out, t0, 0.0, Easing::smooth, source);
  const auto cubic_to = [&](std::int64_t time, double value, double slope0, double slope1) {
    CurveKnot& from = out.knots.back();
    if (time <= from.time_ns) return;
    from.b1 = from.value + slope0 / 3.0;
    from.b2 = value - slope1 / 3.0;
    from.source = source;
    out.knots.push_back({time, value, value, value, source});
  };
  for (int q = 0; q < quarters; ++q) {
    if (q > 0 && q % 4 == 0) amplitude *= 1.0 - o.decay;
    const bool negative = q % 4 >= 2;
    const double a = negative ? -amplitude : amplitude;
    if (q == 0) {
      ease_to(out, at(1), a, Easing::smooth, source);
    } else if (q == quarters - 1) {
      ease_to(out, t1, 0.0, Easing::smooth, source);
    } else if (q % 2 == 0) {  // from rest to the peak
      cubic_to(at(q + 0.5), a * kRoot, a * kArc, a * kRoot * kArc);
      cubic_to(at(q + 1), a, a * kRoot * kArc, 0.0);
    } else {  // from the peak to rest
      cubic_to(at(q + 0.5), a * kRoot, 0.0, -a * kRoot * kArc);
      cubic_to(at(q + 1), 0.0, -a * kRoot * kArc, -a * kArc);
    }
  }
}

void place_oscillation(ClipDraft& clip, const Oscillation& o, const Placed& placed, const Scope& scope,
                       Evaluator& evaluator) {
  const std::int64_t begin = placed.span.start_ns - placed.timing.lead_ns.value_or(0);
  double cycles = played_cycles(o.count);
  std::int64_t end = begin + length_of(o);
  if (cycles != o.count && !placed.fill)
    report_in_use(
        scope, placed, evaluator,
        CyclesRounded{std::string(placed.name), fmt::format("{:.6g}x", o.count), fmt::format("{:.6g}x", cycles)});
  if (placed.cycles != 0) {
    end = placed.span.end_ns + placed.timing.lag_ns.value_or(0);
    cycles *= placed.cycles;
    if (end <= begin) {
      evaluator.report(scope, placed.node, SpanTooShort{milliseconds(end - begin)});
      return;
    }
    if (cycles > kMaxCycles) {
      evaluator.report(scope, placed.node, TooLarge{"the number of cycles", fmt::format("{}", kMaxCycles)});
      return;
    }
  } else if (placed.fill) {
    end = placed.span.end_ns + placed.timing.lag_ns.value_or(0);
    if (end <= begin) {
      evaluator.report(scope, placed.node, SpanTooShort{milliseconds(end - begin)});
      return;
    }
    const double length = static_cast<double>(end - begin) / 1e9;
    cycles = static_cast<double>(static_cast<std::int64_t>(length * o.rate_hz + 0.5));
    if (cycles < 1.0) cycles = 1.0;
    if (cycles > kMaxCycles) {
      evaluator.report(scope, placed.node, TooLarge{"the number of cycles", fmt::format("{}", kMaxCycles)});
      return;
    }
    const double rate = cycles / length;
    if (rate > 1.2 * o.rate_hz || rate < 0.8 * o.rate_hz)
      report_in_use(
          scope, placed, evaluator,
          RateChanged{std::string(placed.name), fmt::format("{:.6g}Hz", o.rate_hz), fmt::format("{:.4g}Hz", rate)});
  }
  const std::uint32_t source = source_of(clip, placed.node, placed.entry);
  Contribution c;
  c.channel = o.channel;
  swing(c.curve, o, begin, end, cycles, source);
  const std::int64_t ramp = (end - begin) / (static_cast<std::int64_t>(cycles * 4.0) + 1);
  c.envelope = trapezoid(begin, begin + ramp, end - ramp, end, 1.0, Easing::smooth, source);
  c.layer = placed.layer;
  c.stated = placed.stated;
  c.start_ns = begin;
  c.end_ns = end;
  c.motion = o.name;
  clip.contributions.push_back(std::move(c));
  clip.markers.push_back({begin, std::string(placed.name), program::MarkerKind::onset});
  clip.markers.push_back({end, std::string(placed.name), program::MarkerKind::offset});
}

void place_sequence(ClipDraft& clip, const Sequence& s, const Placed& asked, const Scope& scope,
                    Evaluator& evaluator) {
  if (s.steps.empty()) return;
  Placed placed = asked;
  if (s.mouthing) {  // it yields to what a sign's own mouth does, wherever it is asked for
    placed.layer = Layer::mouthing;
    placed.stated = false;
  }
  const std::int64_t begin = placed.span.start_ns - placed.timing.lead_ns.value_or(0);
  const std::int64_t span_end = placed.span.end_ns + placed.timing.lag_ns.value_or(0);
  std::int64_t duration = s.duration_ns;
  int repeats = 1;
  if (placed.extent == Extent::span || (placed.extent == Extent::natural && duration < 0) || placed.fill ||
      placed.cycles != 0) {
    if (span_end <= begin) {
      evaluator.report(scope, placed.node, SpanTooShort{milliseconds(span_end - begin)});
      return;
    }
    if (placed.cycles != 0) {
      repeats = static_cast<int>(placed.cycles);
    } else if (placed.fill && duration > 0) {
      const double wanted = static_cast<double>(span_end - begin) / static_cast<double>(duration);
      repeats = std::max(1, static_cast<int>(std::min(wanted, kMaxCycles) + 0.5));
      const double change = wanted / repeats;
      if (change > 1.25 || change < 1.0 / 1.2)
        report_in_use(
            scope, placed, evaluator,
            RateChanged{std::string(placed.name), fmt::format("{:.4g}Hz", 1e9 / static_cast<double>(duration)),
                        fmt::format("{:.4g}Hz", 1e9 * repeats / static_cast<double>(span_end - begin))});
    }
    duration = (span_end - begin) / repeats;
  }
  if (duration < 0) {
    evaluator.report(scope, placed.node, MissingDuration{std::string(placed.name)});
    return;
  }
  for (int i = 0; i < repeats; ++i) {
    if (!room_left(clip, placed, scope, evaluator)) return;
    play_sequence(clip, s, begin + i * duration, duration, !(placed.timing.held && i + 1 == repeats), placed,
                  evaluator);
  }
  clip.markers.push_back({begin, std::string(placed.name), program::MarkerKind::onset});
  clip.markers.push_back({begin + repeats * duration, std::string(placed.name), program::MarkerKind::release});
}

}  // namespace

double played_cycles(double count) {
  return std::max(0.5, static_cast<double>(static_cast<std::int64_t>(count * 2.0 + 0.5)) / 2.0);
}

std::int64_t length_of(const Oscillation& o) { return rounded(played_cycles(o.count) / o.rate_hz * 1e9); }

const DraftSource* source_at(const ClipDraft& clip, const Curve& curve, std::int64_t time_ns) {
  const CurveKnot* knot = nullptr;
  for (const CurveKnot& k : curve.knots)
    if (k.source < clip.sources.size() && (knot == nullptr || k.time_ns <= time_ns)) knot = &k;
  return knot == nullptr ? nullptr : &clip.sources[knot->source];
}

void shift_in_time(Contribution& c, std::int64_t by_ns) {
  for (Curve* curve : {&c.curve, &c.envelope})
    for (CurveKnot& k : curve->knots) k.time_ns += by_ns;
  for (std::int64_t* time : {&c.start_ns, &c.end_ns, &c.apex_ns, &c.release_ns, &c.span_start_ns, &c.span_end_ns})
    *time += by_ns;
}

Timing Timing::over(const Timing& farther) const {
  Timing t = *this;
  if (!t.onset_ns) t.onset_ns = farther.onset_ns;
  if (!t.offset_ns) t.offset_ns = farther.offset_ns;
  if (!t.lead_ns) t.lead_ns = farther.lead_ns;
  if (!t.lag_ns) t.lag_ns = farther.lag_ns;
  if (!t.easing) t.easing = farther.easing;
  t.held = t.held || farther.held;
  if (!t.profile) t.profile = farther.profile;
  return t;
}

BadProperty misplaced_apex(std::string_view where) {
  return {"apex", std::string(where), "a pose `at` a point without `for`: elsewhere the span says how long"};
}

Timing read_timing(NodeRef parent, const Scope& scope, Evaluator& evaluator, PropertyOwner owner) {
  Timing t;
  if (!parent) return t;
  for (NodeRef p : parent.children()) {
    if (!is_property(p)) continue;
    const std::string_view name = p.at(0).text();
    const NodeRef value = p.at(1);
    std::optional<std::int64_t>* slot = name == "onset"    ? &t.onset_ns
                                        : name == "offset" ? &t.offset_ns
                                        : name == "lead"   ? &t.lead_ns
                                        : name == "lag"    ? &t.lag_ns
                                        : name == "apex"   ? &t.apex_ns
                                                           : nullptr;
    if (slot != nullptr) {
      if (!value || !value.is(NodeKind::quantity)) {
        evaluator.report(
            scope, p, BadProperty{std::string(name), value ? std::string(value.text()) : "nothing", "a time (250ms)"});
        continue;
      }
      const auto q = evaluator.quantity(value, Unit::time, scope);
      if (!q) continue;
      if (name == "apex" && owner != PropertyOwner::component) {
        evaluator.report(
            scope, p, misplaced_apex(owner == PropertyOwner::use ? "by the use of an entry" : "for all of an entry"));
        continue;
      }
      if ((name == "onset" || name == "offset" || name == "apex") && q->nanoseconds < 0) {
        evaluator.report(scope, value, OutOfRange{std::string(value.text()), "0s and above"});
        continue;
      }
      *slot = q->nanoseconds;
    } else if (name == "easing") {
      t.easing = evaluator.easing(value, scope);
    } else if (name == "held") {
      if (value) evaluator.report(scope, p, BadProperty{"held", std::string(value.text()), "no value"});
      t.held = true;
    } else if (owner == PropertyOwner::use) {
      if (name == "choose" || name == "optional") continue;  // read with the entry's choices
      evaluator.report(
          scope, p.at(0),
          UnknownProperty{std::string(name),
                          "the use of an entry",
                          {"onset", "offset", "lead", "lag", "easing", "profile", "held", "choose", "optional"}});
    } else if (owner != PropertyOwner::entry) {
      evaluator.report(scope, p.at(0),
                       UnknownProperty{std::string(name),
                                       owner == PropertyOwner::condition ? "a condition" : "a component",
                                       {"onset", "apex", "offset", "lead", "lag", "easing", "profile", "held"}});
    }
  }
  return t;
}

void play_sequence(ClipDraft& clip, const Sequence& sequence, std::int64_t start_ns, std::int64_t duration_ns,
                   bool rest, const Placed& placed, Evaluator& evaluator) {
  std::vector<std::uint32_t> channels;
  for (const Step& step : sequence.steps)
    for (const Amount& a : step.pose) channels.push_back(a.channel);
  std::sort(channels.begin(), channels.end());
  channels.erase(std::unique(channels.begin(), channels.end()), channels.end());

  // The face is in pose P_i at the end of step i (Barker 2005, 4.5.1). Ends are summed as shares of the whole before
  // they are rounded, so that 10 % + 80 % of 2.34 s is 2.106 s.
  const double natural = static_cast<double>(sequence.duration_ns < 0 ? duration_ns : sequence.duration_ns);
  std::vector<std::int64_t> end(sequence.steps.size());
  double share = 0.0;
  std::int64_t own = 0;
  for (std::size_t i = 0; i < sequence.steps.size(); ++i) {
    const Step& step = sequence.steps[i];
    if (step.share >= 0.0)
      share += step.share;
    else
      own += step.own_ns;
    const double at = natural == 0.0
                          ? 0.0
                          : (static_cast<double>(own) + share * natural) * (static_cast<double>(duration_ns) / natural);
    end[i] = start_ns + std::min(rounded(at), duration_ns);  // own times may be a nanosecond longer than the whole
  }
  if (!end.empty()) end.back() = start_ns + duration_ns;

  const std::size_t n = sequence.steps.size();
  std::vector<std::uint32_t> sources(n);
  for (std::size_t i = 0; i < n; ++i)
    sources[i] = source_of(clip, sequence.steps[i].node, placed.entry.empty() ? sequence.name : placed.entry);
  for (const std::uint32_t channel : channels) {
    Contribution c;
    c.channel = channel;
    const TrackInfo& track = evaluator.channels().tracks[evaluator.channels().channels[channel].track];
    ease_to(c.curve, start_ns, 0.0, Easing::smooth, sources[0]);
    double value = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      const Pose& pose = sequence.steps[i].pose;
      const auto it = std::find_if(pose.begin(), pose.end(), [&](const Amount& a) { return a.channel == channel; });
      value = it == pose.end() ? 0.0 : it->value;
      ease_to(c.curve, end[i], value, sequence.steps[i].easing, sources[i]);
    }
    std::int64_t last = start_ns + duration_ns;
    if (rest && value != 0.0) {
      last += placed.timing.offset_ns.value_or(track.offset_ns);
      ease_to(c.curve, last, 0.0, Easing::smooth, sources[n - 1]);
    }
    const std::int64_t ramp = std::min(track.onset_ns, (last - start_ns) / 4);
    c.held = placed.timing.held && !rest;
    c.release_ns = last;
    c.envelope = trapezoid(start_ns, start_ns + ramp, last - ramp, last, 1.0, Easing::smooth, sources[0], c.held);
    c.layer = placed.layer;
    c.stated = placed.stated;
    c.start_ns = start_ns;
    c.end_ns = last;
    clip.contributions.push_back(std::move(c));
  }
}

void schedule(ClipDraft& clip, const Movement& movement, const Placed& placed, const Scope& scope,
              Evaluator& evaluator) {
  if (!room_left(clip, placed, scope, evaluator)) return;
  const std::size_t first = clip.contributions.size();
  if (placed.timing.apex_ns && (placed.extent != Extent::point || movement.pose.empty()))
    evaluator.report(scope, placed.node, misplaced_apex(movement.pose.empty() ? "to a motion" : "over a span"));
  if (!movement.pose.empty()) {
    if (placed.extent == Extent::point && !placed.timing.apex_ns) {
      evaluator.report(scope, placed.node, MissingDuration{std::string(placed.name)});
      return;
    }
    place_pose(clip, movement.pose, placed, scope, evaluator);
  }
  for (const Sequence& s : movement.sequences) place_sequence(clip, s, placed, scope, evaluator);
  for (const Oscillation& o : movement.oscillations) place_oscillation(clip, o, placed, scope, evaluator);
  for (std::size_t i = first; i < clip.contributions.size(); ++i) {
    clip.contributions[i].span_start_ns = placed.span.start_ns;
    clip.contributions[i].span_end_ns = placed.span.end_ns;
    clip.contributions[i].used = placed.used;
    clip.contributions[i].cause = placed.cause;
  }
  // The envelope stays whole: a profile says how much of a thing there is, not how far it takes another's place.
  if (placed.timing.profile)
    for (std::size_t i = first; i < clip.contributions.size(); ++i)
      clip.contributions[i].curve = profiled(clip.contributions[i].curve, *placed.timing.profile);
}

}  // namespace nms::compiler
