#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <nms/lang/quantity.h>
#include <nms/runtime/face_fit.h>
#include <nms/runtime/face_x3d.h>
#include <nms/runtime/polygon_mesh.h>

#include "commands.h"
#include "loading.h"
#include "output_file.h"
#include "report.h"

namespace nms::cli {
namespace {

/// {"nasion": [0, 39, 106.9], ...}, in units of the scan.
std::optional<runtime::Places> read_marks(const std::string& path, double unit_m, lang::Diagnostics& diagnostics) {
  const auto text = read_file(path);
  if (!text) {
    add_failure(diagnostics, text.error());
    return std::nullopt;
  }
  const auto wrong = [&](std::string cause) {
    add_failure(diagnostics, {"bad_landmarks", path, std::move(cause), R"(write {"nasion": [0, 39, 106.9], ...})"});
    return std::nullopt;
  };
  const auto json = nlohmann::json::parse(*text, nullptr, false);
  if (json.is_discarded()) return wrong("it is no JSON, or a number in it is too large");
  if (!json.is_object()) return wrong("it holds no JSON object");
  runtime::Places marks;
  for (const auto& [name, place] : json.items()) {
    const bool three = place.is_array() && place.size() == 3 &&
                       std::all_of(place.begin(), place.end(), [](const auto& c) { return c.is_number(); });
    if (!three) return wrong(fmt::format("'{}' is not a place of three numbers", name));
    marks[name] = unit_m * glm::dvec3(place[0].get<double>(), place[1].get<double>(), place[2].get<double>());
  }
  return marks;
}

/// A name that the language takes, of the file's own.
std::optional<std::string> face_name(const std::string& output) {
  const std::string stem = std::filesystem::path(output).stem().string();
  const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; };
  const bool plain = !stem.empty() && letter(stem.front()) &&
                     std::all_of(stem.begin(), stem.end(), [&](char c) { return letter(c) || (c >= '0' && c <= '9'); });
  if (!plain || !output.ends_with(".nms")) return std::nullopt;
  return stem;
}

std::string millimetres(double metres) {
  std::string text = fmt::format("{:.2f}", 1000.0 * metres);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.ends_with('.')) text.pop_back();
  return (text == "-0" ? "0" : text) + "mm";
}

/// The face as the language declares it; if it is symmetric, sided places are given for the left.
std::string declaration(const std::string& name, const std::string& base, const runtime::Places& landmarks,
                        bool symmetric) {
  std::string text =
      fmt::format("// The surfaces of `{}`, laid onto a scan by nmsc face fit.\nface {} {{\n  surface \"{}.x3d\"\n\n",
                  base, name, name);
  for (const auto& [mark, place] : landmarks) {
    if (symmetric && mark.ends_with("_R")) continue;
    const bool sided = symmetric && mark.ends_with("_L");
    text += fmt::format("  landmark {}{} ({}, {}, {})\n", sided ? mark.substr(0, mark.size() - 2) : mark,
                        sided ? " sides" : "", millimetres(place.x), millimetres(place.y), millimetres(place.z));
  }
  return text + "}\n";
}

bool write_text(const std::string& path, const std::string& text, lang::Diagnostics& diagnostics) {
  const auto failure = write_file(path, std::as_bytes(std::span(text.data(), text.size())));
  if (failure) add_failure(diagnostics, *failure);
  return !failure;
}

/// Names that the face has no place for: a slip, or what another program puts there.
void warn_of_unknown(const runtime::Places& marks, const runtime::Places& landmarks, const FaceFitOptions& options,
                     lang::Diagnostics& diagnostics) {
  std::vector<std::string> unknown;
  for (const auto& [name, place] : marks)
    if (!landmarks.contains(name)) unknown.push_back(name);
  if (unknown.empty()) return;
  const std::size_t count = unknown.size();
  if (count > 8) unknown.resize(8);
  add_failure(diagnostics,
              {"unknown_landmark", options.landmarks,
               fmt::format("{} has no landmark {}{}", options.face, fmt::join(unknown, ", "),
                           count > 8 ? fmt::format(" and {} more", count - 8) : ""),
               "docs/for-faces.md lists them; those of two sides end in _L and _R"},
              lang::Severity::warning);
}

