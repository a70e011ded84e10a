// What FACS calls alternatives, or one body cannot do, may still be written: two states of a lid, two ways of pressing
// the lips. Nothing says so at compile time, so such pairs are looked at too.
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include <nms/runtime/face_file.h>

#include "ada_fixture.h"
#include "face_artefacts.h"

namespace nms::ada {
namespace {

TEST(AdaAlternatives, show_no_artefacts_either) {
  const Bound& b = all_units();
  test::Inspector inspector(face(), b.rig, runtime::landmarks_of(face(), b.image.program()));
  test::ArtefactTally tally;
  const std::pair<const char*, const char*> pairs[] = {
      {"AU5", "AU41"},  {"AU5", "AU42"},  {"AU5", "AU43"},  {"AU5", "AU44"},   {"AU41", "AU43"},  {"AU42", "AU43"},
      {"AU43", "AU45"}, {"AU44", "AU45"}, {"AU8", "AU19"},  {"AU8", "AU24"},   {"AU8", "AU28"},   {"AU8", "AU32"},
      {"AU23", "AU24"}, {"AU23", "AU28"}, {"AU24", "AU28"}, {"AU24", "AU32"},  {"AU28", "AU32"},  {"AU26", "AU27"},
      {"AU25", "AU33"}, {"AU27", "AU33"}, {"AU19", "AU23"}, {"AU19", "AU24"},  {"AU19", "AU32"},  {"AU19", "AU33"},
      {"AU19", "AU34"}, {"AU19", "AU37"}, {"AU23", "AU37"}, {"AU19", "AU116"}, {"AU23", "AU116"},
  };
  for (const auto& [one, other] : pairs)
    tally.add(inspector.look(values_of(b, {one, other})), std::string(one) + " + " + other);
  // Tightened and sucked in at once, the lips have one small fold in the middle.
  EXPECT_EQ(tally.past({{"folded skin", 0.5, 0.04}}), "");
}

}  // namespace
}  // namespace nms::ada
