#include "plot_svg.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "decimal_seconds.h"
#include "tiers.h"
#include "xml_text.h"

namespace nms::cli {
namespace {

using program::Channel;
using program::ChannelKind;
using program::Clip;
using program::Curve;
using program::Knot;
using program::MarkerKind;
using program::Program;

constexpr double kGutter = 206.0;       ///< left of the time axis: names
constexpr double kRightMargin = 100.0;  ///< right of it: peaks
constexpr double kBarHeight = 17.0;
constexpr double kSignHeight = 20.0;
constexpr double kLaneHeight = 11.0;  ///< of glosses that do not fit into their boxes
constexpr double kPhaseHeight = 8.0;
constexpr double kRowHeight = 40.0;
constexpr double kLineHeight = 13.0;  ///< of names beside a row
constexpr double kRowGap = 7.0;
constexpr double kGlossSize = 12.0;
constexpr double kSmallestGloss = 9.0;
constexpr std::size_t kMostLanes = 24;    ///< glosses beyond stay as tool tips
constexpr std::size_t kCurvesInARow = 4;  ///< more filled curves over one another cannot be told apart

/// Okabe and Ito's colours, safe for the colour-blind, in an order in which neighbours differ in lightness too.
constexpr std::array<std::string_view, 7> kColours{"#0072B2", "#D55E00", "#009E73", "#B0558B",
                                                   "#B07A00", "#2E8FC4", "#555555"};
/// Curves of one row differ in their dashes, so that they do so in print.
constexpr std::array<std::string_view, kCurvesInARow> kDashes{"", "6 2.5", "1.8 2", "8 2 1.8 2"};

/// Pixels with two digits; never "-0.00".
std::string px(double value) {
  std::string text = fmt::format("{:.2f}", value);
  return text == "-0.00" ? "0.00" : text;
}

std::string escaped(std::string_view text) { return xml_escaped(printable(text)); }

/// How wide text will be, roughly: fonts differ, and capitals are wide.
double text_width(std::string_view text, double size) {
  double em = 0.0;
  for (const char c : text) {
    if ((static_cast<unsigned char>(c) & 0xC0U) == 0x80U) continue;
    const bool wide = (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || static_cast<unsigned char>(c) >= 0x80;
    em += wide ? 0.66 : 0.52;
  }
  return em * size;
}

/// Text cut to a width, with an ellipsis.
std::string cut(std::string text, double size, double width) {
  if (text_width(text, size) <= width) return text;
  while (!text.empty() && text_width(text, size) > width - size) {
    while (!text.empty() && (static_cast<unsigned char>(text.back()) & 0xC0U) == 0x80U) text.pop_back();
    if (!text.empty()) text.pop_back();
  }
  return text + "\xE2\x80\xA6";
}

/// One curve of the picture: a channel, or both sides of one that move as one.
struct Drawn {
  const Curve* curve = nullptr;
  const Channel* channel = nullptr;
  std::string unit;  ///< "AU4", "AU4L", "AU53/54"
  std::string title;
  float highest = 0.0F;
  float lowest = 0.0F;
};

/// Curves that share a row.
struct Row {
  std::uint32_t track = program::kNone;
  bool first_of_track = false;
  std::vector<Drawn> curves;
};

/// Curves of one row have one scale: action units, turns and shifts do not mix.
int quantity_of(const Channel& c) {
  if (c.kind != ChannelKind::axis) return 0;
  const bool shift = c.motion == program::Motion::translate_x || c.motion == program::Motion::translate_y ||
                     c.motion == program::Motion::translate_z;
  return shift ? 2 : 1;
}

class Plot {
 public:
  Plot(const Program& program, const Clip& clip, int width)
      : program_(program), clip_(clip), width_(width), left_(kGutter), right_(width - kRightMargin) {}

  std::string draw() {
    tiers_ = read_tiers(program_, clip_);
    collect_rows();
    text(12.0, 20.0, escaped(cut(printable(program_.string(clip_.name)), 15.0, width_ - 24.0)),
         "font-size=\"15\" font-weight=\"600\"");
    y_ = 44.0;
    time_axis();
    bars();
    signs();
    phases();
    const double top = y_;
    std::string above = std::move(body_);
    body_.clear();
    for (std::size_t i = 0; i < rows_.size(); ++i) row(rows_[i], i);
    std::string rows = std::move(body_);
    body_.clear();
    boundaries(top);
    const double height = y_ + 10.0;
    return fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\" "
        "font-family=\"&quot;Source Sans 3&quot;, Helvetica, Arial, sans-serif\" font-size=\"11\" fill=\"#222222\">\n"
        "<title>{2}</title>\n"
        "<defs><pattern id=\"hold\" width=\"5\" height=\"5\" patternUnits=\"userSpaceOnUse\" "
        "patternTransform=\"rotate(45)\"><rect width=\"5\" height=\"5\" fill=\"#FFFFFF\"/>"
        "<rect width=\"1.2\" height=\"5\" fill=\"#C4C4C4\"/></pattern></defs>\n"
        "<rect width=\"{0}\" height=\"{1}\" fill=\"#FFFFFF\"/>\n{3}{4}{5}</svg>\n",
        width_, px(height), escaped(program_.string(clip_.name)), body_, above, rows);
  }

 private:
  [[nodiscard]] double x(std::int64_t time_ns) const {
    const auto from = static_cast<double>(clip_.start_ns);
    const double length = std::max(static_cast<double>(clip_.end_ns) - from, 1.0);
    return left_ + (static_cast<double>(time_ns) - from) / length * (right_ - left_);
  }

  void text(double at_x, double at_y, std::string_view xml, std::string_view attributes) {
    body_ += fmt::format("<text x=\"{}\" y=\"{}\"{}{}>{}</text>\n", px(at_x), px(at_y), attributes.empty() ? "" : " ",
                         attributes, xml);
  }

  void line(double x1, double y1, double x2, double y2, std::string_view attributes) {
    body_ +=
        fmt::format("<line x1=\"{}\" y1=\"{}\" x2=\"{}\" y2=\"{}\" {}/>\n", px(x1), px(y1), px(x2), px(y2), attributes);
  }

  void time_axis() {
    const std::int64_t length = clip_.end_ns - clip_.start_ns;
    line(left_, y_, right_, y_, "stroke=\"#222222\"");
    // The finest of 1, 2, 5 x 10^k that leaves room for the numbers.
    const auto most = static_cast<std::int64_t>((right_ - left_) / 58.0);
    std::int64_t step = 1;
    for (std::int64_t power = 1; length / step > most && power < 1'000'000'000'000'000'000; power *= 10)
      for (const std::int64_t digit : {1, 2, 5})
        if (length / step > most) step = power * digit;
    std::int64_t t = clip_.start_ns / step * step;
    if (t < clip_.start_ns) t += step;
    for (; t <= clip_.end_ns; t += step) {
      line(x(t), y_, x(t), y_ + 4.0, "stroke=\"#222222\"");
      text(x(t), y_ - 5.0, decimal_seconds(t), "text-anchor=\"middle\" font-size=\"10\"");
      if (t > clip_.end_ns - step) break;  // the next would not fit into 64 bits, or not into the clip
    }
    text(right_ + 10.0, y_ + 3.5, "s", "font-size=\"10\"");
    y_ += 14.0;
  }

  void bars() {
    if (tiers_.uses.empty()) return;
    std::vector<Stretch> extents;
    for (const TierSpan& use : tiers_.uses) {
      // A label longer than its bar stands out to the left: that room is taken too.
      const double end = x(use.end_ns);
      extents.push_back({std::min(x(use.start_ns), end - text_width(use.name, 11.0)), end});
    }
    const std::vector<std::size_t> level = stack_by_nesting(extents);
    const std::size_t levels = *std::max_element(level.begin(), level.end()) + 1;
    for (std::size_t i = 0; i < tiers_.uses.size(); ++i) {
      const TierSpan& use = tiers_.uses[i];
      const double bar_y = y_ + kBarHeight * static_cast<double>(levels - level[i]);
      const double x1 = x(use.start_ns);
      const double x2 = x(use.end_ns);
      body_ += fmt::format("<path d=\"M{0} {3}V{2}H{1}V{3}\" fill=\"none\" stroke=\"#222222\" stroke-width=\"1.3\"/>\n",
                           px(x1), px(x2), px(bar_y), px(bar_y + 3.0));
      text(x2, bar_y - 3.0, escaped(use.name), "text-anchor=\"end\" font-size=\"11\"");
    }
    text(12.0, y_ + kBarHeight * static_cast<double>(levels) + 2.0, "non-manual signs", "fill=\"#666666\"");
    y_ += kBarHeight * static_cast<double>(levels) + 10.0;
  }

  void signs() {
    if (tiers_.signs.empty()) return;
    const bool two_handed = tiers_.two_handed();
    std::vector<double> lane_end;
    const double boxes_end = y_ + (kSignHeight + 3.0) * (two_handed ? 2.0 : 1.0);
    std::string boxes;
    for (std::size_t i = 0; i < tiers_.signs.size(); ++i) {
      const TierSpan& s = tiers_.signs[i];
      const double top = y_ + (kSignHeight + 3.0) * (two_handed && s.hand == program::Hand::other ? 1.0 : 0.0);
      const double x1 = x(s.start_ns);
      const double x2 = x(s.end_ns);
      const double hold = x(s.stroke_end_ns);
      body_ += fmt::format("<g><title>{} {}\xE2\x80\x93{} s</title>", escaped(s.name), decimal_seconds(s.start_ns),
                           decimal_seconds(s.end_ns));
      body_ += fmt::format("<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"#E6E6E6\"/>", px(x1), px(top),
                           px(hold - x1), px(kSignHeight));
      if (hold < x2)
        body_ += fmt::format("<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"url(#hold)\"/>", px(hold),
                             px(top), px(x2 - hold), px(kSignHeight));
      body_ += fmt::format(
          "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"#444444\" stroke-width=\"0.8\"/>"
          "</g>\n",
          px(x1), px(top), px(x2 - x1), px(kSignHeight));
      // The gloss: in its box, then smaller in its box, then below it in the first lane with room.
      const double centre = (x1 + x2) / 2.0;
      const double room = x2 - x1 - 4.0;
      const double natural = text_width(s.name, kGlossSize);
      const double size = natural <= room ? kGlossSize : kGlossSize * room / natural;
      if (size >= kSmallestGloss) {
        text(centre, top + kSignHeight / 2.0 + size * 0.36, escaped(s.name),
             fmt::format("text-anchor=\"middle\" font-size=\"{:.1f}\" stroke=\"#FFFFFF\" stroke-opacity=\"0.7\" "
                         "stroke-width=\"2.5\" paint-order=\"stroke\"",
                         size));
        continue;
      }
      const double half = text_width(s.name, kSmallestGloss) / 2.0;
      std::size_t lane = 0;
      while (lane < lane_end.size() && lane_end[lane] > centre - half) ++lane;
      if (lane >= kMostLanes) continue;
      if (lane == lane_end.size()) lane_end.push_back(0.0);
      lane_end[lane] = centre + half + 4.0;
      const double base = boxes_end + kLaneHeight * static_cast<double>(lane + 1);
      line(centre, top + kSignHeight, centre, base - 8.0, "stroke=\"#BBBBBB\" stroke-width=\"0.5\"");
      boxes += fmt::format(
          "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\" font-size=\"{:.1f}\" stroke=\"#FFFFFF\" stroke-width=\"2.5\" "
          "paint-order=\"stroke\">{}</text>\n",
          px(centre), px(base), kSmallestGloss, escaped(s.name));
    }
    body_ += boxes;
    text(12.0, y_ + 14.0, "signs", "fill=\"#666666\"");
    if (two_handed) text(12.0, y_ + kSignHeight + 17.0, "other hand", "fill=\"#666666\"");
    y_ = boxes_end + kLaneHeight * static_cast<double>(lane_end.size()) + 8.0;
  }

  void phases() {
    struct Kind {
      MarkerKind kind;
      std::string_view name;
    };
    constexpr std::array kKinds{Kind{MarkerKind::onset, "onset"}, Kind{MarkerKind::apex, "apex"},
                                Kind{MarkerKind::release, "release"}, Kind{MarkerKind::offset, "offset"},
                                Kind{MarkerKind::mark, "mark"}};
    const auto markers = program_.markers.subspan(clip_.first_marker, clip_.marker_count);
    const double before = y_;
    for (const Kind& kind : kKinds) {
      bool any = false;
      for (const program::Marker& m : markers) {
        if (m.kind != kind.kind) continue;
        if (!any) {
          text(left_ - 8.0, y_ + kPhaseHeight - 1.5, kind.name,
               "text-anchor=\"end\" font-size=\"8.5\" fill=\"#666666\"");
          line(left_, y_ + kPhaseHeight, right_, y_ + kPhaseHeight, "stroke=\"#E2E2E2\" stroke-width=\"0.6\"");
        }
        any = true;
        body_ += fmt::format("<path d=\"M{} {}V{}\" stroke=\"#444444\"><title>{} {} {} s</title></path>\n",
                             px(x(m.time_ns)), px(y_ + 2.0), px(y_ + kPhaseHeight), kind.name,
                             escaped(program_.string(m.name)), decimal_seconds(m.time_ns));
      }
      if (any) y_ += kPhaseHeight + 1.0;
    }
    if (y_ != before) {
      text(12.0, before + kPhaseHeight, "phases", "fill=\"#666666\"");
      y_ += 10.0;
    }
  }

  /// Lines through all rows where signs begin and end.
  void boundaries(double top) {
    if (tiers_.signs.empty() || rows_.empty()) return;
    const double width = tiers_.signs.size() > 40 ? 0.3 : 0.6;
    std::vector<std::int64_t> times;
    for (const TierSpan& s : tiers_.signs) times.insert(times.end(), {s.start_ns, s.end_ns});
    std::sort(times.begin(), times.end());
    times.erase(std::unique(times.begin(), times.end()), times.end());
    for (const std::int64_t t : times)
      line(x(t), top, x(t), y_, fmt::format("stroke=\"#BDBDBD\" stroke-width=\"{}\"", width));
  }

  // ---- Curves

  /// The inner Bézier values of the segment from knot i of a curve to the next. Nothing: a hold.
  [[nodiscard]] std::optional<program::Handles> inner(const Curve& c, const Knot& a, const Knot& b) const {
    if (a.shape == program::kShapeHold || a.time_ns() == b.time_ns()) return std::nullopt;
    if (a.shape == program::kShapeSmooth) return program::Handles{a.value, b.value};
    if (a.shape == program::kShapeLinear) {
      const float third = (b.value - a.value) / 3.0F;
      return program::Handles{a.value + third, b.value - third};
    }
    return program_.handles_of(c, a);
  }

  [[nodiscard]] std::span<const Knot> knots(const Curve& c) const {
    return program_.knots.subspan(c.first_knot, c.knot_count);
  }

  [[nodiscard]] bool same(const Curve& a, const Curve& b) const {
    const auto ka = knots(a);
    const auto kb = knots(b);
    if (ka.size() != kb.size()) return false;
    for (std::size_t i = 0; i < ka.size(); ++i) {
      if (ka[i].time_ns() != kb[i].time_ns() || ka[i].value != kb[i].value) return false;
      if (i + 1 == ka.size()) break;
      const auto ha = inner(a, ka[i], ka[i + 1]);
      const auto hb = inner(b, kb[i], kb[i + 1]);
      if (ha.has_value() != hb.has_value() || (ha && (ha->b1 != hb->b1 || ha->b2 != hb->b2))) return false;
    }
    return true;
  }

  /// The extremes, those between knots too: roots of the cubic's derivative.
  void find_extremes(Drawn& d) const {
    const auto ks = knots(*d.curve);
    d.highest = d.lowest = ks[0].value;
    const auto take = [&](double v) {
      d.highest = std::max(d.highest, static_cast<float>(v));
      d.lowest = std::min(d.lowest, static_cast<float>(v));
    };
    for (std::size_t i = 0; i < ks.size(); ++i) {
      take(ks[i].value);
      const auto h = i + 1 < ks.size() ? inner(*d.curve, ks[i], ks[i + 1]) : std::nullopt;
      if (!h) continue;
      const double v0 = ks[i].value;
      const double b1 = h->b1;
      const double b2 = h->b2;
      const double v1 = ks[i + 1].value;
      const double a = v1 - v0 + 3.0 * (b1 - b2);
      const double b = 2.0 * (v0 - 2.0 * b1 + b2);
      const double c = b1 - v0;
      const auto at = [&](double u) {
        if (u <= 0.0 || u >= 1.0) return;
        const double w = 1.0 - u;
        take(w * w * w * v0 + 3.0 * w * w * u * b1 + 3.0 * w * u * u * b2 + u * u * u * v1);
      };
      if (a == 0.0) {
        if (b != 0.0) at(-c / b);
        continue;
      }
      const double under = b * b - 4.0 * a * c;
      if (under < 0.0) continue;
      const double root = std::sqrt(under);
      at((-b + root) / (2.0 * a));
      at((-b - root) / (2.0 * a));
    }
  }

  void collect_rows() {
    const auto curves = program_.curves.subspan(clip_.first_curve, clip_.curve_count);
    std::vector<bool> done(curves.size());
    std::vector<Drawn> all;
    for (std::size_t i = 0; i < curves.size(); ++i) {
      if (done[i]) continue;
      const Channel& c = program_.channels[static_cast<std::size_t>(curves[i].channel)];
      Drawn d{&curves[i], &c, std::string(program_.string(c.name)), std::string(program_.string(c.title))};
      if (c.kind == ChannelKind::axis) {
        std::string_view negative = program_.string(c.negative);
        if (negative.starts_with("AU")) negative.remove_prefix(2);
        d.unit = fmt::format("{}/{}", program_.string(c.positive), negative);
        d.title = program_.string(c.name);
        std::replace(d.title.begin(), d.title.end(), '_', ' ');
      } else if (c.side != program::Side::none) {
        for (std::size_t j = i + 1; j < curves.size(); ++j) {
          const Channel& other = program_.channels[static_cast<std::size_t>(curves[j].channel)];
          if (other.au != c.au || other.kind != c.kind || other.side == c.side || other.side == program::Side::none ||
              !same(curves[i], curves[j]))
            continue;
          done[j] = true;
          d.unit = fmt::format("AU{}", c.au);
          break;
        }
      }
      find_extremes(d);
      all.push_back(std::move(d));
    }
    std::stable_sort(all.begin(), all.end(), [](const Drawn& a, const Drawn& b) {
      if (a.channel->track != b.channel->track) return a.channel->track < b.channel->track;
      return quantity_of(*a.channel) < quantity_of(*b.channel);
    });
    // What is too much for one row goes to several of the same height.
    for (std::size_t i = 0; i < all.size();) {
      std::size_t end = i;
      while (end < all.size() && all[end].channel->track == all[i].channel->track &&
             quantity_of(*all[end].channel) == quantity_of(*all[i].channel))
        ++end;
      const std::size_t parts = (end - i + kCurvesInARow - 1) / kCurvesInARow;
      const std::size_t each = (end - i + parts - 1) / parts;
      for (; i < end; i = std::min(i + each, end)) {
        Row row;
        row.track = all[i].channel->track;
        row.first_of_track = rows_.empty() || rows_.back().track != row.track;
        for (std::size_t k = i; k < std::min(i + each, end); ++k) row.curves.push_back(all[k]);
        rows_.push_back(std::move(row));
        if (i + each >= end) {
          i = end;
          break;
        }
      }
    }
  }

  /// Full height of a row: 100 % for action units; head, gaze and torso move by small shares of what they could.
  [[nodiscard]] static float scale_of(const Row& row) {
    float most = 0.0F;
    for (const Drawn& d : row.curves) most = std::max({most, d.highest, -d.lowest});
    if (row.curves.front().channel->kind == ChannelKind::axis)
      for (const float bound : {0.05F, 0.1F, 0.2F, 0.5F})
        if (most <= bound) return bound;
    return 1.0F;
  }

  [[nodiscard]] std::string path(const Curve& curve, double zero, double unit) const {
    const auto y = [&](float v) { return px(zero - static_cast<double>(v) * unit); };
    const auto ks = knots(curve);
    std::string d = fmt::format("M{} {}", px(x(std::min(clip_.start_ns, ks[0].time_ns()))), y(ks[0].value));
    if (ks[0].time_ns() > clip_.start_ns) d += fmt::format("H{}", px(x(ks[0].time_ns())));
    for (std::size_t i = 0; i + 1 < ks.size(); ++i) {
      const Knot& a = ks[i];
      const Knot& b = ks[i + 1];
      if (const auto h = inner(curve, a, b)) {
        // Time runs evenly along a segment: its inner control points stand at the thirds.
        const double third = (x(b.time_ns()) - x(a.time_ns())) / 3.0;
        d += fmt::format("C{} {} {} {} {} {}", px(x(a.time_ns()) + third), y(h->b1), px(x(b.time_ns()) - third),
                         y(h->b2), px(x(b.time_ns())), y(b.value));
      } else {
        if (a.time_ns() != b.time_ns()) d += fmt::format("H{}", px(x(b.time_ns())));
        if (a.value != b.value) d += fmt::format("V{}", y(b.value));
      }
    }
    if (ks.back().time_ns() < clip_.end_ns) d += fmt::format("H{}", px(x(clip_.end_ns)));
    return d;
  }

  /// The greatest value: a share of the FACS maximum; of an axis, what it turns or shifts.
  [[nodiscard]] std::string peak(const Drawn& d) const {
    const bool down = -d.lowest > d.highest;
    const double value = down ? -static_cast<double>(d.lowest) : static_cast<double>(d.highest);
    if (d.channel->kind != ChannelKind::axis || value == 0.0) return fmt::format("{:.0f} %", value * 100.0);
    const std::string_view unit = program_.string(down ? d.channel->negative : d.channel->positive);
    const double full = std::abs(static_cast<double>(d.channel->full_scale));
    switch (d.channel->motion) {
      case program::Motion::rotate_x:
      case program::Motion::rotate_y:
      case program::Motion::rotate_z:
        return fmt::format("{} {:.1f}\xC2\xB0", unit, value * full * 57.29577951308232);
      case program::Motion::translate_x:
      case program::Motion::translate_y:
      case program::Motion::translate_z:
        return fmt::format("{} {:.1f} mm", unit, value * full * 1000.0);
      case program::Motion::none:
        break;
    }
    return fmt::format("{} {:.0f} %", unit, value * 100.0);
  }

  void row(const Row& row, std::size_t index) {
    if (row.first_of_track) {
      if (index != 0) y_ += 4.0;
      const std::string_view name = row.track < program_.tracks.size()
                                        ? program_.string(program_.tracks[row.track].name)
                                        : std::string_view("no track");
      text(12.0, y_ + 9.0, escaped(cut(printable(name), 11.0, 60.0)), "font-weight=\"600\"");
    }
    const std::string_view colour = kColours[row.track % kColours.size()];
    const double lines = kLineHeight * static_cast<double>(row.curves.size());
    const bool is_signed = row.curves.front().channel->kind == ChannelKind::axis;
    // Names of axes are longer: they stand below the track's.
    const double names = y_ + (row.first_of_track ? 14.0 : 0.0);
    const double height = std::max(kRowHeight, names - y_ + lines);
    const double zero = is_signed ? y_ + height / 2.0 : y_ + height;
    const float scale = scale_of(row);
    const double unit = (is_signed ? height / 2.0 : height) / static_cast<double>(scale);

    body_ += fmt::format(
        "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"#DDDDDD\" stroke-width=\"0.6\"/>\n",
        px(left_), px(y_), px(right_ - left_), px(height));
    line(left_, zero, right_, zero, "stroke=\"#888888\" stroke-width=\"0.6\"");
    text(left_ - 4.0, y_ + 6.5, fmt::format("{}{:.0f} %", is_signed ? "\xC2\xB1" : "", scale * 100.0F),
         "text-anchor=\"end\" font-size=\"8\" fill=\"#888888\"");

    for (std::size_t i = 0; i < row.curves.size(); ++i) {
      const Drawn& d = row.curves[i];
      // A curve that lies on another is drawn once: both names get its line.
      std::size_t style = 0;
      while (style < i && !same(*row.curves[style].curve, *d.curve)) ++style;
      const std::string dashes =
          kDashes[style].empty() ? std::string() : fmt::format(" stroke-dasharray=\"{}\"", kDashes[style]);
      if (style == i) {
        const std::string outline = path(*d.curve, zero, unit);
        body_ += fmt::format("<path d=\"{}V{}H{}Z\" fill=\"{}\" fill-opacity=\"0.13\"/>\n", outline, px(zero),
                             px(left_), colour);
        body_ += fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.5\"{}/>\n", outline, colour,
                             dashes);
      }
      const double at = names + kLineHeight * static_cast<double>(i) + 9.0;
      line(12.0, at - 3.5, 32.0, at - 3.5, fmt::format("stroke=\"{}\" stroke-width=\"1.5\"{}", colour, dashes));
      // The first line of a row that goes on with its track stands beside the scale.
      const double scale_room = i == 0 && !row.first_of_track ? 26.0 : 0.0;
      const double room = left_ - 6.0 - scale_room - 38.0 - text_width(d.unit, 11.0) - 4.0;
      text(38.0, at,
           fmt::format("<tspan font-weight=\"600\">{}</tspan> {}", escaped(d.unit),
                       escaped(cut(printable(d.title), 10.0, room))),
           "font-size=\"10.5\"");
      line(right_ + 4.0, at - 3.5, right_ + 14.0, at - 3.5,
           fmt::format("stroke=\"{}\" stroke-width=\"1.5\"{}", colour, dashes));
      text(right_ + 18.0, at, escaped(peak(d)), "font-size=\"10\"");
    }
    y_ += height + kRowGap;
  }

  const Program& program_;
  const Clip& clip_;
  int width_;
  double left_;
  double right_;
  double y_ = 0.0;
  Tiers tiers_;
  std::vector<Row> rows_;
  std::string body_;
};

}  // namespace

std::string plot_svg(const Program& program, const Clip& clip, int width) { return Plot(program, clip, width).draw(); }

}  // namespace nms::cli
