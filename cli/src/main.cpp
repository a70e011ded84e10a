#include <clocale>
#include <cstdio>
#include <exception>
#include <functional>
#include <map>
#include <new>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <nms/lang/diagnostic.h>

#include "commands.h"
#include "warning_policy.h"

namespace {

using namespace nms::cli;

constexpr const char* kDescription =
    "nmsc compiles non-manual signs, the face and head movements that carry grammar in sign languages,\n"
    "to AU curve programs and animated glTF.";

constexpr const char* kFooter =
    "\nEvery command takes --error-format, --deny, --allow, --stdlib and --marks, before or behind its own options.\n"
    "Groups of warnings: names, ranges, rig, rules, timing; nmsc explain lists their kinds.\n"
    "FILE is a path, or - for standard input. Exit: 0 success, 1 errors in the input, 2 wrong usage.\n"
    "Example: nmsc build question.nms -o question.glb";

/// "300x360" as pixels.
std::pair<int, int> picture_size(const std::string& text) {
  int width = 0;
  int height = 0;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%5dx%5d%c", &width, &height, &rest) != 2 || width < 16 || height < 16 ||
      width > 4096 || height > 4096)
    throw CLI::ValidationError("--size", "it is WxH in pixels, each from 16 to 4096: 300x360");
  return {width, height};
}

/// `--format text|json` of a command that prints data.
CLI::Option* add_format(CLI::App* command, bool& json) {
  return command
      ->add_option_function<std::string>(
          "--format", [&json](const std::string& format) { json = format == "json"; }, "text or json")
      ->check(CLI::IsMember({"text", "json"}).description(""))
      ->type_name("FORMAT");
}

/// What is wrong with the command's name, `build` or `face check`, if that is what is wrong.
std::string wrong_command(const CLI::App& app, int argc, char** argv) {
  if (argc < 2 || argv[1][0] == '-') return {};
  const std::vector<CLI::App*> chosen = app.get_subcommands();
  const CLI::App* of = chosen.empty() ? &app : chosen.front();
  const int at = chosen.empty() ? 1 : 2;
  if (at >= argc || argv[at][0] == '-' || !of->get_subcommands().empty()) return {};
  std::vector<std::string> names;
  for (const CLI::App* command : of->get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(command->get_name());
  if (names.empty()) return {};
  const std::string asked = at == 1 ? argv[at] : fmt::format("{} {}", argv[1], argv[at]);
  if (asked == "fit")
    return "there is no command fit; nmsc face fit lays a face onto a scan, nmsc-fit beside nmsc fits muscles";
  const auto close = nms::lang::nearest(argv[at], names);
  return fmt::format("there is no command {}{}", asked,
                     close.empty() ? std::string() : fmt::format("; did you mean {}?", close.front()));
}

}  // namespace

