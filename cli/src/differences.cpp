#include "differences.h"

#include <string_view>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "tiers.h"

namespace nms::cli {
namespace {

using program::Difference;
using program::MarkerKind;
using program::Property;
using Json = nlohmann::ordered_json;

constexpr std::string_view kPropertyNames[] = {
    "added", "removed", "renamed", "kind",    "start",  "end",    "sign",   "channel_added", "channel_removed",
    "peak",  "onset",   "apex",    "release", "offset", "swings", "course", "full_scale",    "track"};

std::string_view property_name(Property p) { return kPropertyNames[static_cast<std::size_t>(p)]; }

bool is_time(Property p) {
  return p == Property::start || p == Property::end || p == Property::sign ||
         (p >= Property::onset && p <= Property::offset);
}

/// Without the noise of floats.
double rounded(double value) {
  const double scaled = value * 1e6;
  if (scaled > 1e15 || scaled < -1e15) return value;
  return static_cast<double>(static_cast<std::int64_t>(scaled + (scaled < 0.0 ? -0.5 : 0.5))) / 1e6;
}

std::string percent(double value) {
  if (value < 1e-7 && value > -1e-7) value = 0.0;
  return fmt::format("{:.3g}%", value * 100.0);
}

std::string seconds(double ns) { return fmt::format("{:.3f}s", ns / 1e9); }

/// "+50ms (0.2s -> 0.25s)"
std::string moved(const Difference& d) {
  return fmt::format("{:+.3g}ms ({} -> {})", (d.after - d.before) / 1e6, seconds(d.before), seconds(d.after));
}

std::string_view marker_words(MarkerKind kind) {
  switch (kind) {
    case MarkerKind::sign_start:
      return "sign {} starts";
    case MarkerKind::stroke_end:
      return "the stroke of {} ends";
    case MarkerKind::sign_end:
      return "sign {} ends";
    case MarkerKind::use_start:
      return "the span of {} starts";
    case MarkerKind::use_end:
      return "the span of {} ends";
    default:
      return "mark {}";
  }
}

std::string words(const Difference& d) {
  switch (d.property) {
    case Property::added:
      return "added";
    case Property::removed:
      return "removed";
    case Property::renamed:
      return fmt::format("was called {}", printable(d.before_name));
    case Property::kind:
      return fmt::format("was of kind {}, is of kind {}", d.before_name, d.after_name);
    case Property::start:
    case Property::end:
      return fmt::format("{} {}", property_name(d.property), moved(d));
    case Property::sign: {
      const std::string what = fmt::format(fmt::runtime(marker_words(d.marker_kind)), printable(d.marker));
      if (!d.has_before) return fmt::format("{}: new, at {}", what, seconds(d.after));
      if (!d.has_after) return fmt::format("{}: gone, was at {}", what, seconds(d.before));
      return fmt::format("{} {}", what, moved(d));
    }
    case Property::channel_added:
      return fmt::format("new, peak {}", percent(d.after));
    case Property::channel_removed:
      return fmt::format("gone, peak was {}", percent(d.before));
    case Property::peak:
      return fmt::format("peak {} -> {}", percent(d.before), percent(d.after));
    case Property::swings:
      return fmt::format("swings {} -> {}", d.before, d.after);
    case Property::course:
      return fmt::format("course differs by up to {}", percent(d.after));
    case Property::full_scale:
      return fmt::format("full scale {:.4g} -> {:.4g}", d.before, d.after);
    case Property::track:
      return fmt::format("was of track {}", printable(d.before_name));
    default:
      return fmt::format("{} {}", property_name(d.property), moved(d));
  }
}

std::string subject(const Difference& d) {
  std::string out = printable(d.clip);
  if (!d.channel.empty()) {
    if (!out.empty()) out += ": ";
    if (!d.track.empty()) out += printable(d.track) + ' ';
    return out + printable(d.channel) + ' ';
  }
  return out + ": ";
}

}  // namespace

std::string differences_text(const AllDifferences& all) {
  std::string out;
  std::string last;
  for (const Difference& d : all.programs) {
    const std::string about = subject(d);
    // One line for what is said of one channel.
    if (about == last && !d.channel.empty()) {
      out.pop_back();
      out += ", ";
    } else {
      out += about;
    }
    out += words(d) + '\n';
    last = about;
  }
  for (const LabelChange& l : all.labels)
    out += fmt::format("{}: label \"{}\" {}\n", printable(l.entry), printable(l.label), l.added ? "added" : "removed");
  return out;
}

std::string differences_json(const AllDifferences& all) {
  Json list = Json::array();
  for (const Difference& d : all.programs) {
    Json one{{"property", std::string(property_name(d.property))}};
    if (!d.clip.empty()) one["clip"] = d.clip;
    if (!d.track.empty()) one["track"] = d.track;
    if (!d.channel.empty()) one["channel"] = d.channel;
    if (d.property == Property::sign) {
      one["marker"] = d.marker;
      one["marker_kind"] = std::string(marker_words(d.marker_kind));
    }
    if (!d.before_name.empty() || !d.after_name.empty()) {
      one["before"] = d.before_name;
      one["after"] = d.after_name;
    } else if (d.property != Property::added && d.property != Property::removed) {
      const double scale = is_time(d.property) ? 1e9 : 1.0;
      one["unit"] = is_time(d.property)                  ? "s"
                    : d.property == Property::swings     ? "count"
                    : d.property == Property::full_scale ? "rad or m"
                                                         : "share";
      if (d.has_before && d.property != Property::course)
        one["before"] = rounded(d.before / scale);
      else
        one["before"] = nullptr;
      if (d.has_after)
        one["after"] = rounded(d.after / scale);
      else
        one["after"] = nullptr;
    }
    list.push_back(std::move(one));
  }
  for (const LabelChange& l : all.labels)
    list.push_back({{"property", l.added ? "label_added" : "label_removed"}, {"clip", l.entry}, {"label", l.label}});
  Json out{{"differences", std::move(list)}};
  return out.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace nms::cli
