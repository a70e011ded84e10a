#include "command_line.h"

#include <cstdio>
#include <map>
#include <utility>

#include <fmt/format.h>

#include <nms/lang/diagnostic.h>

#include "warning_policy.h"

namespace nms::cli {

namespace {

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

CommandLine::CommandLine() : app_(kDescription, "nmsc") {
  app_.footer(kFooter);
  app_.require_subcommand(1);
  app_.set_version_flag("--version", "nmsc " NMS_VERSION);
  app_.set_help_flag("-h,--help", "Say what can be asked for");
  app_.fallthrough();
  add_global_options();
  add_build();
  add_compile();
  add_diff();
  add_doc();
  add_dump();
  add_check();
  add_explain();
  add_fmt();
  add_list();
  add_gloss();
  add_plot();
  add_preview();
  add_face();
  add_sample();
  add_test();
}

void CommandLine::add_global_options() {
  app_.add_option("--error-format", global_.error_format, "How diagnostics are printed on stderr: text, json or sarif")
      ->transform(CLI::CheckedTransformer(std::map<std::string, ErrorFormat>{{"text", ErrorFormat::text},
                                                                             {"json", ErrorFormat::json},
                                                                             {"sarif", ErrorFormat::sarif}})
                      .description(""))
      ->type_name("FORMAT");
  app_.add_option("--deny", global_.denied, "Exit 1 on these too: all warnings, a group or a kind of them")
      ->check([](const std::string& word) { return wrong_warning_name(word, true); })
      ->type_name("warnings|GROUP|KIND")
      ->take_all()
      ->expected(1);
  app_.add_option("--allow", global_.allowed, "Leave these out: a group or a kind of warnings")
      ->check([](const std::string& word) { return wrong_warning_name(word, false); })
      ->type_name("GROUP|KIND")
      ->take_all()
      ->expected(1);
  app_.add_option("--stdlib", global_.stdlib, "Folder to use as the standard library, instead of the one inside nmsc")
      ->check(CLI::Validator(CLI::ExistingDirectory).description(""))
      ->type_name("DIR");
  app_.add_option("--marks", global_.marks,
                  "Table of times of marks and signs, .csv or .json; may be given several times")
      ->type_name("TABLE")
      ->take_all()
      ->expected(1);
}

void CommandLine::add_build() {
  CLI::App* command =
      app_.add_subcommand("build", "Build an animated glTF file: a face, a clip for each thing that plays");
  CLI::Option* build_files = command->add_option("FILE", build_.files, "Sources, or one compiled .auc");
  command->add_option("-o,--output", build_.output, "The .glb to write; of a lexicon also a folder, a file an entry")
      ->required()
      ->type_name("OUT");
  CLI::Option* build_lexicon_option =
      command
          ->add_option("--lexicon", build_.lexicon,
                       "Every entry of a lexicon of the standard library, or of a .nms file, with a manifest")
          ->type_name("NAME");
  build_lexicon_option->excludes(build_files);
  command->add_option("--depfile", build_.depfile, "With --lexicon: write what was read, for Ninja and Make")
      ->needs(build_lexicon_option)
      ->type_name("OUT.d");
  command->add_option("--depfile-target", build_.depfile_target, "What the rule is for, if not what is built")
      ->needs(build_lexicon_option)
      ->type_name("PATH");
  command->add_option("--face", build_.face, "Face of the standard library, or a .nms file that declares one")
      ->type_name("NAME")
      ->capture_default_str();
  command->add_option("--clip", build_.clips, "Only this clip; may be given several times")
      ->type_name("NAME")
      ->take_all()
      ->expected(1);
  CLI::Option* on_avatar =
      command->add_option("--on", build_.avatar, "Write the clips into this avatar: ARKit, VRM 1.0 or FACS names")
          ->type_name("AVATAR.glb");
  command->add_flag("--all-targets", build_.all_targets,
                    "Write every action unit the face can show, not only those used");
  command
      ->add_option("--max-error", build_.max_error,
                   "Add corrective targets until no vertex is further than this from the runtime's surface (0.2mm), "
                   "and no normal by more than 3 degrees")
      ->type_name("LENGTH");
  command
      ->add_option("--max-corrections", build_.max_corrections,
                   "So many corrective targets a mesh at most: a smaller file, which may miss --max-error")
      ->type_name("COUNT")
      ->check(CLI::Range(0, 96))
      ->capture_default_str();
  command->add_flag("--report", build_.report,
                    "Measure every clip against the runtime's surface, and say where it is furthest off");
  command->add_flag("--dense", build_.dense, "Plain accessors for morph targets, for importers without sparse ones");
  command->add_flag("--quantize", build_.quantize,
                    "Vertices in whole numbers (KHR_mesh_quantization): less than half of the size");
  // An avatar brings its own face, and its targets as they are.
  for (const char* of_faces : {"--lexicon", "--face", "--all-targets", "--max-error", "--max-corrections", "--report",
                               "--dense", "--quantize"})
    on_avatar->excludes(of_faces);
  command->get_option("--max-corrections")->needs("--max-error");
  build_lexicon_option->excludes("--clip")->excludes("--report");  // every entry is made
  command->callback([this] {
    if (build_.files.empty() && build_.lexicon.empty()) throw CLI::RequiredError("FILE or --lexicon");
    chosen_ = [this] { return build_.lexicon.empty() ? build(global_, build_) : build_lexicon(global_, build_); };
  });
}

void CommandLine::add_compile() {
  CLI::App* command = app_.add_subcommand("compile", "Compile to an AU curve program (.auc)");
  command->add_option("FILE", files_, "Sources")->required();
  command->add_option("-o,--output", output_, "The .auc to write")->required()->type_name("OUT.auc");
  command->add_option("--face", compile_face_, "Describe this face's rig too, for build and preview")
      ->type_name("NAME");
  command->callback([this] { chosen_ = [this] { return compile(global_, files_, compile_face_, output_); }; });
}

void CommandLine::add_diff() {
  CLI::App* command = app_.add_subcommand("diff", "Say what changed in meaning between two versions");
  command->add_option("OLD", diff_.before, "A source, a folder of sources, or a compiled .auc")->required();
  command->add_option("NEW", diff_.after, "The same, later")->required();
  command->add_option("--old-stdlib", diff_.old_stdlib, "The standard library that OLD was written for")
      ->check(CLI::Validator(CLI::ExistingDirectory).description(""))
      ->type_name("DIR");
  add_format(command, diff_.json);
  command->footer(
      "\nReformatting, comments and names of components change nothing; values differ by more than 0.1 % or not at "
      "all,\n"
      "times by more than 1 ms. Exit: 0 nothing changed, 1 something did, 2 OLD or NEW has errors, or wrong usage.");
  command->callback([this] { chosen_ = [this] { return diff(global_, diff_); }; });
}

void CommandLine::add_doc() {
  CLI::App* command = app_.add_subcommand("doc", "Write pages about a lexicon, to look at in a browser");
  command
      ->add_option("--lexicon", doc_.lexicons,
                   "A lexicon of the standard library, or a .nms file; may be given several times")
      ->required()
      ->type_name("NAME")
      ->take_all()
      ->expected(1);
  command->add_option("-o,--output", doc_.output, "The folder to write")->required()->type_name("DIR");
  command
      ->add_option("--tests", doc_.tests,
                   "Sources whose tests are shown with the entries that they play, besides the lexicon's own")
      ->type_name("FILE...");
  command->add_option("--face", doc_.face, "Face of the standard library, or a .nms file that declares one")
      ->type_name("NAME")
      ->capture_default_str();
  command->add_option("--viewer", doc_.viewer, "Folder of viewer.js, which scripts/viewer makes")->type_name("DIR");
  command->callback([this] { chosen_ = [this] { return doc(global_, doc_); }; });
}

void CommandLine::add_dump() {
  CLI::App* command = app_.add_subcommand("dump", "Print a program as text");
  command->add_option("FILE", file_, "A source or a compiled .auc")->required();
  command->callback([this] { chosen_ = [this] { return dump(global_, file_); }; });
}

void CommandLine::add_check() {
  CLI::App* command = app_.add_subcommand("check", "Check sources, and write nothing");
  command->add_option("FILE", files_, "Sources")->required();
  command->callback([this] { chosen_ = [this] { return check(global_, files_); }; });
}

void CommandLine::add_explain() {
  CLI::App* command =
      app_.add_subcommand("explain", "Say what a kind of diagnostic means, or why action units are what they are");
  command->add_option("KIND|FILE", explain_.file,
                      "A kind of diagnostic, or a source; without either, all kinds are listed");
  CLI::Option* explain_clip = command->add_option("--clip", explain_.clip, "Of a source: the clip")->type_name("NAME");
  command->add_option("--at", explain_.time, "Of a source: the time, in seconds or with a unit")
      ->needs(explain_clip)
      ->type_name("T");
  command
      ->add_option("--channel", explain_.channel,
                   "AU4, AU4L, an axis (head_yaw) or a track (brows); without it, all that are not at rest")
      ->type_name("NAME");
  add_format(command, explain_.json);
  command->footer(
      "\nExamples: nmsc explain phases_shrunk\n"
      "          nmsc explain question.nms --clip where_is_the_book --at 0.6 --channel AU4");
  command->callback([&] {
    if (explain_.time.empty() && !explain_.clip.empty()) throw CLI::RequiredError("--at");
    chosen_ = [this] { return explain(global_, explain_); };
  });
}

void CommandLine::add_fmt() {
  CLI::App* command = app_.add_subcommand("fmt", "Rewrite sources in canonical form");
  command->add_option("FILE", files_, "Sources; - is formatted to standard output")->required();
  auto* fmt_check =
      command->add_flag("--check", fmt_check_, "Change nothing; exit 1 if a file is not in canonical form");
  auto* fmt_range =
      command->add_option("--range", fmt_lines_, "Only the statements on these lines, from 1; all else stays as it is")
          ->check([](const std::string& text) { return wrong_line_range(text); })
          ->type_name("FIRST:LAST");
  fmt_range->excludes(fmt_check);
  command->callback([this] { chosen_ = [this] { return format(global_, files_, {fmt_check_, fmt_lines_}); }; });
}

void CommandLine::add_list() {
  CLI::App* command = app_.add_subcommand("list", "Print a line for each clip: name, kind, seconds");
  command->add_option("FILE", files_, "Sources, or one compiled .auc")->required();
  command->add_flag("--entries", list_entries_,
                    "A line for each entry of their lexicons instead: lexicon, name, function, evidence, ids, "
                    "labels, meaning");
  command->callback([this] { chosen_ = [this] { return list(global_, files_, list_entries_); }; });
}

void CommandLine::add_gloss() {
  CLI::App* command = app_.add_subcommand("gloss", "Print utterances in overbar notation");
  command->add_option("FILE", file_, "A source or a compiled .auc")->required();
  command->add_option("--clip", gloss_clip_, "Only this clip")->type_name("NAME");
  command->callback([this] { chosen_ = [this] { return gloss(global_, file_, gloss_clip_); }; });
}

void CommandLine::add_plot() {
  CLI::App* command = app_.add_subcommand("plot", "Draw a clip's signs, bars and curves as SVG");
  command->add_option("FILE", plot_.file, "A source or a compiled .auc")->required();
  command->add_option("--clip", plot_.clip, "The clip")->required()->type_name("NAME");
  command->add_option("-o,--output", plot_.output, "The .svg to write; - is standard output")
      ->required()
      ->type_name("OUT.svg");
  command->add_option("--width", plot_.width, "Pixels across")
      ->check(CLI::Range(400, 20000))
      ->type_name("PX")
      ->capture_default_str();
  command->callback([this] { chosen_ = [this] { return plot(global_, plot_); }; });
}

void CommandLine::add_preview() {
  CLI::App* command = app_.add_subcommand("preview", "Draw a face at several times of a clip, as PNG");
  command->add_option("FILE", preview_.files, "Sources, or one compiled .auc");
  command->add_option("--clip", preview_.clip, "The clip")->type_name("NAME");
  command->add_option("-o,--output", preview_.output, "The .png to write")->required()->type_name("OUT.png");
  command->add_option("--face", preview_.face, "Face of the standard library, or a .nms file that declares one")
      ->type_name("NAME")
      ->capture_default_str();
  command->add_option("--at", preview_.times, "Times: seconds, or with a unit; else the signs' middles")
      ->type_name("T[,T...]");
  command
      ->add_option("--view", preview_.views,
                   "front, threequarter, side, left, right, back, above, below, or turns such as 20deg")
      ->type_name("VIEW[,VIEW...]")
      ->capture_default_str();
  command->add_option("--size", preview_size_, "Pixels of one picture: 300x360 unless said")->type_name("WxH");
  command->add_option("--columns", preview_.columns, "Pictures in a row")->check(CLI::Range(1, 100))->type_name("N");
  command->add_flag("--each-au", preview_.each_au, "Every action unit the face can show, instead of a clip")
      ->excludes("--clip")
      ->excludes("--at");
  command->callback([this] {
    if (!preview_size_.empty()) {
      const auto [width, height] = picture_size(preview_size_);
      preview_.width = width;
      preview_.height = height;
    }
    if (!preview_.each_au && (preview_.clip.empty() || preview_.files.empty()))
      throw CLI::RequiredError("FILE with --clip, or --each-au");
    chosen_ = [this] { return preview(global_, preview_); };
  });
}

void CommandLine::add_face() {
  CLI::App* face_command = app_.add_subcommand("face", "Look at a face, write it alone, or make one of a scan");
  face_command->require_subcommand(1);
  const auto add_face = [this](CLI::App* command) {
    command->add_option("FACE", face_name_, "Face of the standard library, or a .nms file that declares one")
        ->required();
  };
  CLI::App* face_check_command =
      face_command->add_subcommand("check", "Say what a face lacks: landmarks, parts, and what that costs");
  add_face(face_check_command);
  add_format(face_check_command, face_json_);
  face_check_command->callback([this] { chosen_ = [this] { return face_check(global_, face_name_, face_json_); }; });
  CLI::App* face_export_command =
      face_command->add_subcommand("export", "Write the face with every target and no clip, as .glb");
  add_face(face_export_command);
  face_export_command->add_option("-o,--output", output_, "The .glb to write")->required()->type_name("OUT.glb");
  face_export_command->callback([this] { chosen_ = [this] { return face_export(global_, face_name_, output_); }; });
  CLI::App* face_report_command = face_command->add_subcommand("report", "Say what a face can show, how far and where");
  face_report_command
      ->add_option("FACE", face_report_.face, "Face of the standard library, or a .nms file that declares one")
      ->required();
  face_report_command
      ->add_option("--lexicon", face_report_.lexicon,
                   "Say too which entries look the same: of the standard library, or of a .nms file")
      ->type_name("NAME");
  face_report_command
      ->add_option("--threshold", face_report_.threshold,
                   "Two entries look the same if no vertex is ever further apart")
      ->type_name("LENGTH")
      ->capture_default_str();
  add_format(face_report_command, face_report_.json);
  face_report_command->callback([this] { chosen_ = [this] { return face_report(global_, face_report_); }; });
  add_face_fit(face_command);
}

void CommandLine::add_face_fit(CLI::App* face) {
  CLI::App* command = face->add_subcommand("fit", "Lay a face's surfaces onto the scan of a person");
  command->add_option("SCAN", face_fit_.scan, "The scan, as OBJ")->required();
  command->add_option("--landmarks", face_fit_.landmarks, "Places on the scan by the face's names, as JSON")
      ->required()
      ->type_name("JSON");
  command->add_option("--face", face_fit_.face, "Face whose surfaces and muscles are taken")->capture_default_str();
  command->add_option("--unit", face_fit_.unit, "What one unit of the scan is")->capture_default_str();
  command->add_flag("--symmetric", face_fit_.symmetric, "Both halves alike, fitted to the mean of the scan's");
  command->add_option("-o,--output", face_fit_.output, "The .nms to write; its .x3d goes beside it")
      ->required()
      ->type_name("ME.nms");
  command->callback([this] { chosen_ = [this] { return face_fit(global_, face_fit_); }; });
}

void CommandLine::add_sample() {
  CLI::App* command = app_.add_subcommand("sample", "Print a clip's action units over time, as CSV");
  command->add_option("FILE", sample_.file, "A source or a compiled .auc")->required();
  command->add_option("--clip", sample_.clip, "The clip")->required()->type_name("NAME");
  auto* fps = command->add_option("--fps", sample_.fps, "Rows a second, over the whole clip")
                  ->check(CLI::Range(0.001, 1e6))
                  ->type_name("N");
  auto* at =
      command->add_option("--at", sample_.times, "Rows at these times: seconds, or with a unit")->type_name("T[,T...]");
  fps->excludes(at);
  command->add_option("--face", sample_.face, "Warn of action units this face cannot show")->type_name("NAME");
  command->callback([this] {
    if (sample_.fps != sample_.fps) throw CLI::ValidationError("--fps", "it is not a number");
    if (sample_.times.empty() && sample_.fps == 0.0) throw CLI::RequiredError("--fps or --at");
    chosen_ = [this] { return sample(global_, sample_); };
  });
}

void CommandLine::add_test() {
  CLI::App* command = app_.add_subcommand("test", "Run the tests that stand in sources");
  command->add_option("FILE", test_.files, "Sources")->required();
  command->add_option("--filter", test_.filter, "Only tests whose name holds this text")->type_name("TEXT");
  command->add_option("--junit", test_.junit, "Write the results as JUnit XML too")->type_name("OUT.xml");
  CLI::Option* mutate =
      command->add_flag("--mutate", test_.mutate,
                        "Take each part out of each entry of the lexicons that are tested, one at a time, and "
                        "print those that no test notices");
  mutate->excludes("--filter")->excludes("--junit");
  add_format(command, test_.json)->needs(mutate);
  command->callback(
      [this] { chosen_ = [this] { return test_.mutate ? test_mutate(global_, test_) : test(global_, test_); }; });
}

std::optional<int> CommandLine::parse(int argc, char** argv) {
  try {
    app_.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (const std::string wrong = wrong_command(app_, argc, argv); !wrong.empty()) {
      fmt::print(stderr, "nmsc: {}\nnmsc --help lists the commands\n", wrong);
      return kUsage;
    }
    return app_.exit(error) == 0 ? kSuccess : kUsage;
  }
  return std::nullopt;
}

}  // namespace nms::cli
