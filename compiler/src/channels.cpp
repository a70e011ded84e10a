#include "channels.h"

#include <algorithm>
#include <optional>

#include <fmt/format.h>

#include <nms/compiler/diagnostic_kinds.h>

#include "action_unit.h"

namespace nms::compiler {

using lang::NodeKind;
using lang::NodeRef;
using lang::Quantity;
using lang::Unit;

const UnitInfo* Channels::find_unit(std::uint32_t number) const {
  const auto it = std::lower_bound(units.begin(), units.end(), number,
                                   [](const UnitInfo& u, std::uint32_t n) { return u.number < n; });
  return it != units.end() && it->number == number ? &*it : nullptr;
}

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
    TrackInfo info{std::string(d.name), program::MergeOperator::strongest, 0, 0};
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
      } else {
        report(d, p.at(0), UnknownProperty{std::string(name), "a track", {"merge", "onset", "offset"}});
      }
    }
    out_.tracks.push_back(std::move(info));
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
              std::string(title ? unquoted(title) : std::string_view()),
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

Channels build_channels(const std::vector<LoadedFile>& files, const Declarations& declarations,
                        lang::Diagnostics& diagnostics) {
  return Builder(files, declarations, diagnostics).build();
}

}  // namespace nms::compiler
