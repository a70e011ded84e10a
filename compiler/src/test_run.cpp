#include "test_run.h"

#include <algorithm>
#include <limits>
#include <string>

#include <fmt/format.h>

#include <nms/compiler/diagnostic_kinds.h>

#include "action_unit.h"
#include "curve_course.h"
#include "lower_entry.h"
#include "lower_utterance.h"
#include "manual_tier.h"
#include "merge.h"
#include "placement.h"

namespace nms::compiler {

using lang::NodeKind;
using lang::NodeRef;
using lang::Unit;

struct TestSubject {
  ClipDraft clip;
  std::vector<MergedCurve> curves;
  bool merged = false;
  ManualTier tier;
  Span whole;
  bool entry = false;

  [[nodiscard]] PlacementContext context() const { return {tier.empty() ? nullptr : &tier, whole, entry}; }
};

namespace {

/// What lowering promises of a value (kFitTolerance, twice): allowed where no tolerance is written.
constexpr double kSlack = 1e-3;
/// Rounding of sums never decides.
constexpr double kRounding = 1e-6;
constexpr std::int64_t kAroundNs = 100'000'000;
constexpr std::int64_t kRoundNs = 10'000'000;
constexpr std::size_t kMostCauses = 6;

/// One thing in what an expectation speaks of: a channel, times a factor.
struct Part {
  enum class Direction : std::uint8_t { as_is, positive, negative };
  std::uint32_t channel = 0;
  double factor = 1.0;
  Direction direction = Direction::as_is;  ///< of an axis: only what goes this way counts, as `sample` prints it
  bool sided = false;                      ///< both sides are meant, and `channel` is the left one
};

class SumReader {
 public:
  SumReader(Evaluator& evaluator, const Scope& scope) : evaluator_(evaluator), scope_(scope) {}

  /// False: something in it is wrong, and has been reported.
  bool read(NodeRef sum, double factor, std::vector<Part>& parts) {
    bool good = true;
    for (NodeRef term : sum.children()) {
      double own = term.has(lang::kFlagMinus) ? -factor : factor;
      NodeRef primary;
      for (NodeRef part : term.children()) {
        if (part.is(NodeKind::factor))
          good = scale(part, own) && good;
        else
          primary = part;
      }
      good = primary.exists() && this->primary(primary, own, parts) && good;
    }
    return good;
  }

 private:
  bool scale(NodeRef factor, double& into) {
    const NodeRef first = factor.at(0);
    const NodeRef node = first.is(NodeKind::group) ? first.at(0) : first;
    const auto value = evaluator_.arithmetic(node, scope_);
    if (!value) return false;
    if (!value->word.empty()) {
      evaluator_.report(scope_, factor, WrongKind{std::string(factor.text()), "a word", "a number", ""});
      return false;
    }
    if (!is_scalar(value->quantity.unit)) {
      evaluator_.report(scope_, factor,
                        UnitMismatch{std::string(factor.text()), std::string(lang::describe(value->quantity.unit)),
                                     "a share or a plain number"});
      return false;
    }
    into *= value->quantity.value;
    if (into >= -kMaxAmount && into <= kMaxAmount) return true;
    evaluator_.report(scope_, factor,
                      OutOfRange{std::string(factor.text()), fmt::format("factors up to {}", kMaxAmount)});
    return false;
  }

  bool primary(NodeRef node, double factor, std::vector<Part>& parts) {
    if (node.is(NodeKind::group)) return node.at(0).exists() && read(node.at(0), factor, parts);
    if (node.is(NodeKind::au_token)) return unit(node, factor, parts);
    if (node.is(NodeKind::name)) {
      const std::uint32_t axis = evaluator_.channels().find_axis(node.text());
      if (axis != kUnreachable) {
        parts.push_back({axis, factor});
        return true;
      }
      std::vector<std::string> axes;
      for (const ChannelInfo& c : evaluator_.channels().channels)
        if (c.is_axis()) axes.push_back(c.name);
      evaluator_.report(scope_, node,
                        UnknownName{"action unit or axis", std::string(node.text()), lang::nearest(node.text(), axes)});
      return false;
    }
    evaluator_.report(scope_, node,
                      WrongKind{std::string(node.text()), fmt::format("a {}", lang::describe(node.kind())),
                                "an action unit or an axis", "write the units whose values are expected: AU1L + AU2L"});
    return false;
  }

