// Which action units a face can show, how far and where; which entries of a lexicon look the same on it.
#include <cstdio>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <nms/lang/quantity.h>
#include <nms/runtime/face_file.h>

#include "commands.h"
#include "face_movement.h"
#include "loaded_lexicon.h"
#include "loading.h"
#include "report.h"
#include "tiers.h"
#include "unit_titles.h"

namespace nms::cli {
namespace {

constexpr double kLeastThreshold_mm = 0.001;

struct Report {
  std::string face;
  std::string lexicon;
  double threshold_m = 0.0;
  std::vector<ChannelMovement> units;
  std::vector<std::string> unshown;
  std::vector<Lookalikes> pairs;
  std::size_t entries = 0;
};

std::string text_of(const Report& report) {
  std::string out =
      fmt::format("{:<8} {:>7}  {:>18}  {:>5}  {:<22} {}\n", "unit", "mm", "x y z", "moves", "at", "name");
  for (const ChannelMovement& m : report.units)
    out += fmt::format("{:<8} {:>7.1f}  {:>5.2f} {:>5.2f} {:>5.2f}   {:>4.0f}%  {:<22} {}\n", m.unit, m.largest_m * 1e3,
                       m.direction.x, m.direction.y, m.direction.z, 100.0 * m.share, m.place, m.title);
  if (!report.unshown.empty()) out += fmt::format("not shown: {}\n", fmt::join(report.unshown, ", "));
  if (report.lexicon.empty()) return out;
  out +=
      fmt::format("{}: {} entries, {} pair{} no vertex of which is further apart than {:.3g} mm\n", report.lexicon,
                  report.entries, report.pairs.size(), report.pairs.size() == 1 ? "" : "s", report.threshold_m * 1e3);
  for (const Lookalikes& p : report.pairs)
    out += fmt::format("  {} looks like {}: {:.2f} mm\n", p.first, p.second, p.largest_m * 1e3);
  return out;
}

std::string json_of(const Report& report) {
  nlohmann::ordered_json units = nlohmann::ordered_json::array();
  for (const ChannelMovement& m : report.units)
    units.push_back({{"unit", m.unit},
                     {"name", m.title},
                     {"largest_mm", m.largest_m * 1e3},
                     {"direction", {m.direction.x, m.direction.y, m.direction.z}},
                     {"at", m.place},
                     {"moves", m.share}});
  nlohmann::ordered_json out = {{"face", report.face}, {"units", units}, {"not_shown", report.unshown}};
  if (!report.lexicon.empty()) {
    nlohmann::ordered_json pairs = nlohmann::ordered_json::array();
    for (const Lookalikes& p : report.pairs)
      pairs.push_back({{"entries", {p.first, p.second}}, {"largest_mm", p.largest_m * 1e3}});
    out["lexicon"] = report.lexicon;
    out["entries"] = report.entries;
    out["threshold_mm"] = report.threshold_m * 1e3;
    out["look_the_same"] = pairs;
  }
  return out.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

/// A face with the rig of some program.
struct Bound {
  runtime::Face face;
  runtime::Rig rig;
};

std::optional<Bound> bound_face(const program::Program& program, const std::string& name, SourceFiles& sources,
                                lang::Diagnostics& diagnostics) {
  auto face = load_face(program, name, sources, diagnostics);
  if (!face) return std::nullopt;
  auto rig = bind_face(*face, program, diagnostics);
  if (!rig) return std::nullopt;
  return Bound{std::move(*face), std::move(*rig)};
}

bool add_units(const GlobalOptions& global, const FaceReportOptions& options, SourceFiles& sources,
               lang::Diagnostics& diagnostics, Report& report) {
  const auto image = load_program(global, {}, options.face, sources, diagnostics);
  if (!image) return false;
  const program::Program& program = image->program();
  const auto bound = bound_face(program, options.face, sources, diagnostics);
  if (!bound) return false;
  report.face = program.string(program.faces[0].name);
  FaceVertices vertices(bound->face, bound->rig);
  report.units = channel_movements(program, bound->rig, vertices, runtime::landmarks_of(bound->face, program),
                                   unit_titles(sources));
  for (std::uint32_t c = 0; c < program.channels.size(); ++c)
    if (!bound->rig.actuated(program::ChannelId{c}))
      report.unshown.emplace_back(program.string(program.channels[c].name));
  return true;
}

bool add_lexicon(const GlobalOptions& global, const FaceReportOptions& options, SourceFiles& sources,
                 lang::Diagnostics& diagnostics, Report& report) {
  // What the face lacks was said with its units.
  lang::Diagnostics again;
  const auto loaded = load_lexicon(global, options.lexicon, options.face, sources, diagnostics);
  if (!loaded) return false;
  const program::Program& program = loaded->image.program();
  const auto bound = bound_face(program, options.face, sources, again);
  if (!bound) return false;
  std::vector<const program::Clip*> clips;
  for (const compiler::EntryRecord& e : loaded->lexicon.entries)
    if (const program::Clip* clip = program.find_clip(e.name)) clips.push_back(clip);
  FaceVertices vertices(bound->face, bound->rig);
  report.lexicon = loaded->lexicon.name;
  report.entries = clips.size();
  report.pairs = lookalikes(program, clips, vertices, report.threshold_m);
  return true;
}

}  // namespace

int face_report(const GlobalOptions& global, const FaceReportOptions& options) {
  SourceFiles sources(global.stdlib);
  lang::Diagnostics diagnostics;
  Report report;
  const auto threshold = lang::read_quantity(options.threshold);
  if (!threshold || threshold->unit != lang::Unit::length || threshold->value < kLeastThreshold_mm) {
    add_failure(diagnostics, {"bad_length", "--threshold",
                              fmt::format("\"{}\" is not a length of 0.001 mm or more", printable(options.threshold)),
                              "write it with its unit: 1mm"});
    return finish(global, diagnostics);
  }
  report.threshold_m = threshold->value / 1000.0;
  if (add_units(global, options, sources, diagnostics, report) &&
      (options.lexicon.empty() || add_lexicon(global, options, sources, diagnostics, report))) {
    const std::string out = options.json ? json_of(report) : text_of(report);
    std::fwrite(out.data(), 1, out.size(), stdout);
  }
  return finish(global, diagnostics);
}

}  // namespace nms::cli