int main(int argc, char** argv) try {
  CLI::App app{kDescription, "nmsc"};
  app.footer(kFooter);
  app.require_subcommand(1);
  app.set_version_flag("--version", "nmsc " NMS_VERSION);
  app.set_help_flag("-h,--help", "Say what can be asked for");
  app.fallthrough();

  GlobalOptions global;
  app.add_option("--error-format", global.error_format, "How diagnostics are printed on stderr: text, json or sarif")
      ->transform(CLI::CheckedTransformer(std::map<std::string, ErrorFormat>{{"text", ErrorFormat::text},
                                                                             {"json", ErrorFormat::json},
                                                                             {"sarif", ErrorFormat::sarif}})
                      .description(""))
      ->type_name("FORMAT");
  app.add_option("--deny", global.denied, "Exit 1 on these too: all warnings, a group or a kind of them")
      ->check([](const std::string& word) { return wrong_warning_name(word, true); })
      ->type_name("warnings|GROUP|KIND")
      ->take_all()
      ->expected(1);
  app.add_option("--allow", global.allowed, "Leave these out: a group or a kind of warnings")
      ->check([](const std::string& word) { return wrong_warning_name(word, false); })
      ->type_name("GROUP|KIND")
      ->take_all()
      ->expected(1);
  app.add_option("--stdlib", global.stdlib, "Folder to use as the standard library, instead of the one inside nmsc")
      ->check(CLI::Validator(CLI::ExistingDirectory).description(""))
      ->type_name("DIR");
  app.add_option("--marks", global.marks,
                 "Table of times of marks and signs, .csv or .json; may be given several times")
      ->type_name("TABLE")
      ->take_all()
      ->expected(1);

  std::function<int()> chosen;

  BuildOptions build_options;
  CLI::App* build_command =
      app.add_subcommand("build", "Build an animated glTF file: a face, a clip for each thing that plays");
  CLI::Option* build_files = build_command->add_option("FILE", build_options.files, "Sources, or one compiled .auc");
  build_command
      ->add_option("-o,--output", build_options.output,
                   "The .glb to write; of a lexicon also a folder, a file an entry")
      ->required()
      ->type_name("OUT");
  CLI::Option* build_lexicon_option =
      build_command
          ->add_option("--lexicon", build_options.lexicon,
                       "Every entry of a lexicon of the standard library, or of a .nms file, with a manifest")
          ->type_name("NAME");
  build_lexicon_option->excludes(build_files);
  build_command
      ->add_option("--depfile", build_options.depfile, "With --lexicon: write what was read, for Ninja and Make")
      ->needs(build_lexicon_option)
      ->type_name("OUT.d");
  build_command
      ->add_option("--depfile-target", build_options.depfile_target, "What the rule is for, if not what is built")
      ->needs(build_lexicon_option)
      ->type_name("PATH");
  build_command
      ->add_option("--face", build_options.face, "Face of the standard library, or a .nms file that declares one")
      ->type_name("NAME")
      ->capture_default_str();
  build_command->add_option("--clip", build_options.clips, "Only this clip; may be given several times")
      ->type_name("NAME")
      ->take_all()
      ->expected(1);
  CLI::Option* on_avatar =
      build_command
          ->add_option("--on", build_options.avatar, "Write the clips into this avatar: ARKit, VRM 1.0 or FACS names")
          ->type_name("AVATAR.glb");
  build_command->add_flag("--all-targets", build_options.all_targets,
                          "Write every action unit the face can show, not only those used");
  build_command
      ->add_option("--max-error", build_options.max_error,
                   "Add corrective targets until no vertex is further than this from the runtime's surface (0.2mm), "
                   "and no normal by more than 3 degrees")
      ->type_name("LENGTH");
  build_command
      ->add_option("--max-corrections", build_options.max_corrections,
                   "So many corrective targets a mesh at most: a smaller file, which may miss --max-error")
      ->type_name("COUNT")
      ->check(CLI::Range(0, 96))
      ->capture_default_str();
  build_command->add_flag("--report", build_options.report,
                          "Measure every clip against the runtime's surface, and say where it is furthest off");
  build_command->add_flag("--dense", build_options.dense,
                          "Plain accessors for morph targets, for importers without sparse ones");
  build_command->add_flag("--quantize", build_options.quantize,
                          "Vertices in whole numbers (KHR_mesh_quantization): less than half of the size");
  // An avatar brings its own face, and its targets as they are.
  for (const char* of_faces : {"--lexicon", "--face", "--all-targets", "--max-error", "--max-corrections", "--report",
                               "--dense", "--quantize"})
    on_avatar->excludes(of_faces);
  build_command->get_option("--max-corrections")->needs("--max-error");
  build_lexicon_option->excludes("--clip")->excludes("--report");  // every entry is made
  build_command->callback([&] {
    if (build_options.files.empty() && build_options.lexicon.empty()) throw CLI::RequiredError("FILE or --lexicon");
    chosen = [&] {
      return build_options.lexicon.empty() ? build(global, build_options) : build_lexicon(global, build_options);
    };
  });

  std::vector<std::string> files;
  std::string file;
  std::string output;
  CLI::App* compile_command = app.add_subcommand("compile", "Compile to an AU curve program (.auc)");
  compile_command->add_option("FILE", files, "Sources")->required();
  compile_command->add_option("-o,--output", output, "The .auc to write")->required()->type_name("OUT.auc");
  std::string compile_face;
  compile_command->add_option("--face", compile_face, "Describe this face's rig too, for build and preview")
      ->type_name("NAME");
  compile_command->callback([&] { chosen = [&] { return compile(global, files, compile_face, output); }; });

  DiffOptions diff_options;
  CLI::App* diff_command = app.add_subcommand("diff", "Say what changed in meaning between two versions");
  diff_command->add_option("OLD", diff_options.before, "A source, a folder of sources, or a compiled .auc")->required();
  diff_command->add_option("NEW", diff_options.after, "The same, later")->required();
  diff_command->add_option("--old-stdlib", diff_options.old_stdlib, "The standard library that OLD was written for")
      ->check(CLI::Validator(CLI::ExistingDirectory).description(""))
      ->type_name("DIR");
  add_format(diff_command, diff_options.json);
  diff_command->footer(
      "\nReformatting, comments and names of components change nothing; values differ by more than 0.1 % or not at "
      "all,\n"
      "times by more than 1 ms. Exit: 0 nothing changed, 1 something did, 2 OLD or NEW has errors, or wrong usage.");
  diff_command->callback([&] { chosen = [&] { return diff(global, diff_options); }; });

  DocOptions doc_options;
  CLI::App* doc_command = app.add_subcommand("doc", "Write pages about a lexicon, to look at in a browser");
  doc_command
      ->add_option("--lexicon", doc_options.lexicons,
                   "A lexicon of the standard library, or a .nms file; may be given several times")
      ->required()
      ->type_name("NAME")
      ->take_all()
      ->expected(1);
  doc_command->add_option("-o,--output", doc_options.output, "The folder to write")->required()->type_name("DIR");
  doc_command
      ->add_option("--tests", doc_options.tests,
                   "Sources whose tests are shown with the entries that they play, besides the lexicon's own")
      ->type_name("FILE...");
  doc_command->add_option("--face", doc_options.face, "Face of the standard library, or a .nms file that declares one")
      ->type_name("NAME")
      ->capture_default_str();
  doc_command->add_option("--viewer", doc_options.viewer, "Folder of viewer.js, which scripts/viewer makes")
      ->type_name("DIR");
  doc_command->callback([&] { chosen = [&] { return doc(global, doc_options); }; });

  CLI::App* dump_command = app.add_subcommand("dump", "Print a program as text");
  dump_command->add_option("FILE", file, "A source or a compiled .auc")->required();
  dump_command->callback([&] { chosen = [&] { return dump(global, file); }; });

  CLI::App* check_command = app.add_subcommand("check", "Check sources, and write nothing");
  check_command->add_option("FILE", files, "Sources")->required();
  check_command->callback([&] { chosen = [&] { return check(global, files); }; });

  ExplainCommandOptions explain_options;
  CLI::App* explain_command =
      app.add_subcommand("explain", "Say what a kind of diagnostic means, or why action units are what they are");
  explain_command->add_option("KIND|FILE", explain_options.file,
                              "A kind of diagnostic, or a source; without either, all kinds are listed");
  CLI::Option* explain_clip =
      explain_command->add_option("--clip", explain_options.clip, "Of a source: the clip")->type_name("NAME");
  explain_command->add_option("--at", explain_options.time, "Of a source: the time, in seconds or with a unit")
      ->needs(explain_clip)
      ->type_name("T");
  explain_command
      ->add_option("--channel", explain_options.channel,
                   "AU4, AU4L, an axis (head_yaw) or a track (brows); without it, all that are not at rest")
      ->type_name("NAME");
  add_format(explain_command, explain_options.json);
  explain_command->footer(
      "\nExamples: nmsc explain phases_shrunk\n"
      "          nmsc explain question.nms --clip where_is_the_book --at 0.6 --channel AU4");
  explain_command->callback([&] {
    if (explain_options.time.empty() && !explain_options.clip.empty()) throw CLI::RequiredError("--at");
    chosen = [&] { return explain(global, explain_options); };
  });

  bool check_only = false;
  std::string fmt_lines;
  CLI::App* fmt_command = app.add_subcommand("fmt", "Rewrite sources in canonical form");
  fmt_command->add_option("FILE", files, "Sources; - is formatted to standard output")->required();
  auto* fmt_check =
      fmt_command->add_flag("--check", check_only, "Change nothing; exit 1 if a file is not in canonical form");
  auto* fmt_range =
      fmt_command
          ->add_option("--range", fmt_lines, "Only the statements on these lines, from 1; all else stays as it is")
          ->check([](const std::string& text) { return wrong_line_range(text); })
          ->type_name("FIRST:LAST");
  fmt_range->excludes(fmt_check);
  fmt_command->callback([&] { chosen = [&] { return format(global, files, {check_only, fmt_lines}); }; });

  CLI::App* list_command = app.add_subcommand("list", "Print a line for each clip: name, kind, seconds");
  list_command->add_option("FILE", files, "Sources, or one compiled .auc")->required();
  bool list_entries = false;
  list_command->add_flag("--entries", list_entries,
                         "A line for each entry of their lexicons instead: lexicon, name, function, evidence, ids, "
                         "labels, meaning");
  list_command->callback([&] { chosen = [&] { return list(global, files, list_entries); }; });

  std::string gloss_clip;
  CLI::App* gloss_command = app.add_subcommand("gloss", "Print utterances in overbar notation");
  gloss_command->add_option("FILE", file, "A source or a compiled .auc")->required();
  gloss_command->add_option("--clip", gloss_clip, "Only this clip")->type_name("NAME");
  gloss_command->callback([&] { chosen = [&] { return gloss(global, file, gloss_clip); }; });

  PlotOptions plot_options;
  CLI::App* plot_command = app.add_subcommand("plot", "Draw a clip's signs, bars and curves as SVG");
  plot_command->add_option("FILE", plot_options.file, "A source or a compiled .auc")->required();
  plot_command->add_option("--clip", plot_options.clip, "The clip")->required()->type_name("NAME");
  plot_command->add_option("-o,--output", plot_options.output, "The .svg to write; - is standard output")
      ->required()
      ->type_name("OUT.svg");
  plot_command->add_option("--width", plot_options.width, "Pixels across")
      ->check(CLI::Range(400, 20000))
      ->type_name("PX")
      ->capture_default_str();
  plot_command->callback([&] { chosen = [&] { return plot(global, plot_options); }; });

  PreviewOptions preview_options;
  std::string size;
  CLI::App* preview_command = app.add_subcommand("preview", "Draw a face at several times of a clip, as PNG");
  preview_command->add_option("FILE", preview_options.files, "Sources, or one compiled .auc");
  preview_command->add_option("--clip", preview_options.clip, "The clip")->type_name("NAME");
  preview_command->add_option("-o,--output", preview_options.output, "The .png to write")
      ->required()
      ->type_name("OUT.png");
  preview_command
      ->add_option("--face", preview_options.face, "Face of the standard library, or a .nms file that declares one")
      ->type_name("NAME")
      ->capture_default_str();
  preview_command->add_option("--at", preview_options.times, "Times: seconds, or with a unit; else the signs' middles")
      ->type_name("T[,T...]");
  preview_command
      ->add_option("--view", preview_options.views,
                   "front, threequarter, side, left, right, back, above, below, or turns such as 20deg")
      ->type_name("VIEW[,VIEW...]")
      ->capture_default_str();
  preview_command->add_option("--size", size, "Pixels of one picture: 300x360 unless said")->type_name("WxH");
  preview_command->add_option("--columns", preview_options.columns, "Pictures in a row")
      ->check(CLI::Range(1, 100))
      ->type_name("N");
  preview_command
      ->add_flag("--each-au", preview_options.each_au, "Every action unit the face can show, instead of a clip")
      ->excludes("--clip")
      ->excludes("--at");
  preview_command->callback([&] {
    if (!size.empty()) {
      const auto [width, height] = picture_size(size);
      preview_options.width = width;
      preview_options.height = height;
    }
    if (!preview_options.each_au && (preview_options.clip.empty() || preview_options.files.empty()))
      throw CLI::RequiredError("FILE with --clip, or --each-au");
    chosen = [&] { return preview(global, preview_options); };
  });

  std::string face_name;
  bool face_json = false;
  CLI::App* face_command = app.add_subcommand("face", "Look at a face, write it alone, or make one of a scan");
  face_command->require_subcommand(1);
  const auto add_face = [&](CLI::App* command) {
    command->add_option("FACE", face_name, "Face of the standard library, or a .nms file that declares one")
        ->required();
  };
  CLI::App* face_check_command =
      face_command->add_subcommand("check", "Say what a face lacks: landmarks, parts, and what that costs");
  add_face(face_check_command);
  add_format(face_check_command, face_json);
  face_check_command->callback([&] { chosen = [&] { return face_check(global, face_name, face_json); }; });
  CLI::App* face_export_command =
      face_command->add_subcommand("export", "Write the face with every target and no clip, as .glb");
  add_face(face_export_command);
  face_export_command->add_option("-o,--output", output, "The .glb to write")->required()->type_name("OUT.glb");
  face_export_command->callback([&] { chosen = [&] { return face_export(global, face_name, output); }; });
  FaceReportOptions face_report_options;
  CLI::App* face_report_command = face_command->add_subcommand("report", "Say what a face can show, how far and where");
  face_report_command
      ->add_option("FACE", face_report_options.face, "Face of the standard library, or a .nms file that declares one")
      ->required();
  face_report_command
      ->add_option("--lexicon", face_report_options.lexicon,
                   "Say too which entries look the same: of the standard library, or of a .nms file")
      ->type_name("NAME");
  face_report_command
      ->add_option("--threshold", face_report_options.threshold,
                   "Two entries look the same if no vertex is ever further apart")
      ->type_name("LENGTH")
      ->capture_default_str();
  add_format(face_report_command, face_report_options.json);
  face_report_command->callback([&] { chosen = [&] { return face_report(global, face_report_options); }; });

  FaceFitOptions fit_options;
  CLI::App* fit_command = face_command->add_subcommand("fit", "Lay a face's surfaces onto the scan of a person");
  fit_command->add_option("SCAN", fit_options.scan, "The scan, as OBJ")->required();
  fit_command->add_option("--landmarks", fit_options.landmarks, "Places on the scan by the face's names, as JSON")
      ->required()
      ->type_name("JSON");
  fit_command->add_option("--face", fit_options.face, "Face whose surfaces and muscles are taken")
      ->capture_default_str();
  fit_command->add_option("--unit", fit_options.unit, "What one unit of the scan is")->capture_default_str();
  fit_command->add_flag("--symmetric", fit_options.symmetric, "Both halves alike, fitted to the mean of the scan's");
  fit_command->add_option("-o,--output", fit_options.output, "The .nms to write; its .x3d goes beside it")
      ->required()
      ->type_name("ME.nms");
  fit_command->callback([&] { chosen = [&] { return face_fit(global, fit_options); }; });

  SampleOptions sample_options;
  CLI::App* sample_command = app.add_subcommand("sample", "Print a clip's action units over time, as CSV");
  sample_command->add_option("FILE", sample_options.file, "A source or a compiled .auc")->required();
  sample_command->add_option("--clip", sample_options.clip, "The clip")->required()->type_name("NAME");
  auto* fps = sample_command->add_option("--fps", sample_options.fps, "Rows a second, over the whole clip")
                  ->check(CLI::Range(0.001, 1e6))
                  ->type_name("N");
  auto* at = sample_command->add_option("--at", sample_options.times, "Rows at these times: seconds, or with a unit")
                 ->type_name("T[,T...]");
  fps->excludes(at);
  sample_command->add_option("--face", sample_options.face, "Warn of action units this face cannot show")
      ->type_name("NAME");
  sample_command->callback([&] {
    if (sample_options.fps != sample_options.fps) throw CLI::ValidationError("--fps", "it is not a number");
    if (sample_options.times.empty() && sample_options.fps == 0.0) throw CLI::RequiredError("--fps or --at");
    chosen = [&] { return sample(global, sample_options); };
  });

  TestCommandOptions test_options;
  CLI::App* test_command = app.add_subcommand("test", "Run the tests that stand in sources");
  test_command->add_option("FILE", test_options.files, "Sources")->required();
  test_command->add_option("--filter", test_options.filter, "Only tests whose name holds this text")->type_name("TEXT");
  test_command->add_option("--junit", test_options.junit, "Write the results as JUnit XML too")->type_name("OUT.xml");
  CLI::Option* mutate =
      test_command->add_flag("--mutate", test_options.mutate,
                             "Take each part out of each entry of the lexicons that are tested, one at a time, and "
                             "print those that no test notices");
  mutate->excludes("--filter")->excludes("--junit");
  add_format(test_command, test_options.json)->needs(mutate);
  test_command->callback([&] {
    chosen = [&] { return test_options.mutate ? test_mutate(global, test_options) : test(global, test_options); };
  });

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (const std::string wrong = wrong_command(app, argc, argv); !wrong.empty()) {
      fmt::print(stderr, "nmsc: {}\nnmsc --help lists the commands\n", wrong);
      return kUsage;
    }
    const int code = app.exit(error);
    return code == 0 ? kSuccess : kUsage;
  }
  const int code = chosen();
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) {
    fmt::print(stderr,
               "nmsc: error cannot_write: standard output cannot take more: it is closed, or its disk is full\n");
    return kErrors;
  }
  return code;
} catch (const std::bad_alloc&) {
  std::fputs("nmsc: error out_of_memory: there is not enough memory for this input\n", stderr);
  return kErrors;
}
