#include "loading.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <utility>

#include <fmt/format.h>

#include <nms/compiler/compile.h>
#include <nms/runtime/face_file.h>

#include "program_beside.h"
#include "report.h"
#include "time_table_file.h"

namespace nms::cli {
namespace {

/// A table of a million rows takes less; a JSON text takes some ten times its size while it is read.
constexpr std::size_t kMaxTableBytes = 64U << 20U;

bool is_program(const std::string& path) { return path.ends_with(".auc"); }

}  // namespace

std::shared_ptr<const lang::Source> face_source(const std::string& face, SourceFiles& sources) {
  if (face.ends_with(".nms")) {
    auto opened = sources.open(face);
    return opened ? *opened : nullptr;
  }
  return sources.stdlib(fmt::format("faces/{}.nms", face));
}

std::vector<std::shared_ptr<const lang::Source>> load_roots(const std::vector<std::string>& files, SourceFiles& sources,
                                                            lang::Diagnostics& diagnostics) {
  std::vector<std::shared_ptr<const lang::Source>> roots;
  for (const std::string& file : files) {
    if (is_program(file)) {
      add_failure(diagnostics,
                  {"wrong_input", file, "a compiled program stands alone", "give one .auc file, or sources only"});
      continue;
    }
    auto source = sources.open(file);
    if (source) {
      if (std::find(roots.begin(), roots.end(), *source) == roots.end()) roots.push_back(*source);
    } else {
      add_failure(diagnostics, source.error());
    }
  }
  return roots;
}

std::optional<program::Image> checked_image(const program::Draft& draft, lang::Diagnostics& diagnostics) {
  auto image = program::Image::from(draft);
  if (image) return std::move(*image);
  add_failure(diagnostics, {image.error().kind, image.error().place,
                            "the compiler made a program that does not pass its own check: " + image.error().cause,
                            "this is a defect of nmsc; please report it with the source"});
  return std::nullopt;
}

std::optional<std::vector<compiler::TimeTable>> load_time_tables(const GlobalOptions& global, SourceFiles& sources,
                                                                 lang::Diagnostics& diagnostics) {
  std::vector<compiler::TimeTable> tables;
  bool good = true;
  for (const std::string& path : global.marks) {
    auto source = sources.open(path);
    if (!source) {
      add_failure(diagnostics, source.error());
      good = false;
      continue;
    }
    if ((*source)->text().size() > kMaxTableBytes) {
      add_failure(diagnostics, {"file_too_large", path, fmt::format("it has more than {} bytes", kMaxTableBytes),
                                "split it into several tables"});
      good = false;
      continue;
    }
    auto table = read_time_table(*source, diagnostics);
    if (table)
      tables.push_back(std::move(*table));
    else
      good = false;
  }
  if (!good) return std::nullopt;
  return tables;
}

namespace {

/// What a compilation for a face is told: which face, and the tables of times.
std::optional<compiler::CompileOptions> compile_options(const GlobalOptions& global, const std::string& face,
                                                        SourceFiles& sources, lang::Diagnostics& diagnostics) {
  auto tables = load_time_tables(global, sources, diagnostics);
  if (!tables) return std::nullopt;
  compiler::CompileOptions options;
  options.times = std::move(*tables);
  if (!face.ends_with(".nms")) options.face = face;  // a file that declares one is a root
  return options;
}

program::Failure no_such_face(const std::string& face) {
  const std::filesystem::path path(face);
  for (const char* geometry : {".obj", ".gltf", ".glb", ".x3d", ".x3dv", ".wrl"})
    if (path.extension() == geometry)
      return program::Failure{
          "unknown_face", face, "this is geometry; a face says in a .nms file what it is",
          fmt::format("write one beside it: face mine {{ surface \"{}\" }}", path.filename().string())};
  return program::Failure{"unknown_face", face, "there is no face of that name",
                          "the standard library has: ada; or give the path of a .nms file that declares one"};
}

/// The sources named, and the face's behind them; nothing if one of them is not there.
std::optional<std::vector<std::shared_ptr<const lang::Source>>> roots_with_face(const std::vector<std::string>& files,
                                                                                const std::string& face,
                                                                                SourceFiles& sources,
                                                                                lang::Diagnostics& diagnostics) {
  std::vector<std::shared_ptr<const lang::Source>> roots = load_roots(files, sources, diagnostics);
  if (diagnostics.error_count() != 0) return std::nullopt;
  if (face.empty()) return roots;
  const auto source = face_source(face, sources);
  if (!source) {
    add_failure(diagnostics, no_such_face(face));
    return std::nullopt;
  }
  if (std::find(roots.begin(), roots.end(), source) == roots.end()) roots.push_back(source);
  return roots;
}

std::optional<LoadedProgram> map_program(const GlobalOptions& global, const std::string& file,
                                         lang::Diagnostics& diagnostics) {
  if (!global.marks.empty()) {
    add_failure(diagnostics, {"wrong_input", file, "a compiled program has its times already",
                              "give --marks together with the sources"});
    return std::nullopt;
  }
  auto program = LoadedProgram::map(file);
  if (program) return std::move(*program);
  add_failure(diagnostics, program.error());
  return std::nullopt;
}

/// The program beside the one source named, if it is up to date. One that cannot be read is warned of: a text's program
/// may well be old, but not broken.
std::optional<LoadedProgram> map_beside(const GlobalOptions& global, const std::vector<std::string>& files,
                                        const std::string& face,
                                        const std::vector<std::shared_ptr<const lang::Source>>& roots,
                                        SourceFiles& sources, lang::Diagnostics& diagnostics) {
  const std::string path = files.size() == 1 && global.marks.empty() ? path_beside(files[0]) : std::string();
  std::error_code error;
  if (path.empty() || !std::filesystem::is_regular_file(path, error)) return std::nullopt;
  auto program = LoadedProgram::map(path);
  if (program) {
    if (!is_up_to_date(program->program(), roots, face.empty(), sources)) return std::nullopt;
    return std::move(*program);
  }
  program::Failure failure = program.error();
  if (failure.kind != "older_version" && failure.kind != "newer_version") {
    failure.remedy = "the source was compiled in its place; write it again with nmsc compile, or remove it";
    add_failure(diagnostics, failure, lang::Severity::warning);
  }
  return std::nullopt;
}

}  // namespace

void check_files(const GlobalOptions& global, const std::vector<std::string>& files, SourceFiles& sources,
                 lang::Diagnostics& diagnostics) {
  if (files.size() == 1 && is_program(files[0])) {
    static_cast<void>(map_program(global, files[0], diagnostics));
    return;
  }
  const auto roots = load_roots(files, sources, diagnostics);
  if (diagnostics.error_count() != 0) return;
  if (const auto options = compile_options(global, "", sources, diagnostics))
    compiler::check(roots, sources, diagnostics, *options);
}

std::optional<LoadedProgram> load_program(const GlobalOptions& global, const std::vector<std::string>& files,
                                          const std::string& face, SourceFiles& sources, lang::Diagnostics& diagnostics,
                                          Reuse reuse) {
  if (files.size() == 1 && is_program(files[0])) return map_program(global, files[0], diagnostics);
  const auto roots = roots_with_face(files, face, sources, diagnostics);
  if (!roots) return std::nullopt;
  if (reuse == Reuse::program_beside)
    if (auto program = map_beside(global, files, face, *roots, sources, diagnostics)) return program;
  const auto options = compile_options(global, face, sources, diagnostics);
  if (!options) return std::nullopt;
  InputRecorder recorder(sources);
  auto draft = compiler::compile(*roots, recorder, diagnostics, *options);
  if (!draft) return std::nullopt;
  // Whoever reads the program later gets what compiling would give, and that is no diagnostics; and the text alone has
  // no times from outside.
  if (reuse == Reuse::note_inputs && diagnostics.all().empty() && global.marks.empty()) recorder.note(*roots, *draft);
  auto image = checked_image(*draft, diagnostics);
  if (!image) return std::nullopt;
  return LoadedProgram(std::move(*image));
}

std::optional<program::Image> load_lexicon_program(const GlobalOptions& global, const std::string& file,
                                                   const std::string& lexicon, const std::string& face,
                                                   SourceFiles& sources, lang::Diagnostics& diagnostics,
                                                   compiler::TreeCache& trees) {
  const auto roots = roots_with_face({file}, face, sources, diagnostics);
  auto options = compile_options(global, face, sources, diagnostics);
  if (!roots || !options) return std::nullopt;
  options->lexicon = lexicon;
  options->trees = &trees;
  const auto draft = compiler::compile(*roots, sources, diagnostics, *options);
  return draft ? checked_image(*draft, diagnostics) : std::nullopt;
}

std::shared_ptr<const lang::Source> face_surface(const program::Program& program, const std::string& face,
                                                 SourceFiles& sources, lang::Diagnostics& diagnostics) {
  if (program.faces.empty()) {
    if (face.ends_with(".nms"))
      add_failure(diagnostics,
                  {"no_face", face, "it declares no face", "declare one: face mine { surface \"mine.obj\" }"});
    else
      add_failure(diagnostics, {"no_face", face.empty() ? "face" : face, "the program was compiled without a face",
                                "build from the sources, or compile them together with the face's .nms file"});
    return nullptr;
  }
  const std::string surface(program.string(program.faces[0].surface));
  if (face.ends_with(".nms")) {
    auto opened = sources.open((std::filesystem::path(face).parent_path() / surface).string());
    if (opened) return *opened;
    add_failure(diagnostics, opened.error());
    return nullptr;
  }
  auto source = sources.stdlib("faces/" + surface);
  if (!source)
    add_failure(diagnostics, {"cannot_read", "stdlib/faces/" + surface, "the face's surface is not there", ""});
  return source;
}

std::optional<runtime::Face> read_face(const program::Program& program, const lang::Source& surface,
                                       lang::Diagnostics& diagnostics) {
  auto read = runtime::read_face(surface.text(), surface.path(), runtime::face_form(program));
  if (read) return std::move(*read);
  add_failure(diagnostics, read.error());
  return std::nullopt;
}

namespace {

/// One warning for each place or region that is not there, however many muscles ask for it.
void warn_of_gaps(const program::Program& program, const std::vector<runtime::RigGap>& gaps,
                  lang::Diagnostics& diagnostics) {
  std::map<std::pair<bool, std::string>, std::vector<std::string>> users;
  for (const runtime::RigGap& gap : gaps)
    users[{gap.is_region, gap.name}].emplace_back(gap.muscle != program::kNone
                                                      ? program.string(program.muscles[gap.muscle].name)
                                                      : program.string(program.channels[gap.channel].name));
  const std::string face(program.faces.empty() ? std::string_view("face") : program.string(program.faces[0].name));
  for (const auto& [missing, names] : users) {
    const auto& [is_region, name] = missing;
    add_failure(diagnostics,
                {"face_incomplete", face,
                 fmt::format("it has no {} {}, so these do nothing: {}", is_region ? "region" : "landmark", name,
                             fmt::join(names, ", ")),
                 is_region ? "give the landmarks about it; nmsc face check says which" : "give the landmark"},
                lang::Severity::warning);
  }
}

}  // namespace

std::optional<runtime::Rig> bind_face(const runtime::Face& face, const program::Program& program,
                                      lang::Diagnostics& diagnostics) {
  std::vector<runtime::RigGap> gaps;
  auto rig = runtime::bind(face, program, &gaps);
  if (!rig) {
    add_failure(diagnostics, rig.error());
    return std::nullopt;
  }
  warn_of_gaps(program, gaps, diagnostics);
  return std::move(*rig);
}

std::optional<runtime::Face> load_face(const program::Program& program, const std::string& face, SourceFiles& sources,
                                       lang::Diagnostics& diagnostics) {
  const auto surface = face_surface(program, face, sources, diagnostics);
  return surface ? read_face(program, *surface, diagnostics) : std::nullopt;
}

const program::Clip* find_clip(const program::Program& program, const std::string& name, const std::string& file,
                               lang::Diagnostics& diagnostics) {
  if (const program::Clip* clip = program.find_clip(name)) return clip;
  std::vector<std::string> names;
  for (const program::Clip& c : program.clips) names.emplace_back(program.string(c.name));
  const auto close = lang::nearest(name, names);
  std::string remedy = names.empty()   ? "it has no clips: declare an expression, a timeline, an entry or an utterance"
                       : close.empty() ? fmt::format("nmsc list {} names the clips there are", file)
                                       : fmt::format("did you mean {}?", close.front());
  add_failure(diagnostics, {"unknown_clip", file, fmt::format("there is no clip named {}", name), std::move(remedy)});
  return nullptr;
}

}  // namespace nms::cli
