#include "channels.h"

#include <algorithm>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include <nms/compiler/diagnostic_kinds.h>

#include "action_unit.h"

namespace nms::compiler {

using lang::NodeKind;
using lang::NodeRef;
using lang::Quantity;
using lang::Unit;

std::uint32_t Channels::find_axis(std::string_view name) const {
  for (std::uint32_t i = 0; i < channels.size(); ++i)
    if (channels[i].is_axis() && channels[i].name == name) return i;
  return kUnreachable;
}

std::vector<std::string> Channels::unit_names() const {
  std::vector<std::string> names;
  for (const UnitInfo& u : units) names.push_back(fmt::format("AU{}", u.number));
  return names;
}

namespace {

/// Intensities from which two causes are taken to mean what they do, where a relation states none: FACS B and C.
constexpr double kSlight = 0.4;
constexpr double kPronounced = 0.6;

class Builder {
 public:
  Builder(const std::vector<LoadedFile>& files, const Declarations& declarations, lang::Diagnostics& diagnostics)
      : files_(files), declarations_(declarations), diagnostics_(diagnostics) {}

  Channels build() {
    for (const Declaration& d : declarations_.tracks) track(d);
    std::vector<UnitInfo> axis_units;
    std::vector<ChannelInfo> axes;
    for (const Declaration& d : declarations_.axes) axis(d, axes, axis_units);
    units(axis_units);
    // Axes stand after the AUs, by their first AU.
    std::vector<std::uint32_t> order(axes.size());
    for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
    std::stable_sort(order.begin(), order.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return axes[a].au < axes[b].au; });
    for (const std::uint32_t i : order) {
      const auto channel = static_cast<std::uint32_t>(out_.channels.size());
      for (UnitInfo& u : axis_units)
        if (u.channel == i) unit_channel_.emplace_back(u.number, channel);
      out_.channels.push_back(axes[i]);
    }
    for (UnitInfo& u : axis_units) {
      for (const auto& [number, channel] : unit_channel_)
        if (number == u.number) u.channel = channel;
      out_.units.push_back(u);
    }
    std::sort(out_.units.begin(), out_.units.end(),
              [](const UnitInfo& a, const UnitInfo& b) { return a.number < b.number; });
    for (std::size_t i = out_.units.size(); i-- > 0;) {
      const std::size_t number = out_.units[i].number;
      if (out_.unit_of_number.size() <= number) out_.unit_of_number.resize(number + 1);
      out_.unit_of_number[number] = static_cast<std::uint16_t>(i + 1);
    }
    for (const UnitInfo& u : out_.units)
      if (u.declaration.node.is(NodeKind::au))
        for (NodeRef p : u.declaration.node.children())
          if (is_property(p)) relation(u, p);
    return std::move(out_);
  }

 private:
  template <typename Kind>
  lang::Diagnostic& report(const Declaration& d, NodeRef at, const Kind& kind) {
    // What is not there did not parse, and that has been reported; the declaration stands for it.
    return diagnostics_.report(files_[d.file].tree->source_pointer(), (at ? at : d.node).range(), kind);
  }

  std::uint32_t find_track(std::string_view name) const {
    for (std::uint32_t i = 0; i < out_.tracks.size(); ++i)
      if (out_.tracks[i].name == name) return i;
    return kUnreachable;
  }

  /// The single value of a property, as a quantity of a unit.
  std::optional<Quantity> quantity(const Declaration& d, NodeRef property, Unit unit) {
    const NodeRef value = property.at(1);
    const auto q = value && value.is(NodeKind::quantity) ? lang::read_quantity(value.text()) : std::nullopt;
    if (q && q->unit == unit) return q;
    report(d, value ? value : property,
           BadProperty{std::string(property.at(0).text()), value ? std::string(value.text()) : "nothing",
                       std::string(lang::describe(unit))});
    return std::nullopt;
  }

