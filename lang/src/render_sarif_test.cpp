#include <gtest/gtest.h>

#include <nms/lang/diagnostic_kinds.h>
#include <nms/lang/parse.h>
#include <nms/lang/render.h>
#include <nlohmann/json.hpp>

namespace nms::lang {
namespace {

TEST(Sarif, APlaceIsCountedInCodePointsAndHelpIsInTheMessage) {
  const auto source = std::make_shared<const Source>("a folder/q.nms", "pose a = AU1\npose \xC3\xA9 = 60pct AU12\n");
  Diagnostics diagnostics;
  (void)parse(source, diagnostics);
  ASSERT_GE(diagnostics.error_count(), 1U);
  const auto sarif = nlohmann::json::parse(render_sarif(diagnostics, "1.2.3"));
  EXPECT_EQ(sarif["version"], "2.1.0");
  const auto& run = sarif["runs"][0];
  EXPECT_EQ(run["tool"]["driver"]["version"], "1.2.3");
  for (const auto& result : run["results"]) {
    EXPECT_EQ(run["tool"]["driver"]["rules"][result["ruleIndex"].get<std::size_t>()]["id"], result["ruleId"]);
    const auto& place = result["locations"][0]["physicalLocation"];
    EXPECT_EQ(place["artifactLocation"]["uri"], "a%20folder/q.nms");
    EXPECT_EQ(place["region"]["startLine"], 2);
  }
  EXPECT_EQ(run["results"][0]["locations"][0]["physicalLocation"]["region"]["startColumn"], 6);
}

TEST(Sarif, NothingWrongIsARunWithoutResults) {
  const auto sarif = nlohmann::json::parse(render_sarif(Diagnostics(), "1"));
  EXPECT_TRUE(sarif["runs"][0]["results"].is_array());
  EXPECT_TRUE(sarif["runs"][0]["results"].empty());
}

}  // namespace
}  // namespace nms::lang
