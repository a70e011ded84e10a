// A program beside its text is used exactly while its text is what it was: seen with programs whose contents are not
// what the text says, which no output of the command could tell apart.
#include "program_beside.h"

#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

namespace nms::cli {
namespace {

namespace fs = std::filesystem;

void write(const fs::path& path, std::string_view text) {
  std::ofstream(path, std::ios::binary).write(text.data(), static_cast<std::streamsize>(text.size()));
}

/// A folder of its own as the working folder.
class ProgramBeside : public testing::Test {
 protected:
  void SetUp() override {
    before_ = fs::current_path();
    folder_ = fs::temp_directory_path() /
              ("nms_beside_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    fs::current_path(folder_);
    write("x.nms", "use \"y\"\n");
    write("y.nms", "pose p = AU4\n");
  }
  void TearDown() override {
    fs::current_path(before_);
    fs::remove_all(folder_);
  }

  /// Roots as named on the command line.
  static std::vector<std::shared_ptr<const lang::Source>> roots(SourceFiles& sources) {
    return {sources.open("x.nms").value()};
  }

  /// x.auc: a program that claims to be made of the files as they are.
  static void write_program(bool with_face = false) {
    SourceFiles sources("");
    auto named = roots(sources);
    if (with_face) named.push_back(sources.stdlib("faces/ada.nms"));
    InputRecorder recorder(sources);
    EXPECT_NE(recorder.find("y", "x.nms"), nullptr);
    program::Draft draft;
    recorder.note(named, draft);
    const auto image = program::Image::from(draft);
    ASSERT_TRUE(image) << image.error().cause;
    write("x.auc", {reinterpret_cast<const char*>(image->bytes().data()), image->bytes().size()});
  }

  static bool is_current(bool any_face = false) {
    SourceFiles sources("");
    const auto program = LoadedProgram::map("x.auc");
    EXPECT_TRUE(program);
    return program && is_up_to_date(program->program(), roots(sources), any_face, sources);
  }

 private:
  fs::path before_;
  fs::path folder_;
};

TEST_F(ProgramBeside, stands_for_texts_that_are_what_they_were) {
  write_program();
  EXPECT_TRUE(is_current());
  fs::last_write_time("x.nms", fs::file_time_type::clock::now() + std::chrono::hours(1));
  EXPECT_TRUE(is_current()) << "no clock is asked";
}

TEST_F(ProgramBeside, is_stale_once_any_text_changes) {
  write_program();
  write("x.nms", "use \"y\" \n");
  EXPECT_FALSE(is_current());
  write("x.nms", "use \"y\"\n");
  EXPECT_TRUE(is_current());
  write("y.nms", "pose p = AU5\n");
  EXPECT_FALSE(is_current());
  fs::remove("y.nms");
  EXPECT_FALSE(is_current());
}

TEST_F(ProgramBeside, is_stale_once_a_name_leads_elsewhere) {
  write_program();
  write("y", "pose p = AU4\n");  // tried before y.nms, and with the same text
  EXPECT_FALSE(is_current());
}

TEST_F(ProgramBeside, is_stale_for_other_roots) {
  write_program();
  SourceFiles sources("");
  const auto program = LoadedProgram::map("x.auc").value();
  EXPECT_FALSE(is_up_to_date(program.program(), {sources.open("y.nms").value()}, false, sources));
  auto both = roots(sources);
  both.push_back(sources.open("y.nms").value());
  EXPECT_FALSE(is_up_to_date(program.program(), both, false, sources));
}

TEST_F(ProgramBeside, with_a_face_serves_whoever_asks_for_that_or_for_none) {
  write_program(true);
  EXPECT_TRUE(is_current(true));
  EXPECT_FALSE(is_current(false));
  SourceFiles sources("");
  auto named = roots(sources);
  named.push_back(sources.stdlib("faces/ada.nms"));
  EXPECT_TRUE(is_up_to_date(LoadedProgram::map("x.auc").value().program(), named, false, sources));
}

TEST_F(ProgramBeside, without_inputs_is_never_up_to_date) {
  const auto image = program::Image::from(program::Draft{}).value();
  write("x.auc", {reinterpret_cast<const char*>(image.bytes().data()), image.bytes().size()});
  EXPECT_FALSE(is_current());
  SourceFiles sources("");
  InputRecorder recorder(sources);
  EXPECT_EQ(recorder.find("nowhere", "x.nms"), nullptr);
  program::Draft draft;
  recorder.note(roots(sources), draft);
  EXPECT_TRUE(draft.inputs.empty()) << "a name led nowhere";
}

TEST_F(ProgramBeside, is_mapped_and_checked) {
  write_program();
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(LoadedProgram::map("x.auc").value().bytes().data()) % 4096, 0U);
  fs::resize_file("x.auc", fs::file_size("x.auc") - 8);
  EXPECT_EQ(LoadedProgram::map("x.auc").error().kind, "truncated_program");
  fs::resize_file("x.auc", 0);
  EXPECT_EQ(LoadedProgram::map("x.auc").error().kind, "truncated_program");
  EXPECT_EQ(LoadedProgram::map("none.auc").error().kind, "cannot_read");
  EXPECT_EQ(LoadedProgram::map(".").error().kind, "cannot_read");
}

TEST_F(ProgramBeside, has_its_sources_name) {
  EXPECT_EQ(path_beside("a/b.nms"), "a/b.auc");
  EXPECT_EQ(path_beside("-"), "");
  EXPECT_EQ(path_beside("b.auc"), "");
}

}  // namespace
}  // namespace nms::cli
