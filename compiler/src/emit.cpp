#include "emit.h"

#include <algorithm>
#include <cstring>

#include <fmt/format.h>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include "utf8.h"

namespace nms::compiler {
namespace {

float narrowed(double value, double low) {
  const double held = value < low ? low : value > 1.0 ? 1.0 : value;
  return static_cast<float>(held) + 0.0F;  // -0 becomes 0
}

/// Collects what a clip's bytes say, in a form that does not depend on where in the program they stand.
class ContentHash {
 public:
  void text(std::string_view s) {
    number(static_cast<std::int64_t>(s.size()));
    bytes_.insert(bytes_.end(), s.begin(), s.end());
  }
  void number(std::int64_t v) { append(&v, sizeof v); }
  void real(float v) { append(&v, sizeof v); }
  [[nodiscard]] std::uint64_t value() const { return XXH3_64bits(bytes_.data(), bytes_.size()); }

 private:
  void append(const void* p, std::size_t n) {
    const auto* c = static_cast<const char*>(p);
    bytes_.insert(bytes_.end(), c, c + n);
  }
  std::vector<char> bytes_;
};

}  // namespace

program::StringId Emitter::string(std::string_view text) {
  if (text.empty()) return program::StringId{0};
  const auto [it, added] = strings_.try_emplace(std::string(text), static_cast<std::uint32_t>(draft.strings.size()));
  if (added) draft.strings.emplace_back(text);
  return program::StringId{it->second};
}

program::StringId Emitter::path(std::string_view text) {
  std::string shown(text);
  // A file's name may be any bytes; a program's strings are text.
  for (std::size_t bad = first_not_utf8(shown); bad != shown.size(); bad = first_not_utf8(shown)) shown[bad] = '?';
  return string(shown);
}

void Emitter::channels(const Channels& channels) {
  for (const TrackInfo& t : channels.tracks) draft.tracks.push_back({string(t.name), t.merge, {}});
  for (const ChannelInfo& c : channels.channels) {
    program::Channel out;
    out.name = string(c.name);
    out.title = string(c.title);
    out.positive = string(c.positive);
    out.negative = string(c.negative);
    out.track = c.track;
    constexpr double kRadian = 0.017453292519943295;  // pi / 180
    out.full_scale = c.unit == lang::Unit::angle    ? static_cast<float>(c.full_scale * kRadian)
                     : c.unit == lang::Unit::length ? static_cast<float>(c.full_scale / 1000.0)
                                                    : 0.0F;
    out.au = c.au;
    out.kind = c.kind;
    out.side = c.side;
    out.motion = c.motion;
    out.frame = c.frame;
    draft.channels.push_back(out);
  }
}

std::optional<TooLarge> Emitter::clip(const ClipDraft& clip, const std::vector<MergedCurve>& curves,
                                      const Channels& channels) {
  if (clip.start_ns < -program::kTimeLimit_ns || clip.end_ns > program::kTimeLimit_ns) {
    return TooLarge{"the time that a clip reaches to", fmt::format("{} s", program::kTimeLimit_ns / 1'000'000'000)};
  }
  ContentHash hash;
  program::Clip out;
  out.name = string(clip.name);
  out.kind = clip.kind;
  out.start_ns = clip.start_ns;
  out.end_ns = clip.end_ns;
  hash.text(clip.name);
  hash.number(static_cast<std::int64_t>(clip.kind));
  hash.number(clip.start_ns);
  hash.number(clip.end_ns);

  std::vector<std::uint32_t> source_index(clip.sources.size());
  for (std::size_t i = 0; i < clip.sources.size(); ++i) {
    const lang::Source& source = clip.sources[i].node.tree().source();
    const lang::Position at = source.position(clip.sources[i].node.range().begin);
    source_index[i] = static_cast<std::uint32_t>(draft.sources.size());
    draft.sources.push_back({path(source.path()), at.line, at.column, string(clip.sources[i].entry)});
  }

  out.first_curve = static_cast<std::uint32_t>(draft.curves.size());
  for (const MergedCurve& m : curves) {
    if (m.curve.knots.empty()) continue;
    const double low = channels.channels[m.channel].low();
    hash.text(channels.channels[m.channel].name);
    program::Curve curve{program::ChannelId{m.channel}, static_cast<std::uint32_t>(draft.knots.size()), 0,
                         static_cast<std::uint32_t>(draft.handles.size())};
    shapes_.clear();
    for (std::size_t i = 0; i < m.curve.knots.size(); ++i) {
      const CurveKnot& k = m.curve.knots[i];
      program::Knot knot(k.time_ns, narrowed(k.value, low), program::kShapeHold);
      if (i + 1 < m.curve.knots.size()) {
        const CurveKnot& next = m.curve.knots[i + 1];
        const double third = (next.value - k.value) / 3.0;
        const auto near = [](double a, double b) { return a - b < 1e-12 && b - a < 1e-12; };
        if (next.time_ns == k.time_ns || (k.b1 == k.value && k.b2 == k.value && next.value == k.value)) {
          knot.shape = program::kShapeHold;
        } else if (k.b1 == k.value && k.b2 == next.value) {
          knot.shape = program::kShapeSmooth;
        } else if (near(k.b1, k.value + third) && near(k.b2, k.value + 2.0 * third)) {
          knot.shape = program::kShapeLinear;
        } else if (k.b1 == k.value && k.b2 == k.value && i + 2 < m.curve.knots.size() &&
                   m.curve.knots[i + 2].time_ns == next.time_ns && next.value == k.value) {
          knot.shape = program::kShapeHold;
        } else {
          const auto shape = shapes_.shape({static_cast<float>(k.b1), static_cast<float>(k.b2)}, draft.handles);
          if (!shape) {
            return TooLarge{"the number of different segments of one channel in one clip",
                            fmt::format("{}", program::kShapeFirstReserved)};
          }
          knot.shape = *shape;
        }
        if (knot.shape < program::kShapeFirstReserved) {
          hash.real(static_cast<float>(k.b1));
          hash.real(static_cast<float>(k.b2));
        } else {
          hash.number(0xFFFF0000 + std::int64_t{knot.shape});  // as when shapes had 32 bits: hashes outlive formats
        }
      }
      hash.number(knot.time_ns());
      hash.real(knot.value);
      draft.knots.push_back(knot);
      draft.knot_sources.push_back(k.source < source_index.size() ? source_index[k.source] : program::kNone);
    }
    curve.knot_count = static_cast<std::uint32_t>(draft.knots.size()) - curve.first_knot;
    draft.curves.push_back(curve);
  }
  out.curve_count = static_cast<std::uint32_t>(draft.curves.size()) - out.first_curve;

  std::vector<DraftMarker> markers = clip.markers;
  std::stable_sort(markers.begin(), markers.end(),
                   [](const DraftMarker& a, const DraftMarker& b) { return a.time_ns < b.time_ns; });
  out.first_marker = static_cast<std::uint32_t>(draft.markers.size());
  out.marker_count = static_cast<std::uint32_t>(markers.size());
  for (const DraftMarker& m : markers) {
    draft.markers.push_back({m.time_ns, string(m.name), m.kind, m.hand, {}});
    hash.number(m.time_ns);
    hash.text(m.name);
    hash.number(static_cast<std::int64_t>(m.kind));
  }
  out.content_hash = hash.value();
  draft.clips.push_back(out);
  return std::nullopt;
}

}  // namespace nms::compiler
