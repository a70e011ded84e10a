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

#include <gtest/gtest.h>
#include <nms/compiler/compile.h>
#include <nms/compiler/diagnostic_kinds.h>
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