  bool unit(NodeRef token, double factor, std::vector<Part>& parts) {
    const auto read = read_action_unit(token.text());
    const UnitInfo* unit = read ? evaluator_.channels().find_unit(read->number) : nullptr;
    if (unit == nullptr) {
      const std::string name = read ? fmt::format("AU{}", read->number) : std::string(token.text());
      evaluator_.report(scope_, token,
                        UnknownActionUnit{name, lang::nearest(name, evaluator_.channels().unit_names())});
      return false;
    }
    if (read->side != program::Side::none && !unit->sided) {
      evaluator_.report(scope_, token, UnknownSide{std::string(token.text()), fmt::format("AU{}", read->number)});
      return false;
    }
    if (read->intensity != 1.0 || token.text().find('E') != std::string_view::npos) {
      evaluator_.report(scope_, token,
                        WrongKind{std::string(token.text()), "a unit with an intensity", "a unit alone",
                                  fmt::format("compare it with its intensity: AU{} == {:.4g}%", read->number,
                                              read->intensity * 100.0)});
      return false;
    }
    Part part{unit->channel, factor};
    if (evaluator_.channels().channels[unit->channel].is_axis())
      part.direction = unit->sign > 0.0 ? Part::Direction::positive : Part::Direction::negative;
    if (read->side == program::Side::right) ++part.channel;
    part.sided = unit->sided && read->side == program::Side::none;
    parts.push_back(part);
    return true;
  }

