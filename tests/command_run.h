#pragma once

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

/// Runs of the command under test, for what it prints. NMS_REFRESH=1 rewrites golden files.
namespace nms::command_run {

namespace fs = std::filesystem;
inline const fs::path kRoot = NMS_SOURCE_DIR;

inline std::string read(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

/// A folder of this test's own, gone when it ends.
struct Folder {
  Folder() {
    path = fs::temp_directory_path() /
           fmt::format("nms_run_{}_{}_{}", ::testing::UnitTest::GetInstance()->current_test_info()->test_suite_name(),
                       ::testing::UnitTest::GetInstance()->current_test_info()->name(), ::getpid());
    fs::remove_all(path);
    fs::create_directories(path);
  }
  ~Folder() { fs::remove_all(path); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  fs::path path;
};

/// Runs the command under test. Returns its standard output.
inline std::string run(const Folder& folder, const std::string& arguments) {
  const fs::path out = folder.path / "stdout";
  const std::string command = fmt::format("\"{}\" {} >\"{}\" 2>/dev/null </dev/null", NMSC, arguments, out.string());
  EXPECT_EQ(std::system(command.c_str()), 0) << command;
  return read(out);
}

inline std::string example(const std::string& name) {
  return fmt::format("\"{}\"", (kRoot / "examples" / name).string());
}

inline std::string source(const Folder& folder, const std::string& text) {
  const fs::path path = folder.path / "source.nms";
  std::ofstream(path, std::ios::binary) << text;
  return fmt::format("\"{}\"", path.string());
}

inline void expect_golden(const fs::path& golden, const std::string& found) {
  if (std::getenv("NMS_REFRESH") != nullptr) {
    fs::create_directories(golden.parent_path());
    std::ofstream(golden, std::ios::binary) << found;
  }
  EXPECT_TRUE(found == read(golden)) << golden << " differs: see what NMS_REFRESH=1 changes in it";
}

}  // namespace nms::command_run
