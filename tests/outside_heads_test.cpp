// Ada's muscles on two heads that others made, by the face files in examples/faces. The heads' geometry is no part of
// this library: NMS_FACES names the folder that has ict/generic_neutral_mesh.obj and makehuman/base.obj (default:
// ../shared/data/faces beside the source); without it these tests skip, visibly.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <nms/compiler/compile.h>
#include <nms/runtime/face_file.h>
#include <nms/runtime/landmark_set.h>
#include <nms/runtime/rig.h>

#include "ada_fixture.h"
#include "embedded_library.h"
#include "face_artefacts.h"
#include "under_sanitizers.h"

#include "../tools/fit_face/poses.h"

namespace {

using namespace nms;
namespace fs = std::filesystem;

std::string read_file(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

fs::path folder() {
  const char* given = std::getenv("NMS_FACES");
  return given != nullptr ? fs::path(given) : fs::path(NMS_SOURCE_DIR) / "../shared/data/faces";
}

struct Head {
  std::shared_ptr<const program::Image> image;
  runtime::Face face;
  runtime::Rig rig;
  runtime::Landmarks landmarks;
  runtime::Pose pose;
  std::vector<glm::vec3> rest;

  /// How far the unit moves the skin next to a landmark. [m]
  glm::dvec3 moved(const std::string& unit, const std::string& landmark) {
    pose_with({unit});
    const std::size_t v = next_to(landmark);
    return glm::dvec3(pose.positions[v]) - glm::dvec3(rest[v]);
  }

  void pose_with(const std::vector<std::string>& units) {
    std::vector<float> values(rig.channel_count(), 0.0F);
    const program::Program& p = image->program();
    for (const std::string& unit : units)
      for (std::size_t c = 0; c < values.size(); ++c)
        for (const char* side : {"", "L", "R"})
          if (p.string(p.channels[c].name) == unit + side) values[c] = 1.0F;
    runtime::pose_face(face, rig, values, pose);
  }

  [[nodiscard]] std::size_t next_to(const std::string& landmark) const {
    const glm::dvec3 p = landmarks.at(landmark);
    std::size_t best = 0;
    for (std::size_t v = 0; v < rest.size(); ++v)
      if (glm::distance(glm::dvec3(rest[v]), p) < glm::distance(glm::dvec3(rest[best]), p)) best = v;
    return best;
  }
};

Head read_head(const std::string& name, const std::string& geometry) {
  const fs::path path = fs::path(NMS_SOURCE_DIR) / "examples/faces" / (name + ".nms");
  EmbeddedLibrary library;
  lang::Diagnostics diagnostics;
  const std::string source = read_file(path) + ada::expressions_of_all_units();
  compiler::CompileOptions options;
  options.face = name;
  const auto draft =
      compiler::compile({std::make_shared<const lang::Source>(name + ".nms", source)}, library, diagnostics, options);
  for (const auto& d : diagnostics.all()) {
    if (!draft) ADD_FAILURE() << d.kind << ": " << d.message;
  }
  program::Image image = std::move(program::Image::from(draft.value()).value());
  auto face = runtime::read_face(read_file(folder() / geometry), geometry, runtime::face_form(image.program()));
  if (!face) ADD_FAILURE() << face.error().place << ": " << face.error().cause;
  auto rig = runtime::bind(*face, image.program());
  if (!rig) ADD_FAILURE() << rig.error().place << ": " << rig.error().cause;
  runtime::Landmarks landmarks = runtime::landmarks_of(*face, image.program());
  runtime::Pose pose = runtime::make_pose(*face, *rig);
  runtime::pose_face(*face, *rig, std::vector<float>(rig->channel_count(), 0.0F), pose);
  std::vector<glm::vec3> rest = pose.positions;
  return {std::make_shared<const program::Image>(std::move(image)),
          std::move(*face),
          std::move(*rig),
          std::move(landmarks),
          std::move(pose),
          std::move(rest)};
}

class OutsideHead : public testing::TestWithParam<std::pair<const char*, const char*>> {
 protected:
  void SetUp() override {
    if (!fs::exists(folder() / GetParam().second))
      GTEST_SKIP() << "no " << GetParam().second << " in " << folder() << ": set NMS_FACES";
  }
};

TEST_P(OutsideHead, HasEveryLandmarkAndRegion) {
  const Head head = read_head(GetParam().first, GetParam().second);
  for (const runtime::LandmarkInfo& info : runtime::landmark_set())
    EXPECT_TRUE(head.landmarks.contains(std::string(info.name) + (info.sided ? "_R" : ""))) << info.name;
  for (const char* region : {"lip_upper", "lip_lower", "lining", "raised", "jaw", "neck", "lid_upper_left",
                             "lid_lower_left", "lid_upper_right", "lid_lower_right"})
    EXPECT_TRUE(head.face.regions.contains(region)) << region;
  EXPECT_NEAR(head.rig.tables().scale, 1.0, 0.06);
}

// Where a unit moves a place on ada, it moves the same place on the other head the same way, about as far.
TEST_P(OutsideHead, UnitsMoveWhatTheyMoveOnAda) {
  Head head = read_head(GetParam().first, GetParam().second);
  const std::shared_ptr<const program::Image> all(&ada::all_units().image, [](const program::Image*) {});
  Head ada{all, ada::face(), ada::all_units().rig, runtime::landmarks_of(ada::face(), all->program()), {}, {}};
  ada.pose = runtime::make_pose(ada.face, ada.rig);
  ada.pose_with({});
  ada.rest = ada.pose.positions;
  const std::pair<const char*, const char*> kPlaces[] = {
      {"AU1", "brow_inner_L"},     {"AU2", "brow_outer_L"},    {"AU4", "brow_inner_L"}, {"AU10", "lip_upper_lateral_L"},
      {"AU12", "mouth_corner_L"},  {"AU15", "mouth_corner_L"}, {"AU17", "pogonion"},    {"AU20", "mouth_corner_L"},
      {"AU26", "pogonion"},        {"AU27", "lip_lower_mid"},  {"AU27", "menton"},      {"AU34", "cheek_mid_L"},
      {"AU43", "lid_upper_mid_L"}, {"AU12", "mouth_corner_R"}};
  for (const auto& [unit, place] : kPlaces) {
    const glm::dvec3 wanted = ada.moved(unit, place);
    const glm::dvec3 d = head.moved(unit, place);
    EXPECT_GT(glm::dot(d, wanted), 0.85 * glm::length(d) * glm::length(wanted)) << unit << " at " << place;
    EXPECT_GT(glm::length(d), 0.55 * glm::length(wanted)) << unit << " at " << place;
    EXPECT_LT(glm::length(d), 1.7 * glm::length(wanted)) << unit << " at " << place;
  }
}

TEST_P(OutsideHead, ClosedEyesAreClosedAndNothingIsLost) {
  Head head = read_head(GetParam().first, GetParam().second);
  head.pose_with({"AU43"});
  for (const char* side : {"_L", "_R"}) {
    const glm::vec3 upper = head.pose.positions[head.next_to(std::string("lid_upper_mid") + side)];
    const glm::vec3 lower = head.pose.positions[head.next_to(std::string("lid_lower_mid") + side)];
    EXPECT_LT(upper.y - lower.y, 0.0004F) << side;
  }
  for (const char* unit : {"AU10", "AU12", "AU17", "AU25", "AU27", "AU43"}) {
    head.pose_with({unit});
    for (const glm::vec3& p : head.pose.positions) ASSERT_TRUE(std::isfinite(p.x + p.y + p.z)) << unit;
  }
}

/// What each head may show, and not more; docs/for-faces.md says what a coarse head costs.
struct Limits {
  std::vector<test::ArtefactLimit> rest, units, others;
};

Limits limits_of(const std::string& head) {
  if (head == "ict") {
    return {{{"folded skin", 1.7, 1.0}, {"skin in eyeball", 0.42, 1.0}},
            {{"folded skin", 2.3, 0.13}, {"skin in eyeball", 0.66, 0.04}, {"upper lip in lower lip", 0.23, 0.01}},
            {{"folded skin", 6.1, 0.51},
             {"lower lip in upper lip", 0.22, 0.0005},
             {"skin in eyeball", 1.1, 0.17},
             {"skin in teeth", 0.8, 0.004},
             {"tongue in lip", 6.6, 0.002},
             {"tongue in teeth", 0.4, 0.002},
             {"upper lip in lower lip", 0.3, 0.005}}};
  }
  return {{{"skin in teeth", 3.6, 1.0}},
          {{"folded skin", 3.1, 0.10}, {"skin in eyeball", 0.92, 0.05}, {"skin in teeth", 3.1, 0.27}},
          {{"folded skin", 6.2, 0.39},
           {"skin in eyeball", 0.92, 0.22},
           {"skin in teeth", 5.0, 0.65},
           {"tongue in lip", 6.4, 0.0075},
           {"tongue in teeth", 1.8, 0.0035},
           {"upper lip in lower lip", 0.6, 0.004}}};
}

// NMS_REPORT=1 prints the worst of each kind. What is not named shows nowhere: shut eyes are shut.
TEST_P(OutsideHead, ShowsFewArtefacts) {
  NMS_TOO_SLOW_HERE();
  const Head head = read_head(GetParam().first, GetParam().second);
  const program::Program& p = head.image->program();
  test::Inspector inspector(head.face, head.rig, head.landmarks, {.lining = false});
  test::ArtefactTally rest, units, others;
  rest.add(inspector.at_rest(), "rest");
  for (const auto& pose : fit_face::each_unit(p, head.rig)) units.add(inspector.look(pose.values), pose.what);
  for (const auto& pose : fit_face::each_pair(p, head.rig)) others.add(inspector.look(pose.values), pose.what);
  for (const auto& pose : fit_face::mixtures(p, 7, 1000)) others.add(inspector.look(pose.values), pose.what);
  if (std::getenv("NMS_REPORT") != nullptr) {
    constexpr std::size_t kMost = 40;
    fmt::print("{}, {} vertices\nat rest\n{}units\n{}pairs and mixtures\n{}", GetParam().first, head.rest.size(),
               rest.text(kMost), units.text(kMost), others.text(kMost));
  }
  const Limits limits = limits_of(GetParam().first);
  EXPECT_EQ(rest.past(limits.rest), "");
  EXPECT_EQ(units.past(limits.units), "");
  EXPECT_EQ(others.past(limits.others), "");
}

INSTANTIATE_TEST_SUITE_P(Heads, OutsideHead,
                         testing::Values(std::pair("ict", "ict/generic_neutral_mesh.obj"),
                                         std::pair("makehuman", "makehuman/base.obj")),
                         [](const auto& head) { return std::string(head.param.first); });

}  // namespace
