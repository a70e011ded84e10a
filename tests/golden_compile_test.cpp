// What the compiler says of a source, and what it makes of it.
//   tests/golden/check/*.nms    beside the diagnostics as text
//   tests/golden/program/*.nms  beside the clips of the compiled program as text
//   tests/golden/test/*.nms     beside how its tests come out
// A table of times X.csv or X.json goes with X.nms.
// Both see the small library of tests/golden/stdlib, so that they do not change with the real one.
// NMS_REFRESH=1 rewrites the expectations; what changed is then read in the diff.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nms/compiler/compile.h>
#include <nms/compiler/diagnostic_kinds.h>
#include <nms/compiler/mutation.h>
#include <nms/compiler/test.h>
#include <nms/lang/render.h>
#include <nms/program/play.h>
#include <nms/program/text.h>

#include "../cli/src/time_table_file.h"

namespace {

using namespace nms;
namespace fs = std::filesystem;

const fs::path kGolden = fs::path(NMS_SOURCE_DIR) / "tests/golden";

std::string read(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

/// Files of one golden folder and the golden library, under the same paths on every machine.
class GoldenFiles : public lang::SourceProvider {
 public:
  explicit GoldenFiles(fs::path folder) : folder_(std::move(folder)) {}

  std::shared_ptr<const lang::Source> find(std::string_view name, std::string_view from) override {
    const fs::path beside = (fs::path(from).parent_path() / name).lexically_normal();
    for (const fs::path& path : {beside, fs::path(beside) += ".nms"})
      if (!from.empty())
        if (auto source = open(path.generic_string(), folder_ / path)) return source;
    return open("stdlib/" + std::string(name), kGolden / "stdlib" / name);
  }

  std::shared_ptr<const lang::Source> open(const std::string& name, const fs::path& path) {
    if (const auto it = known_.find(name); it != known_.end()) return it->second;
    if (!fs::is_regular_file(path)) return nullptr;
    return known_[name] = std::make_shared<const lang::Source>(name, read(path));
  }

 private:
  fs::path folder_;
  std::map<std::string, std::shared_ptr<const lang::Source>> known_;
};

/// The tables of times that stand beside a source: X.csv and X.json for X.nms.
std::vector<compiler::TimeTable> tables(const fs::path& path, GoldenFiles& files, lang::Diagnostics& diagnostics) {
  std::vector<compiler::TimeTable> out;
  for (const char* ending : {".csv", ".json"}) {
    fs::path table = path;
    table.replace_extension(ending);
    const auto source = files.open(table.filename().string(), table);
    auto read = source ? cli::read_time_table(source, diagnostics) : std::nullopt;
    if (read) out.push_back(std::move(*read));
  }
  return out;
}

struct Compiled {
  lang::Diagnostics diagnostics;
  std::optional<program::Image> image;
};

Compiled compiled(const fs::path& path) {
  GoldenFiles files(path.parent_path());
  Compiled out;
  compiler::CompileOptions options;
  options.times = tables(path, files, out.diagnostics);
  const auto draft = compiler::compile({files.open(path.filename().string(), path)}, files, out.diagnostics, options);
  if (draft) {
    auto image = program::Image::from(*draft);
    EXPECT_TRUE(image) << path << ": " << (image ? "" : image.error().cause);
    if (image) out.image.emplace(std::move(*image));
  }
  out.diagnostics.sort();
  return out;
}

std::vector<fs::path> cases(const char* folder) {
  std::vector<fs::path> paths;
  for (const fs::directory_entry& e : fs::directory_iterator(kGolden / folder))
    if (e.path().extension() == ".nms") paths.push_back(e.path());
  std::sort(paths.begin(), paths.end());
  return paths;
}

void compare(const fs::path& path, const std::string& got) {
  fs::path expected = path;
  expected.replace_extension(".expect");
  if (std::getenv("NMS_REFRESH") != nullptr) std::ofstream(expected, std::ios::binary) << got;
  EXPECT_EQ(got, read(expected));
}

TEST(GoldenCheck, diagnostics_are_as_expected) {
  for (const fs::path& path : cases("check")) {
    SCOPED_TRACE(path.filename().string());
    const Compiled c = compiled(path);
    compare(path, lang::render_text(c.diagnostics, false));
    EXPECT_EQ(c.image.has_value(), c.diagnostics.error_count() == 0) << "errors and a program, or neither";
  }
}

/// All that is known of the diagnostics, places and fields too.
std::string told(lang::Diagnostics& diagnostics) {
  diagnostics.sort();
  return lang::render_json(diagnostics) + lang::render_text(diagnostics, false);
}

std::string told_by_check(const fs::path& folder, const std::string& name, const fs::path& path) {
  GoldenFiles files(folder);
  lang::Diagnostics diagnostics;
  compiler::CompileOptions options;
  options.times = tables(path, files, diagnostics);
  compiler::check({files.open(name, path)}, files, diagnostics, options);
  return told(diagnostics);
}

TEST(GoldenCheck, check_says_what_compile_says) {
  for (const char* folder : {"check", "program", "test"})
    for (const fs::path& path : cases(folder)) {
      SCOPED_TRACE(path.filename().string());
      Compiled c = compiled(path);
      const std::string first = told_by_check(path.parent_path(), path.filename().string(), path);
      EXPECT_EQ(first, told(c.diagnostics));
      EXPECT_EQ(first, told_by_check(path.parent_path(), path.filename().string(), path)) << "the second time";
    }
}

// What check does not draw it may have to draw after all: to count knots near the limit, or for a timeline.
TEST(GoldenCheck, check_says_what_compile_says_of_large_and_of_entangled_sources) {
  std::string many = "pose p = 50% AU1 + 50% AU12 + 90% AU4\n";
  std::string steps;
  for (int i = 0; i < 500; ++i) steps += i % 2 == 0 ? "0.2%: p { easing cosine }\n" : "0.2%: 50% p\n";
  for (int i = 0; i < 30; ++i) many += "expression e" + std::to_string(i) + " 100s {\n" + steps + "}\n";
  const std::string entangled =
      "timeline a 1s { e at 0s; f at 0s; e at 0.2s for 200ms }\n"
      "expression e 2s { 50%: q; 50%: 0% AU4 }\n"
      "expression f { 50%: q; 50%: r }\n"
      "pose q = 150% AU4 + r\n"
      "pose r = 20% AU1\n"
      "timeline e 1s { f over 0s..1s }\n"
      "expression a 1s { 100%: q }\n"
      "motion m = e\n"
      "pose n = e\n"
      "expression blink 400ms { 40%: AU45; 60%: 0% AU45 }\n"
      "expression stare 2s { 20%: AU45 + AU5; 60%: AU45; 20%: 0% AU45 }\n";
  for (const std::string& text : {many, entangled}) {
    const auto source = std::make_shared<const lang::Source>("made.nms", text);
    GoldenFiles files(kGolden);
    lang::Diagnostics of_check;
    lang::Diagnostics of_compile;
    compiler::check({source}, files, of_check);
    static_cast<void>(compiler::compile({source}, files, of_compile));
    EXPECT_EQ(of_check.all().empty(), text == many);
    EXPECT_EQ(told(of_check), told(of_compile));
  }
}

TEST(GoldenProgram, clips_are_as_expected) {
  for (const fs::path& path : cases("program")) {
    SCOPED_TRACE(path.filename().string());
    const Compiled c = compiled(path);
    EXPECT_TRUE(c.diagnostics.all().empty()) << lang::render_text(c.diagnostics, false);
    if (c.image) compare(path, program::to_text(c.image->program(), {false, false}));
  }
}

std::string outcomes(const std::vector<compiler::TestResult>& results) {
  std::string text;
  for (const compiler::TestResult& t : results) {
    lang::Diagnostics failures;
    for (const compiler::Expectation& e : t.expectations)
      if (!e.passed) compiler::report_failure(e, failures);
    text += (t.passed() ? "passed: " : "failed: ") + t.name + "\n" + lang::render_text(failures, false);
  }
  return text;
}

TEST(GoldenTest, outcomes_are_as_expected) {
  for (const fs::path& path : cases("test")) {
    SCOPED_TRACE(path.filename().string());
    GoldenFiles files(path.parent_path());
    lang::Diagnostics diagnostics;
    const auto results = compiler::run_tests({files.open(path.filename().string(), path)}, files, diagnostics,
                                             {{}, tables(path, files, diagnostics)});
    EXPECT_TRUE(diagnostics.all().empty()) << lang::render_text(diagnostics, false);
    compare(path, outcomes(results));
    const bool fails = path.filename().string().rfind("fail", 0) == 0;
    EXPECT_FALSE(results.empty());
    for (const compiler::TestResult& t : results) {
      EXPECT_EQ(t.passed(), !fails) << t.name;
      EXPECT_FALSE(t.expectations.empty()) << t.name;
    }
  }
}

std::string removals(const compiler::MutationResult& result) {
  std::string text;
  lang::Diagnostics survivors;
  for (const compiler::Removal& r : result.removals) {
    const bool noticed = r.fate == compiler::Removal::Fate::noticed;
    if (noticed)
      text += fmt::format("noticed: {}, {} {}\n", r.entry, compiler::name_of(r.part), r.source->slice(r.range));
    else
      survivors.report(r.source, r.range, compiler::RemovalUnnoticed{r});
  }
  return text + lang::render_text(survivors, false);
}

TEST(GoldenMutate, removals_are_as_expected) {
  for (const fs::path& path : cases("mutate")) {
    SCOPED_TRACE(path.filename().string());
    GoldenFiles files(path.parent_path());
    lang::Diagnostics diagnostics;
    const auto result = compiler::mutate({files.open(path.filename().string(), path)}, files, diagnostics);
    EXPECT_EQ(diagnostics.error_count(), 0U) << lang::render_text(diagnostics, false);
    EXPECT_TRUE(result.failing.empty());
    compare(path, removals(result));
    const bool fails = path.filename().string().rfind("fail", 0) == 0;
    const bool all = std::all_of(result.removals.begin(), result.removals.end(),
                                 [](const compiler::Removal& r) { return r.fate == compiler::Removal::Fate::noticed; });
    EXPECT_EQ(all, !fails);
    EXPECT_FALSE(result.removals.empty());
  }
}

TEST(GoldenMutate, shares_make_up_the_whole) {
  const fs::path path = kGolden / "mutate/fails.nms";
  GoldenFiles files(path.parent_path());
  const std::vector<std::shared_ptr<const lang::Source>> roots{files.open("fails.nms", path)};
  lang::Diagnostics diagnostics;
  const auto whole = compiler::mutate(roots, files, diagnostics);
  for (std::uint32_t share = 0; share < 3; ++share) {
    const auto part = compiler::mutate(roots, files, diagnostics, {{}, share, 3});
    ASSERT_EQ(part.removals.size(), whole.removals.size());
    for (std::size_t i = 0; i < whole.removals.size(); ++i)
      EXPECT_EQ(part.removals[i].fate, i % 3 == share ? whole.removals[i].fate : compiler::Removal::Fate::untried) << i;
  }
}

TEST(GoldenMutate, a_file_with_too_many_parts_is_refused) {
  std::string text = "lexicon l \"L\" { entry e : affect { 1% AU12";
  for (int i = 0; i < 20'000; ++i) text += " + 0% AU12";
  text += " } }\ntest \"t\" { play e; expect AU12 >= 0% at 0.2s }\n";
  GoldenFiles files(kGolden);
  lang::Diagnostics diagnostics;
  const auto result = compiler::mutate({std::make_shared<const lang::Source>("made.nms", text)}, files, diagnostics);
  EXPECT_TRUE(result.removals.empty());
  ASSERT_EQ(diagnostics.error_count(), 1U) << lang::render_text(diagnostics, false);
  EXPECT_EQ(diagnostics.all().front().kind, "too_large");
}

TEST(GoldenMutate, tests_that_fail_as_it_is_are_told_and_nothing_is_tried) {
  const fs::path path = kGolden / "test/fails.nms";
  GoldenFiles files(path.parent_path());
  lang::Diagnostics diagnostics;
  const auto result = compiler::mutate({files.open("fails.nms", path)}, files, diagnostics);
  EXPECT_TRUE(result.removals.empty());
  EXPECT_FALSE(result.failing.empty());
}

TEST(GoldenTest, a_filter_picks_by_name) {
  const fs::path path = kGolden / "test/passes.nms";
  GoldenFiles files(path.parent_path());
  lang::Diagnostics diagnostics;
  const auto results = compiler::run_tests({files.open("passes.nms", path)}, files, diagnostics, {"side", {}});
  ASSERT_EQ(results.size(), 1U);
  EXPECT_EQ(results[0].name, "one side and both");
}

TEST(GoldenTest, sources_with_errors_have_no_results) {
  const fs::path path = kGolden / "check/fail_test_names.nms";
  GoldenFiles files(path.parent_path());
  lang::Diagnostics diagnostics;
  EXPECT_TRUE(compiler::run_tests({files.open("fail_test_names.nms", path)}, files, diagnostics).empty());
  EXPECT_GT(diagnostics.error_count(), 0U);
}

TEST(GoldenCheck, fail_is_in_the_name_exactly_when_an_error_is_reported) {
  for (const char* folder : {"check", "program"})
    for (const fs::path& path : cases(folder)) {
      const std::string name = path.filename().string();
      const Compiled c = compiled(path);
      EXPECT_EQ(c.diagnostics.error_count() > 0, name.rfind("fail_", 0) == 0) << name;
      EXPECT_EQ(c.diagnostics.error_count() == 0 && c.diagnostics.warning_count() > 0, name.rfind("warn_", 0) == 0)
          << name;
    }
}

TEST(GoldenCheck, every_diagnostic_kind_occurs) {
  std::set<std::string> seen;
  for (const fs::path& path : cases("check")) {
    const Compiled c = compiled(path);
    for (const lang::Diagnostic& d : c.diagnostics.all()) seen.insert(std::string(d.kind));
  }
#define NMS_X(type, name, severity)                               \
  EXPECT_EQ(compiler::type::kKind, #name);                        \
  EXPECT_EQ(compiler::type::kSeverity, lang::Severity::severity); \
  EXPECT_TRUE(seen.count(#name)) << "no file of tests/golden/check shows " << #name;
  NMS_COMPILER_DIAGNOSTICS(NMS_X)
#undef NMS_X
}

TEST(GoldenCheck, no_expectation_is_unread) {
  for (const char* folder : {"check", "program", "test"})
    for (const fs::directory_entry& e : fs::directory_iterator(kGolden / folder)) {
      if (e.is_directory()) continue;
      fs::path source = e.path();
      source.replace_extension(".nms");
      EXPECT_TRUE(fs::exists(source)) << e.path();
    }
}

// Barker 2005, 4.5.1, by the evaluator that players use.
TEST(GoldenProgram, the_thesis_smile_is_in_its_poses_at_the_ends_of_its_steps) {
  const Compiled c = compiled(kGolden / "program/thesis_smile.nms");
  ASSERT_TRUE(c.image);
  const program::Program& p = c.image->program();
  const program::Clip* clip = p.find_clip("E");
  ASSERT_NE(clip, nullptr);
  struct Row {
    std::int64_t time_ns;
    float au12, au11, au20;
  };
  for (const Row& row : {Row{0, 0.0F, 0.0F, 0.0F}, Row{234'000'000, 0.6F, 0.4F, 0.2F},
                         Row{2'106'000'000, 0.8F, 0.75F, 0.4F}, Row{2'340'000'000, 0.1F, 0.05F, 0.07F}}) {
    std::vector<float> values(p.channels.size());
    program::Player player(p, *clip);
    player.advance(row.time_ns, values);
    for (std::size_t i = 0; i < p.channels.size(); ++i) {
      const float want = p.channels[i].au == 12   ? row.au12
                         : p.channels[i].au == 11 ? row.au11
                         : p.channels[i].au == 20 ? row.au20
                                                  : 0.0F;
      EXPECT_EQ(values[i], want) << p.string(p.channels[i].name) << " at " << row.time_ns;
    }
  }
}

}  // namespace
