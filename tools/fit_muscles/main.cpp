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

#include <nms/lang/quantity.h>
#include <nms/runtime/polygon_mesh.h>

#include "fit_program.h"
#include "muscle_fit.h"

// nmsc-fit: measured displacements -> muscles. Its own program, so that nothing else loads Ceres.
namespace {

using namespace nms;

struct Options {
  std::vector<std::string> sources;
  std::string face = "ada";
  std::string neutral;
  std::vector<std::string> expressions;  // UNITS=FILE.obj
  std::vector<std::string> muscles;
  std::string unit = "1mm";
  std::string output;
  double stiffness = fit_muscles::FitSettings{}.stiffness;
};

int fail(const program::Failure& f) {
  fmt::print(stderr, "error {}: {}: {}\n  help: {}\n", f.kind, f.place, f.cause, f.remedy);
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

int run(const Options& options) {
  const auto length = lang::read_quantity(options.unit);
  if (!length || length->unit != lang::Unit::length || length->value <= 0.0) {
    return fail({"bad_length", "--unit", fmt::format("\"{}\" is not a length", options.unit),
                 "write what one unit of the OBJ files is: 1mm, 1cm, 1000mm"});
  }
  const double unit_m = length->value / 1000.0;

  std::vector<std::pair<std::string, std::string>> wanted;
  std::vector<std::string> units;
  for (const std::string& e : options.expressions) {
    const std::size_t at = e.find('=');
    if (at == std::string::npos || at == 0) {
      return fail({"bad_expression", e, "it does not say which units the face shows", "write AU12=smile.obj"});
    }
    wanted.emplace_back(e.substr(0, at), e.substr(at + 1));
    units.push_back(wanted.back().first);
  }
  std::vector<std::pair<std::string, std::string>> sources;
  for (const std::string& path : options.sources) {
    auto text = read_file(path);
    if (!text) return fail({"cannot_read", path, "it cannot be read", "give a .nms file"});
    sources.emplace_back(path, std::move(*text));
  }
  std::string said;
  const auto image = fit_muscles::compile_face(sources, options.face, units, said);
  if (!image) {
    fmt::print(stderr, "{}", said);
    return 1;
  }
  const program::Program& program = image->program();

  const auto neutral = read_mesh(options.neutral);
  if (!neutral) return fail(neutral.error());
  const fit_muscles::RestMesh rest = fit_muscles::rest_mesh(*neutral, unit_m);
  std::vector<fit_muscles::Expression> expressions;
  for (const auto& [name, path] : wanted) {
    const auto mesh = read_mesh(path);
    if (!mesh) return fail(mesh.error());
    auto expression = fit_muscles::expression_of(name, *mesh, rest, unit_m, program);
    if (!expression) return fail(expression.error());
    expressions.push_back(std::move(*expression));
  }

  fit_muscles::FitSettings settings;
  settings.muscles = options.muscles;
  settings.stiffness = options.stiffness;
  const auto result = fit_muscles::fit_muscles(program, rest, expressions, settings);
  if (!result) return fail(result.error());
  for (const std::string& name : result->left_out) {
    fmt::print(stderr, "note: {} moves no points by itself, and is left as it is\n", name);
  }
  for (const fit_muscles::FitError& e : result->errors) {
    fmt::print(stderr, "{}: rms {:.3f} mm -> {:.3f} mm, max {:.2f} mm -> {:.2f} mm, of {:.3f} mm rms\n", e.expression,
               e.before_rms_mm, e.after_rms_mm, e.before_max_mm, e.after_max_mm, e.measured_rms_mm);
  }
  const std::string text = fit_muscles::muscle_text(program, *result);
  if (options.output.empty()) {
    fmt::print("{}", text);
    return 0;
  }
  if (!write_file(options.output, text))
    return fail({"cannot_write", options.output, "it cannot be written", "give another place"});
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Fits muscles to measured displacements: a neutral face and expressions as OBJ files, muscles as .nms");
  Options options;
  app.add_option("SOURCE", options.sources, "Muscles to begin with (.nms); those of the library need not be named");
  app.add_option("--face", options.face,
                 "Face of the library, or one that a source declares: its landmarks place the muscles")
      ->capture_default_str();
  app.add_option("--neutral", options.neutral, "The face at rest, in the face's coordinates")
      ->required()
      ->type_name("OBJ");
  app.add_option("--expression", options.expressions,
                 "Units at their maximum and the face that shows them: AU12=smile.obj")
      ->required()
      ->type_name("UNITS=OBJ")
      ->take_all()
      ->expected(1);
  app.add_option("--muscle", options.muscles, "Only this muscle, without side; may be given several times")
      ->take_all()
      ->expected(1);
  app.add_option("--unit", options.unit, "What one unit of the OBJ files is")->capture_default_str();
  app.add_option("--stiffness", options.stiffness, "How strongly parameters are held to where they begin [mm^2]")
      ->capture_default_str();
  app.add_option("-o,--output", options.output, "Where the fitted muscles go; standard output if not given")
      ->type_name("OUT.nms");
  CLI11_PARSE(app, argc, argv);
  return run(options);
}
