#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <nms/runtime/face_x3d.h>
#include <nms/runtime/gltf_export.h>

#include "ada_fixture.h"
#include "busy_clip.h"

/// Files of the face ada against the runtime's own surface.
namespace nms::ada {
namespace {

constexpr double kThreeDegrees = 3.0 * 3.14159265358979 / 180.0;

// Lids against gaze and squint, one-sided lips over an open jaw, and the tongue put out, sideways and down at once.
constexpr const char* kMixtures = R"(
pose tip = AU111 + 50% AU114

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
  EXPECT_GT(before.clips.at(0).largest_m, 0.001);
  EXPECT_GT(before.clips.at(0).normal_rad, kThreeDegrees);
}

runtime::GltfReport report_of(const Bound& b, const runtime::GltfOptions& options) {
  runtime::GltfReport report;
  EXPECT_TRUE(runtime::export_glb(face(), b.rig, b.image.program(), options, &report).has_value());
  return report;
}

TEST(AdaExport, targets_alone_have_true_normals) {
  runtime::GltfOptions options;
  options.clips = {std::string(all_units().image.program().string(all_units().image.program().clips[0].name))};
  options.all_targets = true;
  for (const bool quantize : {false, true}) {
    options.quantize = quantize;
    const runtime::GltfReport report = report_of(all_units(), options);
    EXPECT_GT(report.targets.size(), 70U);
    for (const runtime::GltfTargetError& e : report.targets) {
      // Of a normal that turns by more than 90 degrees a byte leaves little: the tongue's when it curls.
      EXPECT_LE(e.askew_share, !quantize ? 0.0 : e.mesh == "tongue" ? 0.03 : 0.001) << e.name << " of " << e.mesh;
      EXPECT_LE(e.largest_m, 2e-5) << e.name << " of " << e.mesh;
    }
  }
}

TEST(AdaExport, little_of_a_face_is_askew_over_a_clip) {
  const Bound b = bind_with(R"(
use "emotions.nms"
timeline emotions 9s { happiness at 0.3s;  surprise at 3.2s;  anger at 5.6s;  blink at 3s }
)");
  runtime::GltfOptions options;
  options.clips = {"emotions"};
  options.quantize = true;
  const runtime::GltfReport report = report_of(b, options);
  ASSERT_EQ(report.clips.size(), 1U);
  EXPECT_LE(report.clips[0].askew_share, 0.01);
  EXPECT_LE(report.clips[0].askew_mean, 0.002);
  EXPECT_GT(report.clips[0].normal_rad, kThreeDegrees) << "at the lips' contact it is";
}

TEST(AdaExport, the_tongue_goes_out_as_the_runtime_has_it_unasked) {
  const Bound b = bind_with("timeline out 600ms { AU19 at 0s for 500ms;  AU111 at 0.2s for 300ms }");
  const runtime::GltfReport report = report_of(b, {});
  ASSERT_EQ(report.clips.size(), 1U);
  EXPECT_LE(report.clips[0].askew_share, 0.02) << report.clips[0].askew_mesh;
  EXPECT_LE(report.clips[0].largest_m, 0.0005) << report.clips[0].mesh;
}

// Both open the jaw; together no further than it goes.
TEST(AdaExport, a_jaw_opened_twice_stays_at_its_limit) {
  const Bound b = bind_with("timeline wide 600ms { AU27 at 0s for 500ms;  AU19 at 0s for 500ms }");
  const runtime::GltfReport report = report_of(b, {});
  ASSERT_EQ(report.clips.size(), 1U);
  EXPECT_LE(report.clips[0].largest_m, 0.004) << report.clips[0].mesh << " near " << report.clips[0].place;
  EXPECT_TRUE(std::find(report.corrections.begin(), report.corrections.end(), "fix.jaw.limit") !=
              report.corrections.end());
}

// Targets of the gaze would open what a blink's shut; nothing is asked for.
TEST(AdaExport, a_blink_while_the_eyes_look_up_is_shut) {
  const Bound b = bind_with("timeline up 1s { AU63 over 0.1s..0.9s;  AU45 at 0.4s for 200ms }");
  const runtime::GltfReport report = report_of(b, {});
  ASSERT_EQ(report.clips.size(), 1U);
  EXPECT_LE(report.clips[0].largest_m, 0.0005) << report.clips[0].place << " at " << report.clips[0].time_s << " s";
  EXPECT_TRUE(std::find(report.corrections.begin(), report.corrections.end(), "fix.lid_upper_L.shut") !=
              report.corrections.end());
}

/// Bytes that a file takes at 10,000 vertices: straight between the counts that the face has at two densities.
double bytes_at_ten_thousand(bool quantize) {
  const Bound b = bind_with(kBusyClip);
  std::vector<double> vertices;
  std::vector<double> bytes;
  for (const double density : {0.5, 1.0}) {
    const runtime::Face at = runtime::read_face_x3d(embedded("faces/ada.x3d"), "ada.x3d", {density, 400'000}).value();
    const runtime::Rig rig = runtime::bind(at, b.image.program()).value();
    runtime::GltfOptions options;
    options.quantize = quantize;
    const auto glb = runtime::export_glb(at, rig, b.image.program(), options);
    EXPECT_TRUE(glb.has_value());
    if (!glb) return 1e9;
    vertices.push_back(static_cast<double>(at.skin.surface.rows));
    bytes.push_back(static_cast<double>(glb->size()));
  }
  EXPECT_LT(vertices[0], 10'000.0);
  EXPECT_GT(vertices[1], 10'000.0);
  return bytes[0] + (10'000.0 - vertices[0]) / (vertices[1] - vertices[0]) * (bytes[1] - bytes[0]);
}

TEST(AdaExport, a_clip_of_fifty_targets_is_small) {
  const Bound b = bind_with(kBusyClip);
  const runtime::GltfReport report = report_of(b, {});
  EXPECT_GE(report.targets.size() + report.corrections.size(), 50U);
  const double plain = bytes_at_ten_thousand(false);
  EXPECT_LE(plain, 3.5e6);
  EXPECT_GT(plain, 1e6) << "there are targets in it";
  const double quantized = bytes_at_ten_thousand(true);
  EXPECT_LE(quantized, 1.45e6) << "1.5 MB is what was promised";
  EXPECT_GT(quantized, 0.4e6) << "there are targets in it";
}

}  // namespace
}  // namespace nms::ada
