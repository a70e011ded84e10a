#pragma once

#include <string>
#include <vector>

#include <nms/compiler/test.h>

namespace nms::cli {

/// The tests of one file that ran.
struct TestedFile {
  std::string path;
  std::vector<compiler::TestResult> tests;
};

/// JUnit XML, as build servers read it: a suite for each file, a case for each test. No times, so that the same results
/// are the same bytes.
[[nodiscard]] std::string junit(const std::vector<TestedFile>& files);

}  // namespace nms::cli
