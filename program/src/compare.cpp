#include <nms/program/compare.h>

#include <algorithm>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include <nms/program/enum_names.h>

#include "curve_features.h"

namespace nms::program {
namespace {

std::string_view channel_name(const Program& p, const Curve& curve) {
  return p.string(p.channels[static_cast<std::size_t>(curve.channel)].name);
}

std::string track_name(const Program& p, const Channel& channel) {
  return channel.track == kNone ? std::string() : std::string(p.string(p.tracks[channel.track].name));
}

/// All that a clip plays, and nothing of what it is called: equal for two clips that play alike.
std::string content_of(const Program& p, const Clip& clip) {
  std::string out = fmt::format("{} {} {}\n", static_cast<int>(clip.kind), clip.start_ns, clip.end_ns);
  for (const Curve& curve : p.curves.subspan(clip.first_curve, clip.curve_count)) {
    fmt::format_to(std::back_inserter(out), "{}\n", channel_name(p, curve));
    for (const Knot& k : p.knots.subspan(curve.first_knot, curve.knot_count)) {
      const Handles h = k.shape < kShapeFirstReserved ? p.handles_of(curve, k) : Handles{};
      const int shape = k.shape < kShapeFirstReserved ? 0 : k.shape;
      fmt::format_to(std::back_inserter(out), "{} {} {} {} {}\n", k.time_ns(), k.value, shape, h.b1, h.b2);
    }
  }
  return out;
}

/// A name, and how many of that name came before: programs from elsewhere may have several.
using Nth = std::pair<std::string_view, int>;

class Counter {
 public:
  Nth operator()(std::string_view name) { return {name, seen_[name]++}; }

 private:
  std::map<std::string_view, int> seen_;
};

/// A sign or a use by its name and what it marks; of one name, the first to start is the first.
using MarkKey = std::pair<std::string, MarkerKind>;

std::vector<std::pair<MarkKey, std::int64_t>> marks_of(const Program& p, const Clip& clip) {
  std::vector<std::pair<MarkKey, std::int64_t>> out;
  std::map<MarkKey, int> seen;
  for (const Marker& m : p.markers.subspan(clip.first_marker, clip.marker_count)) {
    if (m.kind == MarkerKind::onset || m.kind == MarkerKind::apex || m.kind == MarkerKind::offset ||
        m.kind == MarkerKind::release)
      continue;  // they follow from the curves
    std::string name(p.string(m.name));
    if (m.hand == Hand::other) name += " (other hand)";
    const int nth = ++seen[{name, m.kind}];
    if (nth > 1) name += fmt::format(" ({})", nth);
    out.push_back({{std::move(name), m.kind}, m.time_ns});
  }
  return out;
}

class Comparison {
 public:
  Comparison(const Program& before, const Program& after, const CompareTolerance& tolerance)
      : before_(before), after_(after), tolerance_(tolerance) {}

  std::vector<Difference> run() {
    std::map<Nth, const Clip*> old;
    Counter count_old;
    for (const Clip& c : before_.clips) old[count_old(before_.string(c.name))] = &c;
    std::vector<std::pair<const Clip*, const Clip*>> pairs;  // the first is null: a new one
    Counter count_new;
    for (const Clip& c : after_.clips) {
      const auto it = old.find(count_new(after_.string(c.name)));
      pairs.push_back({it == old.end() ? nullptr : it->second, &c});
      if (it != old.end()) old.erase(it);
    }
    // Clips that are gone, by what they play: one of them may go by another name now.
    std::vector<const Clip*> gone;
    for (const auto& [name, clip] : old) gone.push_back(clip);
    std::sort(gone.begin(), gone.end());  // in the order of the program's table
    std::map<std::string, std::vector<const Clip*>> by_content;
    for (auto it = gone.rbegin(); it != gone.rend(); ++it) by_content[content_of(before_, **it)].push_back(*it);
    for (const auto& [was, is] : pairs) {
      if (was != nullptr) {
        clip(*was, *is);
        continue;
      }
      Difference& d = add(Property::added, *is);
      const auto same = by_content.find(content_of(after_, *is));
      if (same == by_content.end() || same->second.empty() || is->curve_count == 0) continue;
      const Clip* renamed = same->second.back();
      d.property = Property::renamed;
      d.before_name = before_.string(renamed->name);
      d.after_name = d.clip;
      gone.erase(std::find(gone.begin(), gone.end(), renamed));
      same->second.pop_back();
    }
    for (const Clip* c : gone) out_.push_back({Property::removed, std::string(before_.string(c->name)), {}, {}, {}});
    channels();
    return std::move(out_);
  }

