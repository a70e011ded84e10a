#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include <nms/compiler/compile.h>
#include <nms/program/play.h>
#include <nms/program/program.h>
#include <nms/runtime/face_x3d.h>
#include <nms/runtime/gltf_export.h>
#include <nms/runtime/rig.h>

#include "../tests/busy_clip.h"
#include "../tests/embedded_library.h"

/// What a frame of the face ada costs: time -> values -> contractions -> points -> surface -> normals, at several
/// densities of its surface; and what an export costs.
namespace {

using namespace nms;

struct Scene {
  runtime::Face face;
  program::Image image;
  runtime::Rig rig;
};

runtime::Face read_face(double density) {
  for (const auto& file : stdlib::embedded_files()) {
    if (file.path == "faces/ada.x3d") return runtime::read_face_x3d(file.text, "ada.x3d", {density, 400'000}).value();
  }
  return {};
}

/// As examples/six_emotions.nms.
constexpr const char* kEmotions = R"(
use "emotions.nms"

timeline much 18s {
  happiness at 0.3s;  sadness at 3.2s;  surprise at 6.5s;  fear at 8.9s;  anger at 11.8s;  disgust at 14.8s
  blink at 3.0s;  blink at 6.2s;  blink at 8.6s;  blink at 11.6s;  blink at 14.5s
}
)";

/// @param density  as TessellationSettings has it, in hundredths
const Scene& scene(std::int64_t density, const char* source = kBusyClip) {
  static std::map<std::pair<std::int64_t, const char*>, std::unique_ptr<Scene>> made;
  std::unique_ptr<Scene>& one = made[{density, source}];
  if (!one) {
    EmbeddedLibrary library;
    lang::Diagnostics diagnostics;
    compiler::CompileOptions options;
    options.face = "ada";
    const auto draft = compiler::compile(
        {std::make_shared<const lang::Source>("bench.nms", source), library.find("faces/ada.nms", "")}, library,
        diagnostics, options);
    program::Image image = std::move(program::Image::from(draft.value()).value());
    runtime::Face face = read_face(static_cast<double>(density) / 100.0);
    runtime::Rig rig = runtime::bind(face, image.program()).value();
    one = std::make_unique<Scene>(Scene{std::move(face), std::move(image), std::move(rig)});
  }
  return *one;
}

// 5,000 vertices, the face's own, ... about 200,000.
void densities(benchmark::internal::Benchmark* bench) {
  for (const int density : {50, 100, 200, 350}) bench->Arg(density);
}

double vertices(const Scene& s) { return static_cast<double>(s.face.skin.surface.rows); }

/// Frames of a clip in which most units act, 60 a second.
void a_frame(benchmark::State& state) {
  const Scene& s = scene(state.range(0));
  const program::Program& program = s.image.program();
  const program::Clip& clip = *program.find_clip("much");
  runtime::Pose pose = runtime::make_pose(s.face, s.rig);
  program::Player player(program, clip);
  std::vector<float> values(s.rig.channel_count(), 0.0F);
  std::int64_t time_ns = 0;
  for (auto _ : state) {
    player.advance(time_ns, values);
    runtime::pose_face(s.face, s.rig, values, pose);
    time_ns = (time_ns + 16'666'667) % clip.end_ns;
    benchmark::DoNotOptimize(pose.normals.data());
    benchmark::ClobberMemory();
  }
  state.counters["vertices"] = vertices(s);
}
BENCHMARK(a_frame)->Apply(densities);

void tessellate_alone(benchmark::State& state) {
  const Scene& s = scene(state.range(0));
  runtime::Pose pose = runtime::make_pose(s.face, s.rig);
  for (auto _ : state) {
    runtime::multiply(s.rig.tables().moving_rows, pose.x, s.face.skin.offsets, pose.positions);
    benchmark::DoNotOptimize(pose.positions.data());
    benchmark::ClobberMemory();
  }
  state.counters["vertices"] = vertices(s);
}
BENCHMARK(tessellate_alone)->Apply(densities);

void normals_alone(benchmark::State& state) {
  const Scene& s = scene(state.range(0));
  runtime::Pose pose = runtime::make_pose(s.face, s.rig);
  for (auto _ : state) {
    runtime::area_weighted_normals(s.rig.tables().moving_normals, pose.positions, pose.scratch, pose.normals);
    benchmark::DoNotOptimize(pose.normals.data());
    benchmark::ClobberMemory();
  }
  state.counters["vertices"] = vertices(s);
}
BENCHMARK(normals_alone)->Apply(densities);

void hold_apart_alone(benchmark::State& state) {
  const Scene& s = scene(state.range(0));
  runtime::Pose pose = runtime::make_pose(s.face, s.rig);
  for (auto _ : state) {
    runtime::hold_vertices_apart(s.rig, pose);
    benchmark::DoNotOptimize(pose.positions.data());
    benchmark::ClobberMemory();
  }
  state.counters["vertices"] = vertices(s);
}
BENCHMARK(hold_apart_alone)->Apply(densities);

void bind_a_rig(benchmark::State& state) {
  const Scene& s = scene(state.range(0));
  for (auto _ : state) benchmark::DoNotOptimize(runtime::bind(s.face, s.image.program()));
  state.counters["vertices"] = vertices(s);
}
BENCHMARK(bind_a_rig)->Apply(densities)->Unit(benchmark::kMillisecond);

// Quantized where the second number is 1.
void export_a_clip(benchmark::State& state) {
  const Scene& s = scene(state.range(0));
  std::size_t bytes = 0;
  runtime::GltfOptions options;
  options.clips = {"much"};
  options.quantize = state.range(1) != 0;
  for (auto _ : state) {
    const auto glb = runtime::export_glb(s.face, s.rig, s.image.program(), options);
    bytes = glb->size();
    benchmark::DoNotOptimize(glb->data());
  }
  state.counters["vertices"] = vertices(s);
  state.counters["bytes"] = static_cast<double>(bytes);
}
BENCHMARK(export_a_clip)->ArgsProduct({{50, 100}, {0, 1}})->Unit(benchmark::kMillisecond);

// With corrective targets, for 18 s of clip; the second number is the error, in hundredths of a millimetre.
void export_within_an_error(benchmark::State& state) {
  const Scene& s = scene(state.range(0), kEmotions);
  std::size_t bytes = 0;
  for (auto _ : state) {
    runtime::GltfOptions options;
    options.clips = {"much"};
    options.max_error_m = static_cast<double>(state.range(1)) * 1e-5;
    const auto glb = runtime::export_glb(s.face, s.rig, s.image.program(), options);
    bytes = glb->size();
    benchmark::DoNotOptimize(glb->data());
  }
  state.counters["vertices"] = vertices(s);
  state.counters["bytes"] = static_cast<double>(bytes);
}
BENCHMARK(export_within_an_error)->Args({50, 20})->Args({100, 20})->Args({100, 50})->Unit(benchmark::kMillisecond);

}  // namespace