  void track(const Declaration& d) {
    if (find_track(d.name) != kUnreachable) return;
    TrackInfo info;
    info.name = d.name;
    for (NodeRef p : d.node.children()) {
      if (!is_property(p)) continue;
      const std::string_view name = p.at(0).text();
      if (name == "merge") {
        const NodeRef value = p.at(1);
        const std::string_view word = value ? value.text() : std::string_view();
        if (word == "strongest")
          info.merge = program::MergeOperator::strongest;
        else if (word == "sum")
          info.merge = program::MergeOperator::sum;
        else if (word == "latest")
          info.merge = program::MergeOperator::latest;
        else
          report(d, value ? value : p, BadProperty{"merge", std::string(word), "strongest, sum or latest"});
      } else if (name == "onset" || name == "offset") {
        if (const auto q = quantity(d, p, Unit::time)) {
          if (q->nanoseconds < 0)
            report(d, p.at(1), OutOfRange{std::string(p.at(1).text()), "0s and above"});
          else
            (name == "onset" ? info.onset_ns : info.offset_ns) = q->nanoseconds;
        }
      } else if (name == "layers") {
        const std::string_view word = p.at(1) ? p.at(1).text() : std::string_view();
        if (word == "highest")
          info.layers = LayerOperator::highest;
        else if (word != "either")
          report(d, p.at(1) ? p.at(1) : p, BadProperty{"layers", std::string(word), "either or highest"});
      } else if (name == "slot") {
        slot(d, p, info);
      } else {
        report(d, p.at(0),
               UnknownProperty{std::string(name), "a track", {"merge", "layers", "slot", "onset", "offset"}});
      }
    }
    out_.tracks.push_back(std::move(info));
  }

  /// `slot lower_face lexical morphological`
  void slot(const Declaration& d, NodeRef property, TrackInfo& info) {
    if (const NodeRef name = property.at(1); name && name.is(NodeKind::name)) info.slot = name.text();
    std::uint32_t values = 0;
    for (NodeRef value : property.children()) {
      if (++values <= 2) continue;
      const auto layer = read_layer(value.text());
      if (!layer || std::find(info.slot_order.begin(), info.slot_order.end(), *layer) != info.slot_order.end())
        report(d, value, BadProperty{"slot", std::string(value.text()), "functions of entries, each once"});
      else
        info.slot_order.push_back(*layer);
    }
    if (info.slot.empty() || values < 4)
      report(d, property, BadProperty{"slot", "less", "a name and two functions or more, the first goes first"});
  }

  /// The channels that a unit of a relation stands for as one side sees it: the same side of what has sides; of itself
  /// the other; both sides for what has none.
  std::optional<Related> related(const UnitInfo& from, program::Side side, NodeRef property, NodeRef token,
                                 double least) {
    const auto read = read_action_unit(token.text());
    const UnitInfo* to = read ? out_.find_unit(read->number) : nullptr;
    if (to == nullptr) {
      report(from.declaration, token,
             UnknownActionUnit{std::string(token.text()), lang::nearest(token.text(), out_.unit_names())});
      return std::nullopt;
    }
    const bool itself = to == &from;
    if (read->side != program::Side::none || read->intensity != 1.0 || out_.channels[to->channel].is_axis() ||
        (itself && !to->sided)) {
      report(from.declaration, token,
             BadProperty{std::string(property.at(0).text()), std::string(token.text()),
                         "units without side and letter that belong to no axis"});
      return std::nullopt;
    }
    if (!to->sided) return Related{to->channel, to->channel, least};
    if (side == program::Side::none) return Related{to->channel, to->channel + 1, least};
    const bool right = (side == program::Side::right) != itself;
    return Related{to->channel + (right ? 1U : 0U), to->channel + (right ? 1U : 0U), least};
  }

  static void add_relation(std::vector<Related>& all, const Related& r) {
    for (const Related& known : all)
      if (known.first == r.first) return;
    all.push_back(r);
  }

