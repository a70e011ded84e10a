// `nmsc diff`: what it says of tests/golden/diff/, and when it says nothing.
#include <sys/wait.h>

#include <nlohmann/json.hpp>

#include "command_run.h"

namespace {

using namespace nms::command_run;
using Json = nlohmann::json;

struct Outcome {
  int status = 0;
  std::string text;
};

Outcome diff(const Folder& folder, const std::string& before, const std::string& after, const std::string& more = {}) {
  const fs::path out = folder.path / "stdout";
  const std::string command = fmt::format("\"{}\" diff \"{}\" \"{}\" {} >\"{}\" 2>/dev/null </dev/null", NMSC, before,
                                          after, more, out.string());
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read(out)};
}

const fs::path kOld = kRoot / "tests/golden/diff/old.nms";
const fs::path kNew = kRoot / "tests/golden/diff/new.nms";

TEST(Difference, is_as_it_was) {
  const Folder folder;
  const Outcome text = diff(folder, kOld, kNew);
  EXPECT_EQ(text.status, 1);
  expect_golden(kRoot / "tests/golden/diff/old_new.txt", text.text);
  const Outcome json = diff(folder, kOld, kNew, "--format json");
  EXPECT_EQ(json.status, 1);
  expect_golden(kRoot / "tests/golden/diff/old_new.json", json.text);
}

TEST(Difference, every_change_has_its_way_back) {
  const Folder folder;
  const Json there = Json::parse(diff(folder, kOld, kNew, "--format json").text)["differences"];
  const Json back = Json::parse(diff(folder, kNew, kOld, "--format json").text)["differences"];
  EXPECT_EQ(there.size(), back.size());
}

TEST(Difference, of_a_file_and_itself_is_none) {
  const Folder folder;
  for (const fs::path& file : {kOld, kNew, kRoot / "examples/negation.nms", kRoot / "examples/wh_question.nms"}) {
    const Outcome same = diff(folder, file, file);
    EXPECT_EQ(same.status, 0);
    EXPECT_EQ(same.text, "");
    // Comments and blanks are no meaning.
    std::string text = "// A line more.\n\n" + read(file);
    for (std::size_t at = text.find("}\n"); at != std::string::npos; at = text.find("}\n", at + 8))
      text.replace(at, 2, "}  // !\n\n");
    const fs::path other = folder.path / "other.nms";
    std::ofstream(other, std::ios::binary) << text;
    const Outcome reformatted = diff(folder, file, other);
    EXPECT_EQ(reformatted.status, 0) << file << reformatted.text;
  }
  const Outcome json = diff(folder, kOld, kOld, "--format json");
  EXPECT_EQ(json.status, 0);
  EXPECT_TRUE(Json::parse(json.text)["differences"].empty());
}

TEST(Difference, of_a_program_and_its_source_is_none) {
  const Folder folder;
  const fs::path program = folder.path / "old.auc";
  run(folder, fmt::format("compile \"{}\" -o \"{}\"", kOld.string(), program.string()));
  EXPECT_EQ(diff(folder, program, kOld).status, 0);
  EXPECT_EQ(diff(folder, program, kNew).status, 1);
}

TEST(Difference, of_folders_is_that_of_their_files) {
  const Folder folder;
  for (const char* version : {"1", "2"}) fs::create_directories(folder.path / version / "deep");
  fs::copy_file(kOld, folder.path / "1/deep/l.nms");
  fs::copy_file(kNew, folder.path / "2/deep/l.nms");
  const Outcome folders = diff(folder, folder.path / "1", folder.path / "2");
  EXPECT_EQ(folders.status, 1);
  EXPECT_EQ(folders.text, diff(folder, kOld, kNew).text);
}

TEST(Difference, trouble_is_neither_same_nor_different) {
  const Folder folder;
  std::ofstream(folder.path / "bad.nms") << "pose p = AU999\n";
  EXPECT_EQ(diff(folder, kOld, folder.path / "bad.nms").status, 2);
  EXPECT_EQ(diff(folder, folder.path / "nowhere.nms", kOld).status, 2);
  EXPECT_EQ(diff(folder, folder.path, folder.path / "empty").status, 2);
  EXPECT_EQ(diff(folder, kOld, kOld, "--format xml").status, 2);
}

}  // namespace
