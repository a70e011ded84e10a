// `nmsc explain FILE`: the answers as they stand in tests/golden/explain/, and what holds of any answer.
#include <cmath>
#include <vector>

#include <nlohmann/json.hpp>

#include "command_run.h"

namespace {

using namespace nms::command_run;
using Json = nlohmann::json;

/// Sources are named from where the command runs, so it runs beside its source.
std::string run_beside(const Folder& folder, const fs::path& source, const std::string& arguments) {
  fs::copy_file(source, folder.path / source.filename(), fs::copy_options::skip_existing);
  const fs::path out = folder.path / "stdout";
  const std::string command = fmt::format("cd \"{}\" && \"{}\" {} >\"{}\" 2>/dev/null </dev/null", folder.path.string(),
                                          NMSC, arguments, out.string());
  EXPECT_EQ(std::system(command.c_str()), 0) << command;
  return read(out);
}

TEST(Explanation, is_as_it_was) {
  const Folder folder;
  const fs::path source = kRoot / "tests/golden/explain/every_step.nms";
  struct Case {
    const char* arguments;
    const char* golden;
  };
  for (const Case& c :
       {Case{"--clip u --at 0.65 --channel AU4", "stated.txt"}, Case{"--clip u --at 1.63 --channel AU4L", "joined.txt"},
        Case{"--clip u --at 1.75 --channel AU4", "let_go.txt"}, Case{"--clip u --at 0.9 --channel head", "axes.txt"},
        Case{"--clip u --at 0.6 --channel head_yaw", "repeated.txt"},
        Case{"--clip u --at 1.0 --channel gaze", "latest.txt"}, Case{"--clip u --at=-0.1", "in_the_lead.txt"},
        Case{"--clip breathing --at 2.1 --channel torso_pitch", "ambient.txt"},
        Case{"--clip steps --at 0.5", "steps.txt"}, Case{"--clip given --at 0.55 --channel AU1", "gave_way.txt"},
        Case{"--clip given --at 0.55 --channel AU1L --format json", "gave_way.json"},
        Case{"--clip steps --at 0.5 --channel AU12L --format json", "steps.json"}})
    expect_golden(kRoot / "tests/golden/explain" / c.golden,
                  run_beside(folder, source, fmt::format("explain every_step.nms {}", c.arguments)));
}

/// A line of CSV, by its columns' names.
std::vector<std::pair<std::string, std::string>> row(const std::string& csv) {
  std::vector<std::pair<std::string, std::string>> out;
  std::stringstream lines(csv);
  std::string names;
  std::string values;
  std::getline(lines, names);
  std::getline(lines, values);
  std::stringstream n(names);
  std::stringstream v(values);
  for (std::string name, value; std::getline(n, name, ',') && std::getline(v, value, ',');)
    out.push_back({name, value});
  return out;
}

double number(const Json& value) { return value.get<double>(); }

/// What the operators of the answer make of their operands, worked out again.
double result_of(const Json& step) {
  const std::string kind = step["operator"];
  std::vector<double> v;
  for (const Json& o : step["operands"]) v.push_back(number(o["value"]));
  if (kind == "either") return 1.0 - (1.0 - v[0]) * (1.0 - v[1]);
  if (kind == "scale" || kind == "hide") return v[0] * (1.0 - number(step["envelope"]));
  if (kind == "replace" || kind == "highest") return v[0] * (1.0 - number(step["envelope"])) + v[1];
  if (kind == "latest") return number(step["result"]);  // needs all envelopes
  double out = v[0];
  for (std::size_t i = 1; i < v.size(); ++i) out = kind == "strongest" ? std::max(out, v[i]) : out + v[i];
  return out;
}

TEST(Explanation, ends_in_the_very_value_that_sample_prints) {
  const Folder folder;
  std::size_t compared = 0;
  struct Clip {
    fs::path file;
    const char* name;
  };
  for (const Clip& clip : {Clip{kRoot / "tests/golden/explain/every_step.nms", "u"},
                           Clip{kRoot / "tests/golden/explain/every_step.nms", "given"},
                           Clip{kRoot / "examples/wh_question.nms", "where_is_the_book"},
                           Clip{kRoot / "examples/negation.nms", "i_do_not_understand_the_book"}})
    for (const char* at : {"-0.05", "0.3", "0.61", "0.9", "1.15", "1.63", "1.75", "1.9"}) {
      SCOPED_TRACE(fmt::format("{} at {}", clip.name, at));
      const std::string common = fmt::format("{} --clip {} --at={}", clip.file.filename().string(), clip.name, at);
      const auto sampled = row(run_beside(folder, clip.file, "sample " + common));
      const Json why = Json::parse(run_beside(folder, clip.file, "explain --format json " + common));
      for (const Json& c : why["channels"]) {
        EXPECT_NE(number(c["value"]), 0.0) << c["channel"];
        const bool axis = c.contains("positive");
        const double value = number(c["value"]);
        const std::string column = axis ? (value < 0.0 ? c["negative"] : c["positive"]) : c["channel"];
        bool found = false;
        for (const auto& [name, text] : sampled)
          if (name == column) {
            found = true;
            EXPECT_EQ(fmt::format("{}", static_cast<float>(std::fabs(value))), text) << column;
            ++compared;
          }
        EXPECT_TRUE(found) << column;
        // Each step follows from its operands, and the last one is the value.
        ASSERT_FALSE(c["steps"].empty());
        const double low = axis ? -1.0 : 0.0;
        for (const Json& step : c["steps"])
          EXPECT_NEAR(std::min(1.0, std::max(low, number(step["result"]))),
                      std::min(1.0, std::max(low, result_of(step))), 2e-3)
              << step;
        EXPECT_NEAR(std::min(1.0, std::max(low, number(c["steps"].back()["result"]))), value, 2e-3);
      }
      // What is not told is at rest.
      for (const auto& [name, text] : sampled) {
        if (name == "time_s" || text == "0") continue;
        bool told = false;
        for (const Json& c : why["channels"])
          told |= c["channel"] == name || c.value("positive", "") == name || c.value("negative", "") == name;
        EXPECT_TRUE(told) << name;
      }
    }
  EXPECT_GT(compared, 100U);
}

}  // namespace
