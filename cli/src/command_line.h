#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "commands.h"

namespace nms::cli {

/// What can be asked for on the command line, and what was.
class CommandLine {
 public:
  CommandLine();

  /// Fills in what is asked for. Returns an exit code where that is all: help, the version, or wrong usage, which is
  /// said on stderr.
  [[nodiscard]] std::optional<int> parse(int argc, char** argv);

  /// Runs the command. @pre parse() returned nothing
  [[nodiscard]] int run() const { return chosen_(); }

 private:
  void add_global_options();
  void add_build();
  void add_compile();
  void add_diff();
  void add_doc();
  void add_dump();
  void add_check();
  void add_explain();
  void add_fmt();
  void add_list();
  void add_gloss();
  void add_plot();
  void add_preview();
  void add_face();
  void add_face_fit(CLI::App* face);
  void add_sample();
  void add_test();

  CLI::App app_;
  std::function<int()> chosen_;
  GlobalOptions global_;
  BuildOptions build_;
  std::vector<std::string> files_;
  std::string file_;
  std::string output_;
  std::string compile_face_;
  DiffOptions diff_;
  DocOptions doc_;
  ExplainCommandOptions explain_;
  bool fmt_check_ = false;
  std::string fmt_lines_;
  bool list_entries_ = false;
  std::string gloss_clip_;
  PlotOptions plot_;
  PreviewOptions preview_;
  std::string preview_size_;
  std::string face_name_;
  bool face_json_ = false;
  FaceReportOptions face_report_;
  FaceFitOptions face_fit_;
  SampleOptions sample_;
  TestCommandOptions test_;
};

}  // namespace nms::cli
