#include <string_view>

#include <fmt/format.h>

#include "decimal_seconds.h"
#include "explanation.h"
#include "tiers.h"

namespace nms::cli {
namespace {

using compiler::Cause;
using compiler::MergeStep;

/// A source line is shown up to this many characters.
constexpr std::size_t kMostShown = 90;

struct Style {
  std::string_view bold, dim, off;
};
constexpr Style kPlain{"", "", ""};
constexpr Style kColors{"\x1b[1m", "\x1b[2m", "\x1b[0m"};

std::string percent(double value) {
  if (value < 1e-7 && value > -1e-7) value = 0.0;
  return fmt::format("{:.4g}%", value * 100.0);
}

std::string seconds(std::int64_t ns) {
  const std::int64_t half = ns < 0 ? -500'000 : 500'000;
  return decimal_seconds((ns + half) / 1'000'000 * 1'000'000) + "s";
}

std::string_view phase_name(Cause::Phase phase) {
  static constexpr std::string_view kNames[] = {"yet to come", "onset", "apex", "offset", "held", "moving", "over"};
  return kNames[static_cast<std::size_t>(phase)];
}

/// The first line of a range, without what would move the cursor.
std::string shown_source(const lang::Source& source, lang::Range range) {
  std::string_view text = source.slice(range);
  text = text.substr(0, text.find('\n'));
  if (!text.empty() && text.back() == '\r') text.remove_suffix(1);
  std::string out = printable(text);
  if (text_columns(out) <= kMostShown) return out;
  std::size_t cut = kMostShown;
  while ((static_cast<unsigned char>(out[cut]) & 0xC0U) == 0x80U) --cut;
  return out.substr(0, cut) + "…";
}

class Writer {
 public:
  Writer(const ExplainedMoment& moment, bool color) : moment_(moment), style_(color ? kColors : kPlain) {}

  std::string run() {
    for (std::size_t i = 0; i < moment_.channels.size(); ++i) {
      if (!out_.empty()) out_ += '\n';
      const bool both = i + 1 < moment_.channels.size() && mirrored(moment_.channels[i], moment_.channels[i + 1]);
      channel(moment_.channels[i], both ? &moment_.channels[i + 1] : nullptr);
      if (both) ++i;
    }
    return std::move(out_);
  }

 private:
  const program::Channel& info(const ExplainedChannel& c) const { return moment_.program->channels[c.channel]; }

  bool mirrored(const ExplainedChannel& a, const ExplainedChannel& b) const {
    if (info(a).side != program::Side::left || info(b).side != program::Side::right || info(a).au != info(b).au ||
        a.value != b.value || a.why.causes.size() != b.why.causes.size() || a.why.steps.size() != b.why.steps.size())
      return false;
    for (std::size_t i = 0; i < a.why.causes.size(); ++i) {
      const Cause &x = a.why.causes[i], &y = b.why.causes[i];
      if (x.source != y.source || !(x.range == y.range) || x.value != y.value || x.start_ns != y.start_ns ||
          x.end_ns != y.end_ns || x.stated != y.stated || x.fate != y.fate)
        return false;
    }
    return true;
  }

  void channel(const ExplainedChannel& c, const ExplainedChannel* other) {
    const program::Program& p = *moment_.program;
    std::string name(p.string(info(c).name));
    if (other != nullptr) name += fmt::format(", {}", p.string(info(*other).name));
    std::string meaning = printable(p.string(info(c).title));
    std::string amount = percent(static_cast<double>(c.value));
    if (info(c).kind == program::ChannelKind::axis) {
      meaning = fmt::format("{} above 0, {} below", p.string(info(c).positive), p.string(info(c).negative));
      const double full = static_cast<double>(info(c).full_scale) * static_cast<double>(c.value);
      const bool turns = info(c).motion < program::Motion::translate_x;
      const double degrees_or_mm = (full < 0.0 ? -full : full) * (turns ? 57.29577951308232 : 1000.0);
      if (c.value != 0.0F)
        amount += fmt::format(" ({:.4g}{} of {})", degrees_or_mm, turns ? "deg" : "mm",
                              p.string(c.value > 0.0F ? info(c).positive : info(c).negative));
    }
    fmt::format_to(std::back_inserter(out_), "{}{}{} ({}) is {}{}{} at {} in {}", style_.bold, name, style_.off,
                   meaning, style_.bold, amount, style_.off, decimal_seconds(moment_.time_ns) + "s",
                   printable(moment_.clip));
    fmt::format_to(std::back_inserter(out_), "  {}[{}]{}\n", style_.dim, c.value, style_.off);
    if (c.why.causes.empty()) {
      out_ += "  the clip does not speak of it: whatever was there stays\n";
      return;
    }
    layers_shown_ = 0;
    for (const MergeStep& s : c.why.steps) step(s, c.why.causes);
    taken_out(c.why.causes);
    others(c.why.causes);
  }

