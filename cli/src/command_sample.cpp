#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <nms/program/play.h>
#include <nms/runtime/rig.h>

#include "commands.h"
#include "decimal_seconds.h"
#include "loading.h"
#include "not_actuated.h"
#include "report.h"
#include "times.h"

namespace nms::cli {
namespace {

/// Most rows one call prints.
constexpr std::int64_t kMaxRows = 10'000'000;

/// The times asked for, or nothing and a diagnostic.
std::optional<std::vector<std::int64_t>> times_of(const SampleOptions& options, const program::Clip& clip,
                                                  lang::Diagnostics& diagnostics) {
  std::vector<std::int64_t> times;
  if (options.fps > 0.0) {
    const double rows = static_cast<double>(clip.end_ns - clip.start_ns) / 1e9 * options.fps;
    if (rows > static_cast<double>(kMaxRows)) {
      add_failure(diagnostics, {"too_many_rows", options.file, fmt::format("that is more than {} rows", kMaxRows),
                                "ask for fewer frames a second"});
      return std::nullopt;
    }
    for (std::int64_t i = 0;; ++i) {
      const auto t = clip.start_ns + static_cast<std::int64_t>(static_cast<double>(i) * 1e9 / options.fps + 0.5);
      if (t > clip.end_ns) break;
      times.push_back(t);
    }
    return times;
  }
  return read_times(options.times, diagnostics);
}

/// A column of the CSV: one AU, which may be one direction of an axis.
struct Column {
  std::uint32_t channel = 0;
  float sign = 1.0F;
};

void print_csv(const program::Program& program, const program::Clip& clip, const std::vector<std::int64_t>& times) {
  std::vector<Column> columns;
  std::string out = "time_s";
  for (std::uint32_t i = 0; i < clip.curve_count; ++i) {
    const auto channel = static_cast<std::uint32_t>(program.curves[clip.first_curve + i].channel);
    const program::Channel& c = program.channels[channel];
    if (c.kind == program::ChannelKind::axis) {
      columns.push_back({channel, 1.0F});
      columns.push_back({channel, -1.0F});
      out += fmt::format(",{},{}", program.string(c.positive), program.string(c.negative));
    } else {
      columns.push_back({channel, 1.0F});
      out += fmt::format(",{}", program.string(c.name));
    }
  }
  out += '\n';
  std::vector<float> values(program.channels.size());
  program::Player player(program, clip);
  for (const std::int64_t t : times) {
    player.advance(t, values);
    out += decimal_seconds(t);
    for (const Column& c : columns) {
      const float v = values[c.channel] * c.sign;
      out += fmt::format(",{}", v > 0.0F ? v : 0.0F);  // shortest digits that read back as the same float
    }
    out += '\n';
    if (out.size() > 1U << 16U) {
      std::fwrite(out.data(), 1, out.size(), stdout);
      out.clear();
    }
  }
  std::fwrite(out.data(), 1, out.size(), stdout);
}

}  // namespace

int sample(const GlobalOptions& global, const SampleOptions& options) {
  SourceFiles sources(global.stdlib);
  lang::Diagnostics diagnostics;
  const auto image = load_program(global, {options.file}, options.face, sources, diagnostics, Reuse::program_beside);
  if (!image) return finish(global, diagnostics);
  const program::Program& program = image->program();
  const program::Clip* clip = find_clip(program, options.clip, options.file, diagnostics);
  const auto times = clip != nullptr ? times_of(options, *clip, diagnostics) : std::nullopt;
  if (!times) return finish(global, diagnostics);
  if (!options.face.empty()) {
    const auto face = load_face(program, options.face, sources, diagnostics);
    if (!face) return finish(global, diagnostics);
    const auto rig = bind_face(*face, program, diagnostics);
    if (rig) warn_not_actuated(program, *rig, {clip}, options.face, diagnostics);
  }
  print_csv(program, *clip, *times);
  return finish(global, diagnostics);
}

}  // namespace nms::cli