  /// `antagonists AU25 AU26 40%`, `contrary AU1 AU2 60%`, `hides AU5`, `longest 500ms AU43`
  void relation(const UnitInfo& unit, NodeRef property) {
    const std::string_view name = property.at(0).text();
    const bool antagonists = name == "antagonists";
    const bool contrary = name == "contrary";
    if (name == "longest") return longest(unit, property);
    if (!antagonists && !contrary && name != "hides") return;
    const Declaration& d = unit.declaration;
    if (out_.channels[unit.channel].is_axis()) {
      report(d, property.at(0), UnknownProperty{std::string(name), "a unit of an axis", {"track"}});
      return;
    }
    double least = antagonists ? kSlight : kPronounced;
    std::vector<NodeRef> tokens;
    bool first = true;
    for (NodeRef value : property.children()) {
      if (std::exchange(first, false)) continue;
      if (value.is(NodeKind::au_token)) {
        tokens.push_back(value);
        continue;
      }
      const auto q = value.is(NodeKind::quantity) ? lang::read_quantity(value.text()) : std::nullopt;
      if (!q || q->unit != Unit::percent || q->value <= 0.0 || q->value > 1.0 || name == "hides") {
        report(d, value,
               BadProperty{std::string(name), std::string(value.text()),
                           name == "hides" ? "action units" : "action units, and a share above 0%, up to 100%"});
        return;
      }
      least = q->value;
    }
    if (tokens.empty()) report(d, property, BadProperty{std::string(name), "nothing", "action units"});
    for (const NodeRef token : tokens) {
      for (const program::Side side : {program::Side::left, program::Side::right}) {
        if (!unit.sided && side == program::Side::right) break;
        const program::Side own = unit.sided ? side : program::Side::none;
        const std::uint32_t channel = unit.channel + (own == program::Side::right ? 1U : 0U);
        const auto to = related(unit, own, property, token, least);
        if (!to) return;
        if (antagonists) add_relation(out_.channels[channel].antagonists, *to);
        if (contrary) add_relation(out_.channels[channel].contrary, *to);
        // The other way round: what has no side sees both sides of what has some.
        const bool both = unit.sided && out_.channels[to->first].side == program::Side::none;
        const Related back = both ? Related{unit.channel, unit.channel + 1, least} : Related{channel, channel, least};
        for (std::uint32_t c = to->first; c <= to->last; ++c) {
          if (antagonists) add_relation(out_.channels[c].antagonists, back);
          if (contrary) add_relation(out_.channels[c].contrary, back);
          if (name == "hides") add_relation(out_.channels[c].hidden_by, back);
        }
      }
    }
  }

  void longest(const UnitInfo& unit, NodeRef property) {
    const Declaration& d = unit.declaration;
    const auto q = quantity(d, property, Unit::time);
    if (!q) return;
    const NodeRef other = property.at(2);
    if (q->nanoseconds <= 0 || !other || !other.is(NodeKind::au_token)) {
      report(d, property, BadProperty{"longest", std::string(property.at(1).text()), "a time above 0s and a unit"});
      return;
    }
    for (std::uint32_t i = 0; i < (unit.sided ? 2U : 1U); ++i) {
      out_.channels[unit.channel + i].longest_ns = q->nanoseconds;
      out_.channels[unit.channel + i].beyond_longest = other.text();
    }
  }

  /// The track that a property names, or kUnreachable.
  std::uint32_t track_of(const Declaration& d, NodeRef property) {
    const NodeRef value = property.at(1);
    if (value) {
      const std::uint32_t t = find_track(value.text());
      if (t != kUnreachable) return t;
      std::vector<std::string> names;
      for (const TrackInfo& info : out_.tracks) names.push_back(info.name);
      report(d, value, UnknownName{"track", std::string(value.text()), lang::nearest(value.text(), names)});
    } else {
      report(d, property, BadProperty{"track", "nothing", "the name of a track"});
    }
    return kUnreachable;
  }

  void axis(const Declaration& d, std::vector<ChannelInfo>& axes, std::vector<UnitInfo>& axis_units) {
    for (const ChannelInfo& a : axes)
      if (a.name == d.name) return;
    ChannelInfo info;
    info.name = d.name;
    info.kind = program::ChannelKind::axis;
    info.track = kUnreachable;
    std::uint16_t number[2] = {0, 0};
    int count = 0;
    for (NodeRef child : d.node.children()) {
      if (child.is(NodeKind::au_token)) {
        const auto unit = read_action_unit(child.text());
        if (unit && count < 2) number[count++] = unit->number;
        continue;
      }
      if (!is_property(child)) continue;
      const std::string_view name = child.at(0).text();
      const NodeRef value = child.at(1);
      const std::string_view word = value ? value.text() : std::string_view();
      if (name == "track") {
        info.track = track_of(d, child);
      } else if (name == "100%") {
        const auto q = value ? lang::read_quantity(word) : std::nullopt;
        if (q && (q->unit == Unit::angle || q->unit == Unit::length) && q->value != 0.0) {
          info.full_scale = q->value;
          info.unit = q->unit;
        } else {
          report(d, value ? value : child,
                 BadProperty{"100%", std::string(word), "an angle or a length that is not 0"});
        }
      } else if (name == "frame") {
        if (word == "head")
          info.frame = program::Frame::head;
        else if (word == "torso")
          info.frame = program::Frame::torso;
        else if (word == "jaw")
          info.frame = program::Frame::jaw;
        else if (word == "eyes")
          info.frame = program::Frame::eyes;
        else
          report(d, value ? value : child, BadProperty{"frame", std::string(word), "head, torso, jaw or eyes"});
      } else if (name == "motion") {
        static constexpr std::string_view kWords[] = {"rotate_x",    "rotate_y",    "rotate_z",
                                                      "translate_x", "translate_y", "translate_z"};
        const auto* it = std::find(std::begin(kWords), std::end(kWords), word);
        if (it != std::end(kWords))
          info.motion = static_cast<program::Motion>(it - std::begin(kWords) + 1);
        else
          report(d, value ? value : child,
                 BadProperty{"motion", std::string(word), "rotate_x, _y, _z or translate_x, _y, _z"});
      } else {
        report(d, child.at(0), UnknownProperty{std::string(name), "an axis", {"track", "100%", "frame", "motion"}});
      }
    }
    if (count != 2) return;  // the parser has said why
    if (info.track == kUnreachable) {
      report(d, d.node.child(NodeKind::name), MissingProperty{"track", "an axis"});
      return;
    }
    info.au = number[0];
    info.positive = fmt::format("AU{}", number[0]);
    info.negative = fmt::format("AU{}", number[1]);
    const auto index = static_cast<std::uint32_t>(axes.size());
    for (int i = 0; i < 2; ++i) {
      for (const UnitInfo& u : axis_units)
        if (u.number == number[i]) {
          report(d, d.node.child(NodeKind::au_token), DuplicateName{"axis", fmt::format("AU{}", number[i])});
          return;
        }
      axis_units.push_back({number[i], false, index, i == 0 ? 1.0 : -1.0, d});
    }
    axes.push_back(std::move(info));
  }