  /// How a cause came to its value at the time.
  std::string course(const Cause& c) const {
    std::string out(phase_name(c.phase));
    if (c.phase == Cause::Phase::moving) out = c.movement == Cause::Movement::swing ? "in its swings" : "in its steps";
    if (c.phase == Cause::Phase::onset || c.phase == Cause::Phase::offset)
      out += fmt::format(", {} of {}", percent(c.envelope), percent(c.peak));
    const std::int64_t lead = c.span_start_ns - moment_.time_ns;
    if (c.active() && lead > 0) out += fmt::format(", {} before its span", seconds(lead));
    if (c.movement == Cause::Movement::pose)
      out += fmt::format("; comes from {}, full {} to {}, gone at {}", seconds(c.start_ns), seconds(c.apex_ns),
                         seconds(c.release_ns), seconds(c.end_ns));
    else
      out += fmt::format("; from {} to {}, at most {}", seconds(c.start_ns), seconds(c.end_ns), percent(c.peak));
    return out;
  }

  void place(const lang::Source& source, lang::Range range, std::string_view before) {
    const lang::Position at = source.position(range.begin);
    fmt::format_to(std::back_inserter(out_), "{:12}{}{}{}:{}:{}{}  {}\n", "", before, style_.dim,
                   printable(source.path()), at.line, at.column, style_.off, shown_source(source, range));
  }

  void cause(double value, std::string_view name, std::string_view how) {
    fmt::format_to(std::back_inserter(out_), "    {:>7} {}{}\n", percent(value),
                   name.empty() ? std::string() : fmt::format("{}: ", name), how);
  }

  void places(const Cause& c) {
    if (c.source) place(*c.source, c.range, "");
    if (c.used_source) place(*c.used_source, c.used_range, "used at ");
    for (const Cause::Given& g : c.given) {
      if (g.taken <= 0.0) continue;
      fmt::format_to(std::back_inserter(out_), "{:12}gives way to {}, which takes {} of it, by\n", "", g.to,
                     percent(g.taken));
      place(*g.source, g.range, "  ");
    }
  }

  /// @param first  of a chain that was made by co-articulation, or the only one there is
  /// @param value  what it comes to
  void cause(double value, const Cause& first, const std::vector<Cause>& causes) {
    const Cause* from = nullptr;  // the last of the chain that was let go
    const Cause* here = nullptr;  // the one that is at its apex
    const Cause* to = nullptr;    // the next to be reached
    if (first.fate == Cause::Fate::joined)
      for (const Cause& c : causes) {
        if (c.fate != Cause::Fate::joined || c.layer != first.layer || c.stated != first.stated) continue;
        const bool reached = c.apex_ns <= moment_.time_ns;
        const bool gone = c.release_ns <= moment_.time_ns;
        if (gone && (from == nullptr || c.release_ns > from->release_ns)) from = &c;
        if (!reached && (to == nullptr || c.apex_ns < to->apex_ns)) to = &c;
        if (reached && !gone) here = &c;
      }
    if (here != nullptr || from == nullptr || to == nullptr) {
      const Cause& c = here != nullptr ? *here : from != nullptr ? *from : first;
      cause(value, c.entry, course(c));
      places(c);
      return;
    }
    cause(
        value, from->entry,
        fmt::format("goes straight to {} (co-articulated): let go at {}, there at {}",
                    to->entry.empty() ? "the next apex" : to->entry, seconds(from->release_ns), seconds(to->apex_ns)));
    places(*from);
    places(*to);
  }