  Evaluator& evaluator_;
  const Scope& scope_;
};

enum class Relation : std::uint8_t { equal, at_most, at_least, below, above };

/// An `expect` that has been read and found sound.
struct Wanted {
  enum class Kind : std::uint8_t { holds, never, rests, rises, falls };
  Kind kind = Kind::holds;
  std::vector<Part> parts;
  Relation relation = Relation::equal;
  double value = 0.0;
  double tolerance = -1.0;  ///< -1: none is written
  Unit unit = Unit::percent;
  double unit_scale = 1.0;  ///< of values: 1, or full scale where all parts are of one axis
  std::int64_t from_ns = 0, to_ns = 0;
};

Relation relation_of(std::string_view text) {
  if (text == "<=") return Relation::at_most;
  if (text == ">=") return Relation::at_least;
  if (text == "<") return Relation::below;
  if (text == ">") return Relation::above;
  return Relation::equal;
}

/// The values that an expectation allows.
Bounds bounds_of(const Wanted& w, double slack, double rounding) {
  constexpr double kAll = std::numeric_limits<double>::max();
  if (w.kind == Wanted::Kind::rests) return {-slack, slack, false};
  const bool never = w.kind == Wanted::Kind::never;
  const double written = w.tolerance < 0.0 ? 0.0 : w.tolerance;
  const double wide = (w.tolerance < 0.0 && (!never || w.relation == Relation::equal) ? slack : written) + rounding;
  // `never >= 20%` forbids what `>= 20%` allows, and that alone: no slack but what is written.
  switch (w.relation) {
    case Relation::equal:
      return {w.value - wide, w.value + wide, never};
    case Relation::at_most:
      return {-kAll, w.value + wide, never};
    case Relation::at_least:
      return {w.value - wide, kAll, never};
    case Relation::below:
      return {-kAll, w.value + written - rounding, never};
    case Relation::above:
      return {w.value - written + rounding, kAll, never};
  }
  return {};
}

double unit_of(const ChannelInfo& c, Unit unit) {
  if (unit != Unit::angle && unit != Unit::length) return 1.0;
  return c.full_scale < 0.0 ? -c.full_scale : c.full_scale;
}

const Curve* curve_of(const TestSubject& s, std::uint32_t channel) {
  const auto it = std::lower_bound(s.curves.begin(), s.curves.end(), channel,
                                   [](const MergedCurve& m, std::uint32_t c) { return m.channel < c; });
  return it != s.curves.end() && it->channel == channel ? &it->curve : nullptr;
}

/// The course of what is expected of; a channel that nobody speaks of is at rest.
Curve course_of(const TestSubject& subject, const Wanted& w, bool right, const Channels& channels) {
  Curve sum;
  for (const Part& p : w.parts) {
    const std::uint32_t channel = p.channel + (p.sided && right ? 1U : 0U);
    const Curve* of = curve_of(subject, channel);
    if (of == nullptr || of->empty()) continue;
    Curve c = *of;
    if (p.direction != Part::Direction::as_is)
      c = clamped(scaled(std::move(c), p.direction == Part::Direction::positive ? 1.0 : -1.0), 0.0, 1.0);
    sum = add(sum, scaled(std::move(c), p.factor * unit_of(channels.channels[channel], w.unit)));
  }
  if (sum.empty()) sum.knots.push_back({0, 0.0, 0.0, 0.0});
  return sum;
}

std::string subject_of(NodeRef sum, const Wanted& w, bool sided, bool right, const Channels& channels) {
  if (w.parts.size() == 1 && sum.at(0).at(0).is(NodeKind::au_token) && !sum.at(1)) {
    const ChannelInfo& c = channels.channels[w.parts[0].channel + (w.parts[0].sided && right ? 1U : 0U)];
    return c.is_axis() ? std::string(sum.text()) : c.name;
  }
  std::string text(sum.text());
  if (sided) text += right ? ", right" : ", left";
  return text;
}

/// What contributes to the channels of an expectation at a time; where nothing does, what contributes at others.
std::vector<TestCause> causes_of(const TestSubject& subject, const Wanted& w, bool right, std::int64_t time_ns,
                                 const Channels& channels) {
  std::vector<TestCause> out;
  for (const bool then : {true, false}) {
    for (const Contribution& c : subject.clip.contributions) {
      const bool meant = std::any_of(w.parts.begin(), w.parts.end(), [&](const Part& p) {
        return p.channel + (p.sided && right ? 1U : 0U) == c.channel;
      });
      if (!meant || c.curve.empty()) continue;
      const double value = c.curve.value(time_ns);
      if (then && value < kSlack && value > -kSlack) continue;
      const DraftSource* made = source_at(subject.clip, c.curve, time_ns);
      if (made == nullptr) continue;
      TestCause cause{made->node.tree().source_pointer(),
                      made->node.range(),
                      std::string(made->entry),
                      channels.channels[c.channel].name,
                      value,
                      then};
      const bool known = std::any_of(out.begin(), out.end(), [&](const TestCause& o) {
        return o.source == cause.source && o.range.begin == cause.range.begin && o.channel == cause.channel;
      });
      if (!known) out.push_back(std::move(cause));
      if (out.size() == kMostCauses) return out;
    }
    if (!out.empty()) break;
  }
  return out;
}

/// Reads one `expect`: what is wrong with it is reported.
class ExpectReader {
 public:
  ExpectReader(Evaluator& evaluator, const Scope& scope, const TestSubject* subject)
      : evaluator_(evaluator), scope_(scope), subject_(subject) {}

  std::optional<Wanted> read(NodeRef node) {
    Wanted w;
    const NodeRef sum = node.child(NodeKind::sum);
    if (!sum || sum.has(lang::kFlagError)) return std::nullopt;
    bool good = SumReader(evaluator_, scope_).read(sum, 1.0, w.parts);
    good = comparison(node, w) && good;
    good = good && units(node, w);
    if (subject_ == nullptr) return std::nullopt;
    good = place(node, w) && good;
    if (!good) return std::nullopt;
    return w;
  }

 private:
  bool comparison(NodeRef node, Wanted& w) {
    bool any = false;
    for (NodeRef c : node.children()) {
      if (!c.is(NodeKind::comparison)) continue;
      any = true;
      const std::string_view word = c.text();
      if (word == "rises")
        w.kind = Wanted::Kind::rises;
      else if (word == "falls")
        w.kind = Wanted::Kind::falls;
      else if (word == "never")
        w.kind = Wanted::Kind::rests;
      else
        w.relation = relation_of(word);
    }
    if (!any) {
      evaluator_.report(scope_, node, MissingProperty{"something to hold: >= 50%, rises, falls or never", "expect"});
      return false;
    }
    if (w.kind == Wanted::Kind::rests && node.child(NodeKind::quantity)) w.kind = Wanted::Kind::never;
    return true;
  }