  void units(std::vector<UnitInfo>& axis_units) {
    struct Found {
      UnitInfo unit;
      std::string title;
      std::uint32_t track;
    };
    std::vector<Found> found;
    for (const Declaration& d : declarations_.units) {
      const auto q = lang::read_quantity(d.name);
      if (!q || q->unit != Unit::none || q->value < 1.0 || q->value > 999.0 ||
          static_cast<double>(static_cast<int>(q->value)) != q->value) {
        report(d, d.node.child(NodeKind::quantity), OutOfRange{std::string(d.name), "the whole numbers 1 to 999"});
        continue;
      }
      const auto number = static_cast<std::uint16_t>(q->value);
      if (std::any_of(found.begin(), found.end(), [&](const Found& f) { return f.unit.number == number; })) continue;
      const NodeRef title = d.node.child(NodeKind::string);
      Found f{{number, d.node.child(NodeKind::sides).exists(), 0, 1.0, d},
              title ? unquoted(title) : std::string(),
              kUnreachable};
      for (NodeRef p : d.node.children())
        if (is_property(p) && p.at(0).text() == "track") f.track = track_of(d, p);
      const auto axis_unit =
          std::find_if(axis_units.begin(), axis_units.end(), [&](const UnitInfo& u) { return u.number == number; });
      if (axis_unit != axis_units.end()) {
        axis_unit->declaration = d;
        f.track = kUnreachable;
        found.push_back(std::move(f));  // keeps the number taken; it makes no channel of its own
        continue;
      }
      if (f.track == kUnreachable) {
        report(d, d.node.child(NodeKind::quantity), MissingProperty{"track", fmt::format("AU{}", number)});
        continue;
      }
      found.push_back(std::move(f));
    }
    std::sort(found.begin(), found.end(), [](const Found& a, const Found& b) { return a.unit.number < b.unit.number; });
    for (Found& f : found) {
      if (f.track == kUnreachable) continue;
      f.unit.channel = static_cast<std::uint32_t>(out_.channels.size());
      for (const program::Side side : {program::Side::left, program::Side::right}) {
        if (!f.unit.sided && side == program::Side::right) break;
        ChannelInfo c;
        c.side = f.unit.sided ? side : program::Side::none;
        c.name = fmt::format("AU{}{}", f.unit.number, !f.unit.sided ? "" : side == program::Side::left ? "L" : "R");
        c.title = f.title;
        c.track = f.track;
        c.au = f.unit.number;
        out_.channels.push_back(std::move(c));
      }
      out_.units.push_back(f.unit);
    }
  }

  const std::vector<LoadedFile>& files_;
  const Declarations& declarations_;
  lang::Diagnostics& diagnostics_;
  Channels out_;
  std::vector<std::pair<std::uint16_t, std::uint32_t>> unit_channel_;
};

}  // namespace

bool is_unit_property(std::string_view name) {
  for (const std::string_view known : {"track", "antagonists", "contrary", "hides", "longest"})
    if (name == known) return true;
  return false;
}

Channels build_channels(const std::vector<LoadedFile>& files, const Declarations& declarations,
                        lang::Diagnostics& diagnostics) {
  return Builder(files, declarations, diagnostics).build();
}

}  // namespace nms::compiler
