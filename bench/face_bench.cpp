#include <memory>
#include <random>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include <nms/compiler/compile.h>
#include <nms/program/program.h>
#include <nms/runtime/face_x3d.h>
#include <nms/runtime/rig.h>

#include "../tests/embedded_library.h"

/// What a frame of the face ada costs: values -> contractions -> points -> surface -> normals. 14,841 vertices.
namespace {

using namespace nms;

struct Scene {
  runtime::Face face;
  program::Image image;
  runtime::Rig rig;
};

runtime::Face read_face() {
  for (const auto& file : stdlib::embedded_files()) {
    if (file.path == "faces/ada.x3d") return runtime::read_face_x3d(file.text, "ada.x3d").value();
  }
  return {};
}

const Scene& scene() {
  static const Scene made = [] {
    EmbeddedLibrary library;
    lang::Diagnostics diagnostics;
    compiler::CompileOptions options;
    options.face = "ada";
    const std::string source = "expression e 1s { 100%: AU1 + AU4 + AU6 + AU12 + AU25 + AU26 + AU43 + AU63 }\n";
    const auto draft = compiler::compile(
        {std::make_shared<const lang::Source>("bench.nms", source), library.find("faces/ada.nms", "")}, library,
        diagnostics, options);
    program::Image image = std::move(program::Image::from(draft.value()).value());
    runtime::Face face = read_face();
    runtime::Rig rig = runtime::bind(face, image.program()).value();
    return Scene{std::move(face), std::move(image), std::move(rig)};
  }();
  return made;
}

/// Six units at once, other values every frame.
void pose_a_frame(benchmark::State& state) {
  const Scene& s = scene();
  runtime::Pose pose = runtime::make_pose(s.face, s.rig);
  std::mt19937 random(3);
  std::vector<float> values(s.rig.channel_count(), 0.0F);
  for (auto _ : state) {
    std::fill(values.begin(), values.end(), 0.0F);
    for (int k = 0; k < 6; ++k) values[random() % values.size()] = static_cast<float>(random() % 101) / 100.0F;
    runtime::pose_face(s.face, s.rig, values, pose);
    benchmark::DoNotOptimize(pose.normals.data());
    benchmark::ClobberMemory();
  }
  state.counters["vertices"] = static_cast<double>(s.face.skin.surface.rows);
}
BENCHMARK(pose_a_frame);

void tessellate_alone(benchmark::State& state) {
  const Scene& s = scene();
  runtime::Pose pose = runtime::make_pose(s.face, s.rig);
  for (auto _ : state) {
    runtime::multiply(s.face.skin.surface, pose.x, pose.positions);
    benchmark::DoNotOptimize(pose.positions.data());
    benchmark::ClobberMemory();
  }
}
BENCHMARK(tessellate_alone);

void normals_alone(benchmark::State& state) {
  const Scene& s = scene();
  runtime::Pose pose = runtime::make_pose(s.face, s.rig);
  runtime::pose_face(s.face, s.rig, std::vector<float>(s.rig.channel_count(), 0.0F), pose);
  for (auto _ : state) {
    runtime::area_weighted_normals(s.face.skin.primitives, pose.positions, pose.normals);
    benchmark::DoNotOptimize(pose.normals.data());
    benchmark::ClobberMemory();
  }
}
BENCHMARK(normals_alone);

void hold_apart_alone(benchmark::State& state) {
  const Scene& s = scene();
  runtime::Pose pose = runtime::make_pose(s.face, s.rig);
  runtime::pose_face(s.face, s.rig, std::vector<float>(s.rig.channel_count(), 0.0F), pose);
  for (auto _ : state) {
    runtime::hold_vertices_apart(s.rig, pose);
    benchmark::DoNotOptimize(pose.positions.data());
    benchmark::ClobberMemory();
  }
}
BENCHMARK(hold_apart_alone);

void bind_a_rig(benchmark::State& state) {
  const Scene& s = scene();
  for (auto _ : state) benchmark::DoNotOptimize(runtime::bind(s.face, s.image.program()));
}
BENCHMARK(bind_a_rig)->Unit(benchmark::kMillisecond);

}  // namespace
