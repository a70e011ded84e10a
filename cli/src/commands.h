#pragma once

#include <string>
#include <vector>

/// The commands, one function each: options in, exit code out. main.cpp fills the options in.
namespace nms::cli {

/// 0 success, 1 diagnostics with errors, 2 wrong usage.
inline constexpr int kSuccess = 0;
inline constexpr int kErrors = 1;
inline constexpr int kUsage = 2;

enum class ErrorFormat { text, json, sarif };

struct GlobalOptions {
  ErrorFormat error_format = ErrorFormat::text;
  std::vector<std::string> denied;   ///< "warnings", groups and kinds that count as errors
  std::vector<std::string> allowed;  ///< groups and kinds that are left out
  std::string stdlib;                ///< folder that takes the place of the embedded stdlib; empty: the embedded one
  std::vector<std::string> marks;    ///< tables of times, .csv or .json
};

struct BuildOptions {
  std::vector<std::string> files;
  std::string output;
  std::string lexicon;         ///< a lexicon to build into a folder or a file, instead of files; empty: none
  std::string depfile;         ///< with a lexicon: where to write what was read, as a rule for Make; empty: nowhere
  std::string depfile_target;  ///< what that rule is for; empty: the manifest, or the one file
  std::string avatar;          ///< a .glb to write the clips into; empty: a face of ours
  std::string face = "ada";
  std::vector<std::string> clips;
  bool all_targets = false;
  bool dense = false;
  bool quantize = false;
  std::string max_error;             ///< a length, or empty
  std::size_t max_corrections = 96;  ///< targets that it may add to a mesh
  bool report = false;
};
int build(const GlobalOptions& global, const BuildOptions& options);
int build_lexicon(const GlobalOptions& global, const BuildOptions& options);

struct FaceFitOptions {
  std::string scan;
  std::string landmarks;  ///< a JSON file
  std::string face = "ada";
  std::string unit = "1mm";  ///< of the scan and the landmarks
  bool symmetric = false;    ///< both halves alike
  std::string output;        ///< a .nms; its .x3d stands beside it
};
int face_fit(const GlobalOptions& global, const FaceFitOptions& options);

int check(const GlobalOptions& global, const std::vector<std::string>& files);

/// @param face  the face whose rig description goes into the program; empty: none
int compile(const GlobalOptions& global, const std::vector<std::string>& files, const std::string& face,
            const std::string& output);

struct DiffOptions {
  std::string before;
  std::string after;
  std::string old_stdlib;  ///< the standard library of `before`; empty: the same as of `after`
  bool json = false;
};
/// What changed in meaning. 0: nothing, 1: something, 2: one of the two could not be read.
int diff(const GlobalOptions& global, const DiffOptions& options);

struct DocOptions {
  std::vector<std::string> lexicons;  ///< as in BuildOptions::lexicon
  std::vector<std::string> tests;     ///< files whose tests are shown with the entries that they play
  std::string output;                 ///< folder
  std::string face = "ada";
  std::string viewer;  ///< folder of viewer.js; empty: where it is installed or built
};
/// Pages about lexicons: an index, and for each entry its moving face, plot, text, sources and tests.
int doc(const GlobalOptions& global, const DocOptions& options);

int dump(const GlobalOptions& global, const std::string& file);

struct ExplainCommandOptions {
  std::string file;  ///< or a kind of diagnostic
  std::string clip;  ///< empty: a kind is asked for
  std::string time;
  std::string channel;  ///< empty: all that are not at rest
  bool json = false;
};
/// A page of the diagnostic kind `options.file`, or the list of all kinds if that is empty; with a clip, why a channel
/// is what it is: every cause of its value, and how they were merged.
int explain(const GlobalOptions& global, const ExplainCommandOptions& options);

struct FormatOptions {
  bool check_only = false;
  std::string lines;  ///< "FIRST:LAST", from 1; empty: all
};
int format(const GlobalOptions& global, const std::vector<std::string>& files, const FormatOptions& options);
/// Why the text is no range of lines; empty: it is one.
[[nodiscard]] std::string wrong_line_range(const std::string& text);

/// Overbar notation of every utterance, or of one clip if `clip` is not empty.
int gloss(const GlobalOptions& global, const std::string& file, const std::string& clip);

/// What a face lacks, and what that costs it.
int face_check(const GlobalOptions& global, const std::string& face, bool json);

/// A face with every target and no clip.
int face_export(const GlobalOptions& global, const std::string& face, const std::string& output);

struct FaceReportOptions {
  std::string face;
  std::string lexicon;            ///< empty: none
  std::string threshold = "1mm";  ///< entries that differ by no more look the same
  bool json = false;
};
/// What a face can show, and which entries of a lexicon look the same on it.
int face_report(const GlobalOptions& global, const FaceReportOptions& options);

/// @param entries  the entries that the sources declare, in place of what plays
int list(const GlobalOptions& global, const std::vector<std::string>& files, bool entries);

struct PlotOptions {
  std::string file;
  std::string clip;
  std::string output;  ///< "-": standard output
  int width = 1000;    ///< [px]
};
int plot(const GlobalOptions& global, const PlotOptions& options);

struct PreviewOptions {
  std::vector<std::string> files;  ///< may be empty if `each_au`
  std::string output;
  std::string face = "ada";
  std::string clip;
  std::string times;  ///< as in SampleOptions; empty: those that show most
  std::string views = "front";
  int width = 300;   ///< [px] of one picture
  int height = 360;  ///< [px]
  int columns = 0;   ///< 0: by the number of pictures
  bool each_au = false;
};
int preview(const GlobalOptions& global, const PreviewOptions& options);

struct SampleOptions {
  std::string file;
  std::string clip;
  std::string face;   ///< empty: none
  double fps = 0.0;   ///< 0: use `times`
  std::string times;  ///< "0.234,2.106"; seconds, or with a unit
};
int sample(const GlobalOptions& global, const SampleOptions& options);

struct TestCommandOptions {
  std::vector<std::string> files;
  std::string filter;  ///< only tests whose name holds it
  std::string junit;   ///< the XML to write; empty: none
  bool mutate = false;
  bool json = false;  ///< of what `mutate` finds
};
int test(const GlobalOptions& global, const TestCommandOptions& options);
/// Takes parts out of the lexicons' entries, one at a time, and says which of them no test notices.
int test_mutate(const GlobalOptions& global, const TestCommandOptions& options);

}  // namespace nms::cli
