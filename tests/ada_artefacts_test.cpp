// No artefacts on ada: every unit alone, every pair that a face can do together, and a thousand mixtures of up to six,
// on all vertices.
//
// A finding names the units, what goes through what, the nearest landmark, and by how much. NMS_REPORT=1 prints all
// kinds with their worst cases.
#include <cstdlib>
#include <vector>

#include <gtest/gtest.h>

#include <nms/runtime/face_file.h>

#include "ada_fixture.h"
#include "face_artefacts.h"
#include "under_sanitizers.h"

#include "../tools/fit_face/poses.h"

namespace {

using namespace nms;
using namespace nms::ada;

void expect_none(const test::ArtefactTally& tally, const char* title) {
  EXPECT_TRUE(tally.empty()) << title << ":\n" << tally.text(std::getenv("NMS_REPORT") != nullptr ? 60 : 4);
}

test::Inspector inspector() {
  return {face(), all_units().rig, runtime::landmarks_of(face(), all_units().image.program())};
}

test::ArtefactTally inspect(const std::vector<fit_face::FacePose>& poses) {
  test::Inspector with = inspector();
  test::ArtefactTally tally;
  for (const fit_face::FacePose& pose : poses) tally.add(with.look(pose.values), pose.what);
  return tally;
}

TEST(AdaArtefacts, NoneAtRest) {
  test::ArtefactTally tally;
  tally.add(inspector().at_rest(), "rest");
  expect_none(tally, "at rest");
}

/// All, or under the sanitizers a few.
std::vector<fit_face::FacePose> some_of(const std::vector<fit_face::FacePose>& poses) {
  const std::size_t every = one_case_of(5);
  std::vector<fit_face::FacePose> some;
  for (std::size_t i = 0; i < poses.size(); i += every) some.push_back(poses[i]);
  return some;
}

TEST(AdaArtefacts, NoneUnderAnyUnit) {
  const auto poses = fit_face::each_unit(all_units().image.program(), all_units().rig);
  EXPECT_GT(poses.size(), 200U);
  expect_none(inspect(poses), "units");
}

TEST(AdaArtefacts, NoneUnderAnyPair) {
  const auto poses = fit_face::each_pair(all_units().image.program(), all_units().rig);
  EXPECT_GT(poses.size(), 1000U);
  expect_none(inspect(some_of(poses)), "pairs");
}

TEST(AdaArtefacts, NoneUnderAThousandMixtures) {
  expect_none(inspect(some_of(fit_face::mixtures(all_units().image.program(), 7, 1000))), "mixtures");
}

}  // namespace