 private:
  Difference& add(Property property, const Clip& clip) {
    out_.push_back({property, std::string(after_.string(clip.name)), {}, {}, {}});
    return out_.back();
  }

  void time(Property property, const Clip& clip, std::int64_t a, std::int64_t b) {
    if (b - a <= tolerance_.time_ns && a - b <= tolerance_.time_ns) return;
    Difference& d = add(property, clip);
    d.before = static_cast<double>(a);
    d.after = static_cast<double>(b);
  }

  void clip(const Clip& a, const Clip& b) {
    if (a.kind != b.kind) {
      Difference& d = add(Property::kind, b);
      d.before_name = enum_name(a.kind);
      d.after_name = enum_name(b.kind);
    }
    time(Property::start, b, a.start_ns, b.start_ns);
    time(Property::end, b, a.end_ns, b.end_ns);
    marks(a, b);
    curves(a, b);
  }

  void marks(const Clip& a, const Clip& b) {
    const auto old = marks_of(before_, a);
    std::map<MarkKey, std::int64_t> left(old.begin(), old.end());
    const auto mark = [&](const MarkKey& key) -> Difference& {
      Difference& d = add(Property::sign, b);
      d.marker = key.first;
      d.marker_kind = key.second;
      return d;
    };
    for (const auto& [key, time_ns] : marks_of(after_, b)) {
      const auto it = left.find(key);
      if (it == left.end()) {
        Difference& d = mark(key);
        d.has_before = false;
        d.after = static_cast<double>(time_ns);
        continue;
      }
      const std::int64_t moved = time_ns - it->second;
      if (moved > tolerance_.time_ns || -moved > tolerance_.time_ns) {
        Difference& d = mark(key);
        d.before = static_cast<double>(it->second);
        d.after = static_cast<double>(time_ns);
      }
      left.erase(it);
    }
    for (const auto& [key, time_ns] : old) {
      if (left.count(key) == 0) continue;
      Difference& d = mark(key);
      d.has_after = false;
      d.before = static_cast<double>(time_ns);
    }
  }

  /// The curves of both clips side by side; two sides that changed alike are told as one.
  void curves(const Clip& a, const Clip& b) {
    std::map<Nth, const Curve*> old;
    Counter count_old;
    for (const Curve& c : before_.curves.subspan(a.first_curve, a.curve_count))
      old[count_old(channel_name(before_, c))] = &c;
    std::vector<Difference> left_side;
    std::string_view left_name;
    Counter count_new;
    for (const Curve& c : after_.curves.subspan(b.first_curve, b.curve_count)) {
      const Channel& channel = after_.channels[static_cast<std::size_t>(c.channel)];
      const std::string_view name = after_.string(channel.name);
      const auto it = old.find(count_new(name));
      std::vector<Difference> found = curve(b, it == old.end() ? nullptr : it->second, &c, channel, after_);
      if (it != old.end()) old.erase(it);
      join_sides(left_name, left_side, name, channel, std::move(found));
    }
    flush(left_side);
    left_name = {};
    std::vector<const Curve*> gone;
    for (const auto& [name, c] : old) gone.push_back(c);
    std::sort(gone.begin(), gone.end());  // in the order of the program's table
    for (const Curve* c : gone) {
      const Channel& channel = before_.channels[static_cast<std::size_t>(c->channel)];
      join_sides(left_name, left_side, before_.string(channel.name), channel, curve(b, c, nullptr, channel, before_));
    }
    flush(left_side);
  }

  void flush(std::vector<Difference>& held) {
    for (Difference& d : held) out_.push_back(std::move(d));
    held.clear();
  }

