#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include <nms/lang/quantity.h>
#include <nms/picture/contact_sheet.h>
#include <nms/picture/render.h>
#include <nms/program/play.h>
#include <nms/runtime/rig.h>

#include "commands.h"
#include "decimal_seconds.h"
#include "face_meshes.h"
#include "loading.h"
#include "not_actuated.h"
#include "output_file.h"
#include "report.h"
#include "tiers.h"
#include "times.h"
#include "unit_titles.h"

namespace nms::cli {
namespace {

constexpr std::size_t kMaxTiles = 400;
constexpr std::size_t kMaxPixels = 64'000'000;  // pictures, sheet and file take some 0.6 GB then
constexpr std::size_t kTimesUnlessAsked = 6;

/// What stands on one tile before it is drawn: all of it but the side it is seen from.
struct Moment {
  std::vector<float> values;  ///< by channel
  std::string caption;
  std::string detail;
};

struct View {
  std::string name;
  float yaw_rad = 0.0F;
  float pitch_rad = 0.0F;
};

constexpr float kRadians = 3.14159265F / 180.0F;

/// "front,threequarter,side", or turns such as 20deg: + shows the signer's left side.
std::optional<std::vector<View>> read_views(const std::string& text, lang::Diagnostics& diagnostics) {
  static const std::vector<View> kNamed = {
      {"front", 0.0F, 0.0F},   {"threequarter", 35.0F, 0.0F}, {"side", 90.0F, 0.0F},   {"left", 90.0F, 0.0F},
      {"right", -90.0F, 0.0F}, {"back", 180.0F, 0.0F},        {"below", 0.0F, -35.0F}, {"above", 0.0F, 35.0F},
  };
  std::vector<View> views;
  for (const std::string_view name : split_at_commas(text)) {
    const auto named = std::find_if(kNamed.begin(), kNamed.end(), [&](const View& v) { return v.name == name; });
    const auto turn = lang::read_quantity(name);
    if (named != kNamed.end()) {
      views.push_back({named->name, named->yaw_rad * kRadians, named->pitch_rad * kRadians});
    } else if (turn && turn->unit == lang::Unit::angle && std::fabs(turn->value) <= 360.0) {
      views.push_back({std::string(name), static_cast<float>(turn->value) * kRadians, 0.0F});
    } else {
      add_failure(diagnostics, {"unknown_view", "--view", fmt::format("\"{}\" is no view", printable(name)),
                                "there are front, threequarter, side, left, right, back, above, below, and turns such "
                                "as 20deg"});
      return std::nullopt;
    }
  }
  return views;
}

/// Times that show most: the middle of every sign, else even steps; never more than fit a page.
std::vector<std::int64_t> telling_times(const program::Clip& clip, const Tiers& tiers) {
  std::vector<std::int64_t> times;
  for (const TierSpan& s : tiers.signs) times.push_back(s.start_ns + (s.stroke_end_ns - s.start_ns) / 2);
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  if (times.size() >= 2 && times.size() <= 2 * kTimesUnlessAsked) return times;
  times.clear();
  for (std::size_t i = 0; i < kTimesUnlessAsked; ++i)
    times.push_back(clip.start_ns + (clip.end_ns - clip.start_ns) / static_cast<std::int64_t>(2 * kTimesUnlessAsked) *
                                        static_cast<std::int64_t>(2 * i + 1));
  return times;
}

/// The signs and the entries in use at a time.
std::string what_is_signed(const Tiers& tiers, std::int64_t t) {
  std::string text;
  for (const auto* spans : {&tiers.signs, &tiers.uses})
    for (const TierSpan& s : *spans)
      if (t >= s.start_ns && t <= s.end_ns) text += (text.empty() ? "" : "  ") + s.name;
  return text;
}

std::vector<Moment> moments_of(const program::Program& program, const program::Clip& clip,
                               std::vector<std::int64_t> times) {
  const Tiers tiers = read_tiers(program, clip);
  if (times.empty()) times = telling_times(clip, tiers);
  std::vector<Moment> moments;
  for (const std::int64_t t : times) {
    Moment m;
    m.values.resize(program.channels.size());
    program::Player player(program, clip);
    player.advance(t, m.values);
    m.caption = decimal_seconds(t) + " s";
    m.detail = what_is_signed(tiers, t);
    moments.push_back(std::move(m));
  }
  return moments;
}

/// The furthest that the skin goes. [m]
double furthest(const runtime::Face& face, const runtime::Rig& rig, const std::vector<float>& values) {
  runtime::Pose pose = runtime::make_pose(face, rig);
  runtime::pose_face(face, rig, std::vector<float>(values.size(), 0.0F), pose);
  const std::vector<glm::vec3> rest = pose.positions;
  runtime::pose_face(face, rig, values, pose);
  double most = 0.0;
  for (std::size_t v = 0; v < rest.size(); ++v)
    most = std::max(most, glm::distance(glm::dvec3(rest[v]), glm::dvec3(pose.positions[v])));
  return most;
}

std::optional<std::size_t> channel_named(const program::Program& program, std::string_view name) {
  for (std::size_t c = 0; c < program.channels.size(); ++c)
    if (program.string(program.channels[c].name) == name) return c;
  return std::nullopt;
}

/// Every action unit that the face can show at 100 %.
class UnitChart {
 public:
  /// @param titles  of axes' units
  UnitChart(const program::Program& program, const runtime::Face& face, const runtime::Rig& rig,
            std::map<std::string, std::string> titles)
      : program_(program),
        face_(face),
        rig_(rig),
        titles_(std::move(titles)),
        shows_tongue_(channel_named(program, "AU19")) {}