  static std::string formula(const MergeStep& s) {
    const double a = s.operands[0].value;
    const double b = s.operands.size() > 1 ? s.operands[1].value : 0.0;
    switch (s.kind) {
      case MergeStep::Kind::either:
        return fmt::format("with the layers below: 1 - (1 - {})(1 - {})", percent(a), percent(b));
      case MergeStep::Kind::add:
        return fmt::format("with the layers below: {} + {}", percent(a), percent(b));
      case MergeStep::Kind::replace:
        return fmt::format("what is stated takes the place of {} of that: {} x (1 - {}) + {}", percent(s.envelope),
                           percent(a), percent(s.envelope), percent(b));
      case MergeStep::Kind::highest:
        return fmt::format("it takes the place of {} of the layers below: {} x (1 - {}) + {}", percent(s.envelope),
                           percent(a), percent(s.envelope), percent(b));
      case MergeStep::Kind::scale:
        return fmt::format("other layers take {} of that: {} x (1 - {})", percent(s.envelope), percent(a),
                           percent(s.envelope));
      case MergeStep::Kind::hide:
        return fmt::format("{} of that is hidden: {} x (1 - {})", percent(s.envelope), percent(a), percent(s.envelope));
      default:
        return {};
    }
  }

  void step(const MergeStep& s, const std::vector<Cause>& causes) {
    if (s.name.empty()) {
      // Nothing was under it, or it is not there at the time: there is nothing to tell.
      if (s.kind >= MergeStep::Kind::replace ? s.envelope == 0.0 : layers_shown_ < 2 || !last_shown_) return;
      fmt::format_to(std::back_inserter(out_), "  {} = {}{}{}{}\n", formula(s), style_.bold, percent(s.result),
                     style_.off, s.result > 1.0 + 1e-6 || s.result < -1.0 - 1e-6 ? ", held at the full" : "");
      return;
    }
    std::size_t active = 0;
    double sum = 0.0;
    for (const MergeStep::Operand& o : s.operands) {
      sum += o.value;
      if (causes[o.cause].active() || o.value != 0.0) ++active;
    }
    last_shown_ = active != 0;
    if (active == 0) return;
    ++layers_shown_;
    std::string how;
    if (active > 1)
      how = s.kind == MergeStep::Kind::strongest ? ", the strongest of"
            : s.kind == MergeStep::Kind::sum     ? ", the sum of"
                                                 : ", the later to start takes the place of the earlier";
    if (s.kind == MergeStep::Kind::sum && (sum > s.result + 1e-6 || sum < s.result - 1e-6))
      how += fmt::format(" ({}, held at {})", percent(sum), percent(s.result));
    const std::string layer = s.name == "stated" ? "stated by the utterance" : fmt::format("{} layer", s.name);
    if (how.empty())
      fmt::format_to(std::back_inserter(out_), "  {}\n", layer);
    else
      fmt::format_to(std::back_inserter(out_), "  {}: {}{}{}{}\n", layer, style_.bold, percent(s.result), style_.off,
                     how);
    for (const MergeStep::Operand& o : s.operands)
      if (causes[o.cause].active() || o.value != 0.0) cause(o.value, causes[o.cause], causes);
  }

  void taken_out(const std::vector<Cause>& causes) {
    for (const Cause& c : causes) {
      const bool repeated = c.fate == Cause::Fate::repeated && c.active();
      const bool going = c.fate == Cause::Fate::let_go && c.phase == Cause::Phase::offset;
      if (!repeated && !going) continue;
      fmt::format_to(std::back_inserter(out_), "  {} {}\n", c.entry.empty() ? "a component" : c.entry,
                     repeated ? "is left out: another asks for the same motion and outlasts it"
                              : "was held, and goes as another comes");
      if (c.source) place(*c.source, c.range, "");
    }
  }

  /// What moves the channel at other times.
  void others(const std::vector<Cause>& causes) {
    std::string names;
    for (const Cause& c : causes)
      if (!c.active())
        names += fmt::format("{}{} {}..{}", names.empty() ? "" : ", ", c.entry.empty() ? "a component" : c.entry,
                             seconds(c.start_ns), seconds(c.end_ns));
    if (!names.empty())
      fmt::format_to(std::back_inserter(out_), "  {}at other times: {}{}\n", style_.dim, names, style_.off);
  }

  const ExplainedMoment& moment_;
  const Style& style_;
  int layers_shown_ = 0;     ///< of the channel, so far
  bool last_shown_ = false;  ///< the last layer had something to show
  std::string out_;
};

}  // namespace

std::string explanation_text(const ExplainedMoment& moment, bool color) { return Writer(moment, color).run(); }

}  // namespace nms::cli
