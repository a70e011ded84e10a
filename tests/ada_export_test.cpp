#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <nms/runtime/gltf_export.h>

#include "ada_fixture.h"

/// Files of the face ada against the runtime's own surface.
namespace nms::ada {
namespace {

constexpr double kThreeDegrees = 3.0 * 3.14159265358979 / 180.0;

// Lids against gaze and squint, one-sided lips over an open jaw, and the tongue put out and bent at once.
constexpr const char* kMixtures = R"(
pose tip = 50% AU114

timeline mixtures 400ms {
  AU43 at 0.05s for 150ms;  AU64 at 0.1s for 150ms
  AU26 at 0.05s for 300ms;  AU12L at 0.1s for 250ms
  AU19 at 0.1s for 250ms;   tip at 0.15s for 150ms
}
)";

TEST(AdaExport, an_error_that_is_asked_for_holds_for_mixtures_of_lids_lips_and_tongue) {
  const Bound b = bind_with(kMixtures);
  runtime::GltfOptions options;
  options.quantize = true;
  runtime::GltfReport before;
  ASSERT_TRUE(runtime::export_glb(face(), b.rig, b.image.program(), options, &before).has_value());
  options.max_error_m = 0.0002;
  runtime::GltfReport report;
  ASSERT_TRUE(runtime::export_glb(face(), b.rig, b.image.program(), options, &report).has_value());
  for (const runtime::GltfClipError& e : report.clips) {
    EXPECT_LE(e.largest_m, options.max_error_m) << e.mesh << " near " << e.place << " at " << e.time_s << " s";
    EXPECT_LE(e.normal_rad, kThreeDegrees)
        << e.normal_mesh << " near " << e.normal_place << " at " << e.normal_time_s << " s";
  }
  // Straight targets alone are far off: there was something to mend.
  EXPECT_GT(before.clips.at(0).largest_m, 0.005);
  EXPECT_GT(before.clips.at(0).normal_rad, kThreeDegrees);
}

}  // namespace
}  // namespace nms::ada
