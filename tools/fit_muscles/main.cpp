#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <glm/geometric.hpp>

#include <nms/face_program/face_program.h>
#include <nms/lang/quantity.h>
#include <nms/runtime/face_file.h>
#include <nms/runtime/polygon_mesh.h>
#include <nms/stdlib/embedded.h>

#include "muscle_fit.h"

// nmsc-fit: measured displacements -> muscles. Its own program, so that nothing else loads Ceres.
namespace {

using namespace nms;

struct Options {
  std::vector<std::string> sources;
  std::string face = "ada";
  std::string neutral;
  std::vector<std::string> expressions;  // UNITS=FILE.obj
  std::string figures;
  std::vector<std::string> units;  // of the figures
  std::vector<std::string> muscles;
  std::string unit = "1mm";
  std::string output;
  bool keep_shares = false;
  int most_steps = fit_muscles::FitSettings{}.most_steps;
  double stiffness = fit_muscles::FitSettings{}.stiffness;
};

int fail(const program::Failure& f) {
  fmt::print(stderr, "{}: error {}: {}\nhelp: {}\n", f.place, f.kind, f.cause, f.remedy);
  return 1;
}

std::optional<std::string> read_file(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return std::nullopt;
  std::ifstream file(path, std::ios::binary);
  if (!file) return std::nullopt;
  return std::string(std::istreambuf_iterator<char>(file), {});
}

tl::expected<runtime::PolygonMesh, program::Failure> read_mesh(const std::string& path) {
  const auto text = read_file(path);
  if (!text) return tl::unexpected(program::Failure{"cannot_read", path, "it cannot be read", "give an OBJ file"});
  return runtime::read_obj(*text, path);
}

bool named(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// The face's surface: beside the sources, or the library's.
tl::expected<runtime::Face, program::Failure> read_face(const Options& options, const program::Program& program) {
  const std::string path(program.faces.empty() ? "" : program.string(program.faces[0].surface));
  for (const std::string& source : options.sources) {
    const auto beside = (std::filesystem::path(source).parent_path() / path).string();
    if (const auto text = read_file(beside)) return runtime::read_face(*text, beside, runtime::face_form(program));
  }
  for (const auto& file : stdlib::embedded_files()) {
    if (file.path == "faces/" + path) return runtime::read_face(file.text, path, runtime::face_form(program));
  }
  return tl::unexpected(program::Failure{"cannot_read", options.face,
                                         fmt::format("its surface \"{}\" is not there", path),
                                         "put it beside the source that declares the face"});
}

// Beside it, then renamed: no half-written file.
bool write_file(const std::string& path, const std::string& text) {
  const std::string beside = path + ".new";
  {
    std::ofstream file(beside, std::ios::binary);
    file << text;
    file.close();
    if (!file) return false;
  }
  std::error_code error;
  std::filesystem::rename(beside, path, error);
  return !error;
}

// The landmarks of a face lie on it or in its flesh: if half of them are further away than this, it is elsewhere.
constexpr double kFarOff_m = 0.03;

std::optional<program::Failure> look_where(const fit_muscles::RestMesh& rest, const runtime::Landmarks& landmarks,
                                           const std::string& path) {
  std::vector<double> off;
  for (const auto& [name, place] : landmarks) {
    double nearest = 1e9;
    for (const glm::dvec3& p : rest.points) nearest = std::min(nearest, glm::distance(p, place));
    off.push_back(nearest);
  }
  if (off.empty()) return std::nullopt;
  std::sort(off.begin(), off.end());
  const double median = off[off.size() / 2];
  if (median < kFarOff_m) return std::nullopt;
  return program::Failure{
      "fit_far", path, fmt::format("half of the face's landmarks are {:.0f} mm or more from it", 1000.0 * median),
      "give it in the face's coordinates (+x the subject's left, +y up, +z forward), and its --unit"};
}

template <typename T>
using Maybe = tl::expected<T, program::Failure>;

Maybe<double> unit_of(const std::string& text) {
  const auto length = lang::read_quantity(text);
  if (!length || length->unit != lang::Unit::length || length->value <= 0.0) {
    return tl::unexpected(program::Failure{"bad_length", "--unit", fmt::format("\"{}\" is not a length", text),
                                           "write what one unit of the OBJ files is: 1mm, 1cm, 1000mm"});
  }
  return length->value / 1000.0;
}

/// "AU12=smile.obj": the units that an expression shows, and its file.
Maybe<std::vector<std::pair<std::string, std::string>>> expressions_asked_for(const Options& options) {
  std::vector<std::pair<std::string, std::string>> wanted;
  for (const std::string& e : options.expressions) {
    const std::size_t at = e.find('=');
    if (at == std::string::npos || at == 0) {
      return tl::unexpected(
          program::Failure{"bad_expression", e, "it does not say which units the face shows", "write AU12=smile.obj"});
    }
    wanted.emplace_back(e.substr(0, at), e.substr(at + 1));
  }
  return wanted;
}

Maybe<std::vector<std::pair<std::string, std::string>>> read_sources(const Options& options) {
  std::vector<std::pair<std::string, std::string>> sources;
  for (const std::string& path : options.sources) {
    auto text = read_file(path);
    if (!text) return tl::unexpected(program::Failure{"cannot_read", path, "it cannot be read", "give a .nms file"});
    sources.emplace_back(path, std::move(*text));
  }
  return sources;
}

/// Of the table, if there is one, the units that are asked for.
Maybe<std::vector<fit_muscles::UnitFigures>> read_figures(const Options& options) {
  std::vector<fit_muscles::UnitFigures> figures;
  if (options.figures.empty()) return figures;
  const auto text = read_file(options.figures);
  if (!text) {
    return tl::unexpected(
        program::Failure{"cannot_read", options.figures, "it cannot be read", "give a table of figures"});
  }
  auto read = fit_muscles::read_unit_figures(*text, options.figures);
  if (!read) return tl::unexpected(read.error());
  for (fit_muscles::UnitFigures& f : *read)
    if (options.units.empty() || named(options.units, f.unit)) figures.push_back(std::move(f));
  return figures;
}

/// The face at rest, and what is shown on the same mesh.
struct Fields {
  fit_muscles::RestMesh rest;
  std::vector<fit_muscles::Expression> expressions;
};

/// @param face  gives the mesh its regions; null: none
Maybe<Fields> read_fields(const Options& options, double unit_m,
                          const std::vector<std::pair<std::string, std::string>>& wanted, const runtime::Face* face,
                          const program::Program& program) {
  Fields fields;
  if (!options.neutral.empty()) {
    const auto neutral = read_mesh(options.neutral);
    if (!neutral) return tl::unexpected(neutral.error());
    fields.rest = fit_muscles::rest_mesh(*neutral, unit_m);
    if (face != nullptr) {
      if (auto failure = look_where(fields.rest, runtime::landmarks_of(*face, program), options.neutral))
        return tl::unexpected(std::move(*failure));
      fit_muscles::take_regions(fields.rest, *face);
    }
  }
  for (const auto& [name, path] : wanted) {
    const auto mesh = read_mesh(path);
    if (!mesh) return tl::unexpected(mesh.error());
    auto expression = fit_muscles::expression_of(name, *mesh, fields.rest, unit_m, program);
    if (!expression) return tl::unexpected(expression.error());
    fields.expressions.push_back(std::move(*expression));
  }
  return fields;
}

/// What the fit came to, on standard error; the muscles go where they are wanted.
int tell(const Options& options, const program::Program& program, const fit_muscles::FitResult& result) {
  for (const std::string& name : result.left_out)
    fmt::print(stderr, "note: {} moves no points by itself, and is left as it is\n", name);
  for (const std::string& line : fit_muscles::report_lines(result)) fmt::print(stderr, "{}\n", line);
  const std::string text = fit_muscles::muscle_text(program, result);
  if (options.output.empty()) {
    fmt::print("{}", text);
    return 0;
  }
  if (!write_file(options.output, text))
    return fail({"cannot_write", options.output, "it cannot be written", "give another place"});
  return 0;
}

int run(const Options& options) {
  const auto unit_m = unit_of(options.unit);
  if (!unit_m) return fail(unit_m.error());
  if (!(options.stiffness >= 0.0 && options.stiffness <= 1e6)) {
    return fail({"bad_quantity", "--stiffness", fmt::format("{} is not from 0 to a million", options.stiffness),
                 "write a small number, such as 0.0001"});
  }
  const auto wanted = expressions_asked_for(options);
  if (!wanted) return fail(wanted.error());
  const auto sources = read_sources(options);
  if (!sources) return fail(sources.error());
  const auto figures = read_figures(options);
  if (!figures) return fail(figures.error());

  std::vector<std::string> units;
  for (const auto& [unit, path] : *wanted) units.push_back(unit);
  for (const fit_muscles::UnitFigures& f : *figures) units.push_back(f.unit);
  if (units.empty()) {
    return fail({"fit_nothing", "nmsc-fit", "there is nothing to fit to",
                 "give --neutral and --expression, or --figures and units that it has"});
  }
  std::string said;
  const auto image = face_program::compile_face(*sources, options.face, units, said);
  if (!image) {
    fmt::print(stderr, "{}", said);
    return 1;
  }
  const program::Program& program = image->program();
  if (program.faces.empty()) {
    return fail({"unknown_face", options.face, "there is no face of that name",
                 "the library has ada; or give the source that declares one"});
  }

  // Its surface gives regions to fields, and shows what figures are measured on.
  const auto face = read_face(options, program);
  if (!face && !options.figures.empty()) return fail(face.error());
  const auto fields = read_fields(options, *unit_m, *wanted, face ? &*face : nullptr, program);
  if (!fields) return fail(fields.error());

  fit_muscles::FitSettings settings;
  settings.muscles = options.muscles;
  settings.stiffness = options.stiffness;
  settings.fit_shares = !options.keep_shares;
  settings.most_steps = options.most_steps;
  fit_muscles::Measured measured;
  measured.rest = &fields->rest;
  measured.fields = fields->expressions;
  if (face) measured.face = &*face;
  measured.figures = *figures;
  const auto result = fit_muscles::fit_muscles(program, measured, settings);
  if (!result) return fail(result.error());
  return tell(options, program, *result);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Fits muscles to measured displacements: a neutral face and expressions as OBJ files, muscles as .nms");
  Options options;
  app.add_option("SOURCE", options.sources, "Muscles to begin with (.nms); those of the library need not be named");
  app.add_option("--face", options.face,
                 "Face of the library, or one that a source declares: its landmarks place the muscles")
      ->capture_default_str();
  auto* neutral = app.add_option("--neutral", options.neutral, "The face at rest, in the face's coordinates");
  neutral->type_name("OBJ");
  auto* expression = app.add_option("--expression", options.expressions,
                                    "Units at their maximum and the face that shows them: AU12=smile.obj")
                         ->type_name("UNITS=OBJ")
                         ->take_all()
                         ->expected(1);
  expression->needs(neutral);
  app.add_option("--figures", options.figures, "Table of what was measured of units at their maximum")
      ->type_name("TABLE");
  app.add_option("--units", options.units, "Of the table only these: AU12,AU6")->delimiter(',');
  app.add_option("--muscle", options.muscles, "Only this muscle, without side; may be given several times")
      ->take_all()
      ->expected(1);
  app.add_option("--unit", options.unit, "What one unit of the OBJ files is")->capture_default_str();
  app.add_flag("--keep-shares", options.keep_shares, "Leave the units' shares of their muscles as they are");
  app.add_option("--steps", options.most_steps, "At most so many")->capture_default_str()->check(CLI::Range(1, 1000));
  app.add_option("--stiffness", options.stiffness, "How strongly parameters are held to where they begin [mm^2]")
      ->capture_default_str();
  app.add_option("-o,--output", options.output, "Where the fitted muscles go; standard output if not given")
      ->type_name("OUT.nms");
  app.set_version_flag("--version", "nmsc-fit " NMS_VERSION);
  app.footer("Exit: 0 success, 1 errors in the input, 2 wrong usage.");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  return run(options);
}