  std::vector<Moment> moments() {
    const std::size_t count = program_.channels.size();
    moments_ = {{std::vector<float>(count, 0.0F), "rest", ""}};
    for (std::size_t c = 0; c < count; ++c)
      if (rig_.actuated(static_cast<program::ChannelId>(c))) add(c);
    return std::move(moments_);
  }

 private:
  void add(std::size_t c) {
    const program::Channel& channel = program_.channels[c];
    Moment m{std::vector<float>(program_.channels.size(), 0.0F), std::string(program_.string(channel.name)),
             std::string(program_.string(channel.title))};
    m.values[c] = 1.0F;
    if (channel.kind == program::ChannelKind::axis) {
      m.caption = program_.string(channel.positive);
      m.detail = titles_[m.caption];
      add(c, m);
      m.caption = program_.string(channel.negative);
      m.detail = titles_[m.caption];
      m.values[c] = -1.0F;
    } else if (channel.side == program::Side::left) {
      add_other_side(c, m);
    } else if (channel.side == program::Side::right && both_ == channel.au) {
      return;
    }
    add(c, std::move(m));
  }

  /// A tongue that moves behind closed lips is not seen: it is put out.
  void add(std::size_t c, Moment m) {
    const auto channel = static_cast<program::ChannelId>(c);
    bool bends = false;
    for (std::uint32_t part = 0; part < face_.rigid.size(); ++part) bends = bends || rig_.moves_part(channel, part);
    if (bends && !rig_.moves_skin(channel) && shows_tongue_ && *shows_tongue_ != c) {
      m.values[*shows_tongue_] = 1.0F;
      m.detail += m.detail.empty() ? "with AU19" : ", with AU19";
    }
    moments_.push_back(std::move(m));
  }

  /// Both sides at once, unless one undoes the other: a jaw goes to one side.
  void add_other_side(std::size_t c, Moment& m) {
    const program::Channel& channel = program_.channels[c];
    std::string both = m.caption;
    both.pop_back();  // "AU12L"
    const auto other = channel_named(program_, both + "R");
    if (!other || program_.channels[*other].side != program::Side::right) return;
    const double alone = furthest(face_, rig_, m.values);
    m.values[*other] = 1.0F;
    if (furthest(face_, rig_, m.values) < 0.5 * alone) {
      m.values[*other] = 0.0F;
      return;
    }
    m.caption = std::move(both);
    both_ = channel.au;
  }