  void join_sides(std::string_view& left_name, std::vector<Difference>& left, std::string_view name,
                  const Channel& channel, std::vector<Difference> found) {
    const std::string_view stem = name.substr(0, name.empty() ? 0 : name.size() - 1);
    const bool pair = channel.side == Side::right && !left_name.empty() &&
                      stem == left_name.substr(0, left_name.size() - 1) && left.size() == found.size();
    bool alike = pair;
    for (std::size_t i = 0; alike && i < left.size(); ++i)
      alike =
          left[i].property == found[i].property && left[i].before == found[i].before && left[i].after == found[i].after;
    if (alike) {
      for (Difference& d : left) d.channel = stem;
      found.clear();
    }
    flush(left);
    left = std::move(found);
    left_name = channel.side == Side::left ? name : std::string_view();
    if (channel.side != Side::left) flush(left);
  }

  std::vector<Difference> curve(const Clip& clip, const Curve* a, const Curve* b, const Channel& channel,
                                const Program& of) {
    std::vector<Difference> found;
    const auto say = [&](Property property, double before, double after) {
      Difference d{property,
                   std::string(after_.string(clip.name)),
                   track_name(of, channel),
                   std::string(of.string(channel.name)),
                   {}};
      d.before = before;
      d.after = after;
      found.push_back(std::move(d));
    };
    const CurveFeatures x = a != nullptr ? curve_features(before_, *a, tolerance_.value) : CurveFeatures{};
    const CurveFeatures y = b != nullptr ? curve_features(after_, *b, tolerance_.value) : CurveFeatures{};
    if (a == nullptr) {
      say(Property::channel_added, 0.0, y.peak);
      return found;
    }
    if (b == nullptr) {
      say(Property::channel_removed, x.peak, 0.0);
      return found;
    }
    const auto time = [&](Property property, std::int64_t s, std::int64_t t) {
      if (t - s > tolerance_.time_ns || s - t > tolerance_.time_ns)
        say(property, static_cast<double>(s), static_cast<double>(t));
    };
    if (x.peak - y.peak > tolerance_.value || y.peak - x.peak > tolerance_.value) say(Property::peak, x.peak, y.peak);
    time(Property::onset, x.onset_ns, y.onset_ns);
    time(Property::apex, x.apex_ns, y.apex_ns);
    time(Property::release, x.release_ns, y.release_ns);
    time(Property::offset, x.offset_ns, y.offset_ns);
    if (x.swings != y.swings) say(Property::swings, x.swings, y.swings);
    if (!found.empty()) return found;
    const double most = largest_difference(before_, *a, after_, *b, tolerance_.time_ns);
    if (most > tolerance_.value) say(Property::course, 0.0, most);
    return found;
  }

  void channels() {
    std::map<Nth, const Channel*> old;
    Counter count_old;
    for (const Channel& c : before_.channels) old[count_old(before_.string(c.name))] = &c;
    Counter count_new;
    for (const Channel& c : after_.channels) {
      const auto it = old.find(count_new(after_.string(c.name)));
      if (it == old.end()) continue;
      const std::string track = track_name(after_, c);
      const std::string name(after_.string(c.name));
      const double was = static_cast<double>(it->second->full_scale);
      const double is = static_cast<double>(c.full_scale);
      const double scale = std::max(was < 0.0 ? -was : was, is < 0.0 ? -is : is);
      if (was - is > scale * tolerance_.value || is - was > scale * tolerance_.value) {
        out_.push_back({Property::full_scale, {}, track, name, {}});
        out_.back().before = was;
        out_.back().after = is;
      }
      const std::string old_track = track_name(before_, *it->second);
      if (old_track != track) {
        out_.push_back({Property::track, {}, track, name, {}});
        out_.back().before_name = old_track;
        out_.back().after_name = track;
      }
    }
  }

  const Program& before_;
  const Program& after_;
  const CompareTolerance tolerance_;
  std::vector<Difference> out_;
};

}  // namespace

std::vector<Difference> compare(const Program& before, const Program& after, const CompareTolerance& tolerance) {
  return Comparison(before, after, tolerance).run();
}

}  // namespace nms::program
