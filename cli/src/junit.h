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

/// Text as XML may hold it: the five special characters escaped; what XML 1.0 has no way to say is `?`.
[[nodiscard]] std::string xml_escaped(std::string_view text);

}  // namespace nms::cli