// A nose may be long by a centimetre; a wrong vertex is picked further away than that, and pulls out a horn.
constexpr double kStrayFrom = 0.015;  // [m]
constexpr double kStrayTimes = 4.0;   // as far as landmarks are off in the median

void warn_of_stray(const runtime::FittedFace& fitted, const FaceFitOptions& options, lang::Diagnostics& diagnostics) {
  if (fitted.furthest_mark_off_m < std::max(kStrayFrom, kStrayTimes * fitted.median_mark_off_m)) return;
  add_failure(
      diagnostics,
      {"fit_stray_landmark", options.landmarks,
       fmt::format("{} is {:.0f} mm from where the others put it; landmarks are {:.0f} mm off in the median",
                   fitted.furthest_mark, 1000.0 * fitted.furthest_mark_off_m, 1000.0 * fitted.median_mark_off_m),
       "look at that place, or leave the landmark out"},
      lang::Severity::warning);
}

void run(const GlobalOptions& global, const FaceFitOptions& options, SourceFiles& sources,
         lang::Diagnostics& diagnostics) {
  const auto unit = lang::read_quantity(options.unit);
  if (!unit || unit->unit != lang::Unit::length || unit->value <= 0.0) {
    add_failure(diagnostics, {"bad_length", "--unit", fmt::format("\"{}\" is not a length", options.unit),
                              "write what one unit of the scan is: 1mm, 1cm, 1000mm"});
    return;
  }
  const double unit_m = unit->value / 1000.0;
  const auto name = face_name(options.output);
  if (!name) {
    add_failure(diagnostics, {"bad_name", options.output, "a face cannot be called so",
                              "name the file as the face: letters, digits and _, with .nms at its end"});
    return;
  }
  const auto image = load_program(global, {}, options.face, sources, diagnostics);
  if (!image) return;
  const program::Program& program = image->program();
  const auto surface = face_surface(program, options.face, sources, diagnostics);
  if (!surface) return;
  runtime::Places landmarks;
  for (const program::Landmark& mark : program.landmarks) {
    landmarks[std::string(program.string(mark.name))] = {mark.position[0], mark.position[1], mark.position[2]};
  }
  const auto marks = read_marks(options.landmarks, unit_m, diagnostics);
  if (!marks) return;
  const auto text = read_file(options.scan);
  if (!text) {
    add_failure(diagnostics, text.error());
    return;
  }
  const auto scan = runtime::read_obj(*text, options.scan);
  if (!scan) {
    add_failure(diagnostics, scan.error());
    return;
  }
  const auto halves = options.symmetric ? runtime::Halves::alike : runtime::Halves::each;
  warn_of_unknown(*marks, landmarks, options, diagnostics);
  const auto fitted = runtime::fit_face(surface->text(), surface->path(), landmarks, *scan, unit_m, *marks, halves);
  if (!fitted) {
    program::Failure failure = fitted.error();  // what does not fit is the scan or what is said of it
    if (failure.kind.starts_with("fit_")) failure.place = failure.kind == "fit_far" ? options.scan : options.landmarks;
    add_failure(diagnostics, failure);
    return;
  }
  warn_of_stray(*fitted, options, diagnostics);
  const std::string x3d = std::filesystem::path(options.output).replace_extension(".x3d").string();
  if (!write_text(x3d, runtime::write_face_x3d(fitted->file), diagnostics)) return;
  if (!write_text(options.output, declaration(*name, options.face, fitted->landmarks, options.symmetric), diagnostics))
    return;
  fmt::print(told(global),
             "{}: {} on {} by {} landmarks: {:.2f} mm from it in the mean, 95 % within {:.2f} mm ({:.2f} mm by "
             "landmarks alone)\n",
             options.output, options.face, options.scan, fitted->landmarks_used, 1000.0 * fitted->mean_m,
             1000.0 * fitted->p95_m, 1000.0 * fitted->before_mean_m);
}

}  // namespace

int face_fit(const GlobalOptions& global, const FaceFitOptions& options) {
  SourceFiles sources(global.stdlib);
  lang::Diagnostics diagnostics;
  run(global, options, sources, diagnostics);
  return finish(global, diagnostics);
}

}  // namespace nms::cli