  bool units(NodeRef node, Wanted& w) {
    const NodeRef value = node.child(NodeKind::quantity);
    if (!value) return true;
    const auto q = lang::read_quantity(value.text());
    if (!q) return false;
    w.value = q->value;
    if (q->unit == Unit::angle || q->unit == Unit::length) w.unit = q->unit;
    for (const Part& p : w.parts) {
      const ChannelInfo& c = evaluator_.channels().channels[p.channel];
      const bool fits =
          w.unit == Unit::percent ? q->unit == Unit::percent || q->unit == Unit::none : c.is_axis() && c.unit == w.unit;
      if (fits) continue;
      evaluator_.report(scope_, value,
                        UnitMismatch{std::string(value.text()), std::string(lang::describe(q->unit)),
                                     c.is_axis() ? std::string(lang::describe(c.unit)) + " or a share" : "a share"});
      return false;
    }
    const NodeRef tolerance = node.child(NodeKind::tolerance);
    if (!tolerance) return true;
    const NodeRef amount = tolerance.child(NodeKind::quantity);
    const auto t = amount ? evaluator_.quantity(amount, w.unit, scope_) : std::nullopt;
    if (!t) return false;
    if (t->value < 0.0) {
      evaluator_.report(scope_, amount, OutOfRange{std::string(amount.text()), "tolerances of 0 and above"});
      return false;
    }
    w.tolerance = t->value;
    return true;
  }

  bool place(NodeRef node, Wanted& w) {
    const OutsideTimes::InClip in(evaluator_.outside(), subject_->clip.name);
    const PlacementContext context = subject_->context();
    Placer placer(evaluator_, scope_, context);
    if (const NodeRef at = node.child(NodeKind::at)) {
      if (w.kind == Wanted::Kind::rises || w.kind == Wanted::Kind::falls) {
        evaluator_.report(scope_, at,
                          WrongKind{std::string(at.text()), "a point", "a span",
                                    "what rises or falls takes time: from A to B, or over A..B"});
        return false;
      }
      const auto time = placer.point(at.child(NodeKind::point));
      if (!time) return false;
      w.from_ns = w.to_ns = *time;
      return true;
    }
    if (const NodeRef over = node.child(NodeKind::over)) {
      const auto span = placer.over(over);
      if (!span) return false;
      w.from_ns = span->start_ns;
      w.to_ns = span->end_ns;
      return true;
    }
    if (const NodeRef from_to = node.child(NodeKind::from_to)) {
      const auto from = edge(placer, from_to.at(0), true);
      const auto to = edge(placer, from_to.at(1), false);
      if (!from || !to) return false;
      if (*to <= *from) {
        const auto shown = [](NodeRef n, std::int64_t ns) {
          return fmt::format("{} ({:.6g}s)", n.text(), static_cast<double>(ns) / 1e9);
        };
        evaluator_.report(scope_, from_to, SpanBackwards{shown(from_to.at(0), *from), shown(from_to.at(1), *to)});
        return false;
      }
      w.from_ns = *from;
      w.to_ns = *to;
      return true;
    }
    w.from_ns = subject_->clip.start_ns;
    w.to_ns = subject_->clip.end_ns;
    return true;
  }

  /// A point, or a sign: its start on the left, its end on the right.
  std::optional<std::int64_t> edge(Placer& placer, NodeRef node, bool start) {
    if (!node) return std::nullopt;
    if (node.is(NodeKind::point)) return placer.point(node);
    const Sign* sign = placer.named(node);
    if (sign == nullptr) return std::nullopt;
    return start ? sign->start_ns : sign->end_ns;
  }