  const program::Program& program_;
  const runtime::Face& face_;
  const runtime::Rig& rig_;
  std::map<std::string, std::string> titles_;
  std::optional<std::size_t> shows_tongue_;
  std::optional<int> both_;  ///< the unit whose sides were shown together last
  std::vector<Moment> moments_;
};

tl::expected<picture::Image, picture::RenderFailure> draw_sheet(const PreviewOptions& options,
                                                                const std::vector<Moment>& moments,
                                                                const std::vector<View>& views,
                                                                const runtime::Face& face, const runtime::Rig& rig,
                                                                const std::string& title) {
  const int threads = static_cast<int>(std::clamp(std::thread::hardware_concurrency(), 1U, 64U));
  runtime::Pose pose = runtime::make_pose(face, rig);
  runtime::pose_face(face, rig, std::vector<float>(rig.channel_count(), 0.0F), pose);
  const double aspect = static_cast<double>(options.width) / static_cast<double>(options.height);
  const picture::Camera base = head_camera(face, rig, pose, aspect);
  std::vector<picture::Camera> cameras;
  for (const View& v : views) {
    picture::Camera camera = base;
    camera.yaw_rad = v.yaw_rad;
    camera.pitch_rad = v.pitch_rad;
    cameras.push_back(camera);
  }
  // A clip is seen from one distance, each unit of the chart from its own.
  const bool chart = options.each_au;
  if (!chart) {
    for (const Moment& m : moments) {
      runtime::pose_face(face, rig, m.values, pose);
      for (picture::Camera& camera : cameras)
        camera.height_m = std::max(camera.height_m, height_to_hold(camera, pose, aspect));
    }
  }
  // A row for each view, a column for each moment; many moments of one view fill rows of their own.
  std::vector<picture::Tile> tiles(moments.size() * views.size());
  for (std::size_t m = 0; m < moments.size(); ++m) {
    runtime::pose_face(face, rig, moments[m].values, pose);
    std::vector<picture::Camera> from = cameras;
    if (chart)
      for (picture::Camera& camera : from) camera.height_m = height_to_hold(camera, pose, aspect);
    auto images = picture::render(face_meshes(face, rig, pose), from, {options.width, options.height, threads});
    if (!images) return tl::unexpected(images.error());
    for (std::size_t v = 0; v < views.size(); ++v)
      tiles[v * moments.size() + m] = {std::move((*images)[v]), moments[m].caption, moments[m].detail};
  }
  const int columns = options.columns > 0 ? options.columns
                      : views.size() > 1  ? static_cast<int>(moments.size())
                                          : std::min(static_cast<int>(moments.size()), 8);
  return picture::contact_sheet(tiles, columns, title);
}

void run(const GlobalOptions& global, const PreviewOptions& options, SourceFiles& sources,
         lang::Diagnostics& diagnostics) {
  const auto views = read_views(options.views, diagnostics);
  const auto times = options.times.empty() ? std::vector<std::int64_t>() : read_times(options.times, diagnostics);
  if (!views || !times) return;
  const auto image = load_program(global, options.files, options.face, sources, diagnostics, Reuse::program_beside);
  if (!image) return;
  const program::Program& program = image->program();
  const program::Clip* clip = nullptr;
  if (!options.each_au && (clip = find_clip(program, options.clip, options.files.front(), diagnostics)) == nullptr)
    return;
  const auto face = load_face(program, options.face, sources, diagnostics);
  if (!face) return;
  const auto rig = bind_face(*face, program, diagnostics);
  if (!rig) return;
  if (clip != nullptr) warn_not_actuated(program, *rig, {clip}, options.face, diagnostics);
  const std::vector<Moment> moments = clip != nullptr ? moments_of(program, *clip, *times)
                                                      : UnitChart(program, *face, *rig, unit_titles(sources)).moments();
  if (moments.size() * views->size() > kMaxTiles) {
    add_failure(diagnostics, {"too_many_pictures", "--at", fmt::format("that is more than {} pictures", kMaxTiles),
                              "ask for fewer times or views"});
    return;
  }
  const std::size_t pixels = moments.size() * views->size() * static_cast<std::size_t>(options.width) *
                             static_cast<std::size_t>(options.height);
  if (pixels > kMaxPixels) {
    add_failure(diagnostics,
                {"too_many_pictures", "--size",
                 fmt::format("{} pictures of {}x{} are more than {} million pixels", moments.size() * views->size(),
                             options.width, options.height, kMaxPixels / 1'000'000),
                 "make them smaller, or ask for fewer times or views"});
    return;
  }
  const std::string title = clip != nullptr ? fmt::format("{} on {}", options.clip, options.face)
                                            : fmt::format("{}: every action unit at 100 %", options.face);
  const auto sheet = draw_sheet(options, moments, *views, *face, *rig, title);
  if (!sheet) {
    add_failure(diagnostics, {"no_picture", options.face, sheet.error().cause, sheet.error().remedy});
    return;
  }
  if (const auto failure = write_file(options.output, picture::encode_png(*sheet))) add_failure(diagnostics, *failure);
}

}  // namespace

int preview(const GlobalOptions& global, const PreviewOptions& options) {
  SourceFiles sources(global.stdlib);
  lang::Diagnostics diagnostics;
  run(global, options, sources, diagnostics);
  return finish(global, diagnostics);
}

}  // namespace nms::cli
