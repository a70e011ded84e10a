// `nmsc face fit`, from the files that a person has to the face that plays.
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <nlohmann/json.hpp>

#include "ada_fixture.h"
#include "command_run.h"

namespace nms::ada {
namespace {

using namespace command_run;

/// Somebody wider, with a longer jaw, who looks a little down from 2 m away.  [m]
glm::dvec3 in_scan(const glm::dvec3& p) {
  const glm::dvec3 q(1.07 * p.x, 0.96 * p.y - (p.y < -0.03 ? 0.15 * (-0.03 - p.y) : 0.0), 1.02 * p.z);
  return {q.x + 0.3, 0.98 * q.y - 0.199 * q.z, 0.199 * q.y + 0.98 * q.z + 2.0};
}

// What a person with a mouse finds.
const std::vector<std::string> kMarks{"nasion",         "nose_tip",       "subnasale",   "stomion",     "pogonion",
                                      "menton",         "eye_inner_L",    "eye_inner_R", "eye_outer_L", "eye_outer_R",
                                      "mouth_corner_L", "mouth_corner_R", "ala_L",       "ala_R"};

/// The front of the head in centimetres, as a scanner sees it: what lies behind the ears is not there.
void write_scan(const fs::path& path) {
  std::ofstream file(path);
  std::map<std::uint32_t, int> numbers;
  std::string faces;
  const auto vertex = [&](std::uint32_t v) {
    const auto [it, fresh] = numbers.try_emplace(v, static_cast<int>(numbers.size()) + 1);
    if (fresh) {
      const glm::dvec3 p = 100.0 * in_scan(rest()[v]);
      file << fmt::format("v {:.5f} {:.5f} {:.5f}\n", p.x, p.y, p.z);
    }
    return it->second;
  };
  for (const Triangle& t : skin_triangles()) {
    if (rest()[t[0]].z < -0.02 || rest()[t[0]].y < -0.1) continue;
    const int a = vertex(t[0]);
    const int b = vertex(t[1]);
    faces += fmt::format("f {} {} {}\n", a, b, vertex(t[2]));
  }
  file << faces;
}

void write_marks(const fs::path& path) {
  nlohmann::ordered_json marks;
  for (const std::string& name : kMarks) {
    const glm::dvec3 p = 100.0 * in_scan(landmark(all_units(), name));
    marks[name] = {p.x, p.y, p.z};
  }
  std::ofstream(path) << marks.dump(2);
}

/// Where the declaration puts a landmark.  [mm]
glm::dvec3 declared(const std::string& text, const std::string& name) {
  const std::size_t line = text.find("landmark " + name + " ");
  if (line == std::string::npos) {
    ADD_FAILURE() << name << " is not declared";
    return {};
  }
  std::stringstream numbers(text.substr(text.find('(', line) + 1));
  glm::dvec3 p{};
  std::string unit;
  for (int i = 0; i < 3; ++i) {
    numbers >> p[i];
    std::getline(numbers, unit, i == 2 ? ')' : ',');
    EXPECT_EQ(unit, "mm");
  }
  return p;
}

TEST(FaceFitCommand, a_scan_becomes_a_face_that_plays) {
  const Folder folder;
  write_scan(folder.path / "scan.obj");
  write_marks(folder.path / "marks.json");
  const auto path = [&](const char* name) { return (folder.path / name).string(); };
  const auto nmsc = [&](const std::string& arguments) {
    return std::system(
        fmt::format("\"{}\" {} >\"{}\" 2>\"{}\" </dev/null", NMSC, arguments, path("out"), path("err")).c_str());
  };
  ASSERT_EQ(nmsc(fmt::format("face fit \"{}\" --landmarks \"{}\" --unit 1cm --symmetric -o \"{}\"", path("scan.obj"),
                             path("marks.json"), path("me.nms"))),
            0)
      << read(path("err"));

  // What it says of itself.
  const std::string said = read(path("err"));
  const std::size_t at = said.find(fmt::format("by {} landmarks: ", kMarks.size()));
  ASSERT_NE(at, std::string::npos) << said;
  EXPECT_LT(std::stod(said.substr(said.find(": ", at) + 2)), 0.6) << said;

  // The person's own measures: turned back, as large as the scan.
  const std::string text = read(path("me.nms"));
  const auto scanned = [&](const char* a, const char* b) {
    return 1000.0 * glm::distance(in_scan(landmark(all_units(), a)), in_scan(landmark(all_units(), b)));
  };
  EXPECT_NEAR(2.0 * declared(text, "mouth_corner sides").x, scanned("mouth_corner_L", "mouth_corner_R"), 0.5);
  EXPECT_NEAR(2.0 * declared(text, "eye_outer sides").x, scanned("eye_outer_L", "eye_outer_R"), 0.5);
  EXPECT_NEAR(glm::distance(declared(text, "nasion"), declared(text, "menton")), scanned("nasion", "menton"), 0.5);
  // Nobody showed it where the jaw's hinge is.
  EXPECT_NEAR(declared(text, "jaw_hinge sides").x, 1000.0 * 1.07 * landmark(all_units(), "jaw_hinge_L").x, 4.0);

  // It lacks nothing that the face it was made of has, and plays.
  ASSERT_EQ(nmsc("face check ada"), 0);
  const std::string of_ada = read(path("out"));
  ASSERT_EQ(nmsc(fmt::format("face check \"{}\"", path("me.nms"))), 0) << read(path("err"));
  EXPECT_EQ(read(path("out")), "me" + of_ada.substr(of_ada.find(':')));
  std::ofstream(folder.path / "smile.nms") << "timeline smile 1s {\n  AU12 at 0.2s for 500ms\n}\n";
  ASSERT_EQ(
      nmsc(fmt::format("build \"{}\" --face \"{}\" -o \"{}\"", path("smile.nms"), path("me.nms"), path("smile.glb"))),
      0)
      << read(path("err"));
  EXPECT_GT(fs::file_size(path("smile.glb")), 500'000U);
}

}  // namespace
}  // namespace nms::ada