  Evaluator& evaluator_;
  const Scope& scope_;
  const TestSubject* subject_;
};

Expectation judge(NodeRef node, const Wanted& w, TestSubject& subject, const Channels& channels) {
  if (!subject.merged) {
    subject.curves = merge(subject.clip, channels);
    subject.merged = true;
  }
  const NodeRef sum = node.child(NodeKind::sum);
  Expectation out;
  out.source = node.tree().source_pointer();
  out.range = node.range();
  out.sum_range = sum.range();
  out.unit = w.unit;
  out.from_ns = w.from_ns;
  out.to_ns = w.to_ns;
  for (NodeRef part : node.children())
    if (part.is(NodeKind::comparison) || part.is(NodeKind::quantity) || part.is(NodeKind::tolerance))
      out.expected += fmt::format("{}{}", out.expected.empty() ? "" : " ", part.text());
  // Slack is a share of the widest axis where values are degrees.
  double full = 0.0;
  for (const Part& p : w.parts) full = std::max(full, unit_of(channels.channels[p.channel], w.unit));
  if (full == 0.0) full = 1.0;
  const bool sided = std::any_of(w.parts.begin(), w.parts.end(), [](const Part& p) { return p.sided; });
  bool any_failed = false;
  for (const bool right : {false, true}) {
    if (right && !sided) break;
    Curve course = course_of(subject, w, right, channels);
    Verdict verdict;
    const bool falls = w.kind == Wanted::Kind::falls;
    if (falls) course = scaled(std::move(course), -1.0);
    if (falls || w.kind == Wanted::Kind::rises)
      verdict = rises(course, w.from_ns, w.to_ns, kSlack);
    else
      verdict = stays(course, w.from_ns, w.to_ns, bounds_of(w, kSlack * full, kRounding * full));
    const double sign = falls ? -1.0 : 1.0;
    const bool earlier = any_failed && !verdict.holds && verdict.first.time_ns < out.first.time_ns;
    if (verdict.holds || (any_failed && !earlier)) {
      if (!any_failed && !right) out.subject = subject_of(sum, w, sided, right, channels);
      continue;
    }
    any_failed = true;
    out.subject = subject_of(sum, w, sided, right, channels);
    const auto value = [sign](const Moment& m) { return TestValue{m.time_ns, m.value * sign}; };
    out.first = value(verdict.first);
    out.worst = value(verdict.worst);
    out.before = value(verdict.before);
    out.around.clear();
    for (int i = -2; i <= 2; ++i) {
      // A failure may begin anywhere; its neighbours are read at round times.
      const std::int64_t t =
          i == 0 ? out.first.time_ns
                 : (out.first.time_ns / kRoundNs + (out.first.time_ns < 0 ? -1 : 0)) * kRoundNs + i * kAroundNs;
      out.around.push_back({t, course.value(t) * sign});
    }
    out.causes = causes_of(subject, w, right, out.first.time_ns, channels);
  }
  out.passed = !any_failed;
  return out;
}

std::string_view kind_of(const Declaration& d) {
  return d.node.is(NodeKind::utterance) ? "an utterance" : d.node.is(NodeKind::timeline) ? "a timeline" : "a discourse";
}

}  // namespace

TestRun::TestRun(Evaluator& evaluator, Discourses& discourses) : evaluator_(evaluator), discourses_(discourses) {}

TestRun::~TestRun() = default;

const Declaration* TestRun::find_entry(std::string_view name, std::uint32_t file) const {
  const Declarations& all = evaluator_.declarations();
  const Declaration* best = nullptr;
  std::uint32_t nearest = kUnreachable;
  for (std::uint32_t i = 0; i < all.lexicons.size(); ++i) {
    const std::uint32_t distance = evaluator_.files()[file].distance[all.lexicons[i].declaration.file];
    if (distance >= nearest) continue;
    const Declaration* found = all.find_entry(name, i);
    if (found == nullptr) continue;
    nearest = distance;
    best = found;
  }
  return best;
}

TestRun::Subject TestRun::play_clip(const Declaration& d, NodeRef play, NodeRef duration, const Scope& scope) {
  if (duration) {
    evaluator_.report(scope, duration,
                      WrongKind{std::string(d.name), std::string(kind_of(d)) + ", which has its own length",
                                "an entry, a pose, an expression or a motion", "leave `for` out"});
    return nullptr;
  }
  const bool plain = !play.child(NodeKind::argument);
  if (plain) {
    const auto known = played_.find(&d);
    if (known != played_.end()) return known->second;
  }
  auto subject = std::make_shared<TestSubject>();
  std::optional<ClipDraft> clip;
  if (d.node.is(NodeKind::timeline)) {
    const auto bound = evaluator_.bind(play, false, d.name, d.node.child(NodeKind::params), d.file, scope);
    if (bound) clip = lower_timeline(d, *bound, evaluator_);
    if (clip) {
      subject->clip = std::move(*clip);
      // Its own end is the length that is stated, which what it holds may outlast.
      const NodeRef stated = d.node.child(NodeKind::quantity);
      const auto length = stated ? lang::read_quantity(stated.text()) : std::nullopt;
      subject->whole = {0, length ? length->nanoseconds : subject->clip.end_ns, kUnreachable, kUnreachable};
    }
  } else if (d.node.is(NodeKind::discourse) && plain) {
    auto discourse = discourses_.lower(d);
    if (discourse) {
      subject->tier = std::move(discourse->tier);
      subject->whole = discourse->whole;
      clip = std::move(discourse->clip);
      subject->clip = std::move(*clip);
    }
  } else {
    if (!plain) {
      const NodeRef a = play.child(NodeKind::argument);
      evaluator_.report(scope, a, UnexpectedArgument{std::string(d.name), std::string(a.text()), {}});
      return nullptr;
    }
    UtteranceSetting setting;
    setting.places = discourses_.places_of(d);
    auto utterance = lower_utterance(d, evaluator_, setting);
    if (utterance) {
      subject->tier = std::move(utterance->tier);
      subject->whole = utterance->whole;
      if (subject->tier.empty())
        subject->whole = {utterance->clip.start_ns, utterance->clip.end_ns, kUnreachable, kUnreachable};
      clip = std::move(utterance->clip);
      subject->clip = std::move(*clip);
    }
  }
  if (!clip) subject = nullptr;
  if (plain) played_[&d] = subject;
  return subject;
}

TestRun::Subject TestRun::play_entry(const Declaration& d, NodeRef play, std::int64_t length_ns, const Scope& scope) {
  const auto use = bind_entry(d, play, scope, evaluator_);
  if (!use) return nullptr;
  const std::int64_t length = length_ns > 0 ? length_ns : carrier_ns(d);
  auto clip = lower_entry(d, *use, length, evaluator_);
  if (!clip) return nullptr;
  auto subject = std::make_shared<TestSubject>();
  subject->clip = std::move(*clip);
  subject->whole = {0, length, kUnreachable, kUnreachable};
  subject->entry = true;
  return subject;
}

TestRun::Subject TestRun::play_movement(const Declaration& d, NodeRef play, std::int64_t length_ns,
                                        const Scope& scope) {
  const auto bound = evaluator_.bind(play, false, d.name, d.node.child(NodeKind::params), d.file, scope);
  if (!bound) return nullptr;
  const auto movement = evaluator_.declaration(d, *bound);
  if (!movement) return nullptr;
  auto subject = std::make_shared<TestSubject>();
  ClipDraft& clip = subject->clip;
  clip.name = d.name;
  Placed placed;
  placed.name = d.name;
  placed.node = play.at(0);
  placed.entry = d.name;
  const bool expression = d.node.is(NodeKind::expression);
  if (expression) {
    // As its clip: it ends in its last pose.
    if (movement->sequences.empty()) return nullptr;
    const Sequence& s = movement->sequences.front();
    if (length_ns <= 0 && s.duration_ns < 0) {
      evaluator_.report(scope, play.at(0), MissingDuration{std::string(d.name)});
      return nullptr;
    }
    clip.end_ns = length_ns > 0 ? length_ns : s.duration_ns;
    play_sequence(clip, s, 0, clip.end_ns, false, placed, evaluator_);
  } else {
    placed.span = {0, std::max<std::int64_t>(length_ns, 0), kUnreachable, kUnreachable};
    placed.extent = length_ns > 0 ? Extent::span : Extent::point;
    schedule(clip, *movement, placed, *bound, evaluator_);
    clip.end_ns = placed.span.end_ns;
    for (const Contribution& c : clip.contributions) {
      clip.start_ns = std::min(clip.start_ns, c.start_ns);
      clip.end_ns = std::max(clip.end_ns, c.end_ns);
    }
  }
  subject->whole = {0, clip.end_ns, kUnreachable, kUnreachable};
  return subject;
}

TestRun::Subject TestRun::play(NodeRef play, std::uint32_t file) {
  const NodeRef name = play.at(0);
  if (play.has(lang::kFlagError) || !name.is(NodeKind::name)) return nullptr;
  Scope scope;
  scope.file = file;
  const NodeRef duration = play.child(NodeKind::duration);
  std::int64_t length_ns = 0;
  if (duration) {
    const NodeRef amount = duration.child(NodeKind::quantity);
    const auto q = amount ? evaluator_.quantity(amount, Unit::time, scope) : std::nullopt;
    if (!q) return nullptr;
    if (q->nanoseconds <= 0) {
      evaluator_.report(scope, amount, OutOfRange{std::string(amount.text()), "times above 0s"});
      return nullptr;
    }
    length_ns = q->nanoseconds;
  }
  // As clips go by their names: an expression before an entry, an entry before the pose or motion that it hides.
  if (const Declaration* d = evaluator_.declarations().find_clip(name.text(), file))
    return play_clip(*d, play, duration, scope);
  const Declaration* movement = evaluator_.declarations().find_movement(name.text(), file);
  if (movement != nullptr && movement->node.is(NodeKind::expression))
    return play_movement(*movement, play, length_ns, scope);
  if (const Declaration* d = find_entry(name.text(), file)) return play_entry(*d, play, length_ns, scope);
  if (movement != nullptr) return play_movement(*movement, play, length_ns, scope);
  const auto known = [&] {
    const Declarations& all = evaluator_.declarations();
    std::vector<std::string> names = all.movement_names(file);
    for (const Declaration& d : all.clips)
      if (evaluator_.files()[file].distance[d.file] != kUnreachable) names.emplace_back(d.name);
    for (const Declaration& d : all.entries)
      if (evaluator_.files()[file].distance[d.file] != kUnreachable) names.emplace_back(d.name);
    return names;
  };
  evaluator_.report(scope, name,
                    UnknownName{"utterance, timeline, entry or expression", std::string(name.text()),
                                evaluator_.similar(name.text(), known)});
  return nullptr;
}

namespace {

void note_entries(const ClipDraft& clip, std::vector<PlayedEntry>& plays) {
  for (const DraftCause& c : clip.causes) {
    if (c.entry == nullptr) continue;
    PlayedEntry played{std::string(c.entry->name), c.entry->node.tree().source().path(), c.entry->node.range().begin};
    if (std::find(plays.begin(), plays.end(), played) == plays.end()) plays.push_back(std::move(played));
  }
}

}  // namespace

void TestRun::expect(NodeRef node, const Subject& subject, const Scope& scope, TestResult* result) {
  const auto wanted = ExpectReader(evaluator_, scope, subject.get()).read(node);
  if (wanted && result != nullptr)
    result->expectations.push_back(judge(node, *wanted, *subject, evaluator_.channels()));
}

TestResult TestRun::walk(const Declaration& test, bool run) {
  TestResult result;
  const NodeRef name = test.node.child(NodeKind::string);
  if (!name || test.node.has(lang::kFlagError)) return result;
  result.name = unquoted(name);
  result.source = test.node.tree().source_pointer();
  result.range = name.range();
  result.whole = test.node.range();
  Scope scope;
  scope.file = test.file;
  Subject subject;
  bool played = false;
  bool expected = false;
  for (NodeRef item : test.node.children()) {
    if (item.is(NodeKind::play)) {
      played = true;
      subject = play(item, test.file);
      if (run && subject != nullptr) note_entries(subject->clip, result.plays);
    } else if (item.is(NodeKind::expect)) {
      expected = true;
      if (!played) evaluator_.report(scope, item, MissingProperty{"something to play before it: play NAME", "expect"});
      if (!item.has(lang::kFlagError)) expect(item, subject, scope, run ? &result : nullptr);
    }
  }
  if (!expected) evaluator_.report(scope, name, MissingProperty{"something to expect: expect AU4 >= 50%", "the test"});
  return result;
}

}  // namespace nms::compiler
