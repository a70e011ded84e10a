#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include <nms/compiler/compile.h>
#include <nms/program/program.h>
#include <nms/runtime/face_file.h>
#include <nms/runtime/rig.h>

#include "../tests/embedded_library.h"
#include "../tests/synthetic_head.h"

/// What a head of polygons costs, from 2,500 to 200,000 vertices: reading it, making its regions, binding the muscles,
/// a frame. Each is told by the vertex too (`per_vertex`), which stays the same where time grows with their number.
namespace {

using namespace nms;

struct Scene {
  test::SyntheticHead head;
  std::string obj;
  runtime::Face face;
  program::Image image;
  runtime::Rig rig;
};

runtime::Face make_face(const test::SyntheticHead& head) {
  runtime::Face face = runtime::make_polygon_face(head.mesh, "head", head.form).value();
  for (const runtime::FaceForm::Place& place : head.form.landmarks) face.landmarks[place.name] = place.position;
  return face;
}

const Scene& scene(std::int64_t spacing_um) {
  static std::map<std::int64_t, std::unique_ptr<Scene>> made;
  std::unique_ptr<Scene>& one = made[spacing_um];
  if (one) return *one;
  EmbeddedLibrary library;
  lang::Diagnostics diagnostics;
  compiler::CompileOptions options;
  options.face = "ada";
  const auto draft =
      compiler::compile({std::make_shared<const lang::Source>("bench.nms", "expression e 1s { 100%: 100% AU12 }\n"),
                         library.find("faces/ada.nms", "")},
                        library, diagnostics, options);
  program::Image image = std::move(program::Image::from(draft.value()).value());
  test::SyntheticHead head = test::synthetic_head(static_cast<double>(spacing_um) / 1000.0);
  std::string obj = test::obj_text(head.mesh);
  runtime::Face face = make_face(head);
  std::vector<runtime::RigGap> gaps;  // it has no tongue
  runtime::Rig rig = runtime::bind(face, image.program(), &gaps).value();
  one = std::make_unique<Scene>(
      Scene{std::move(head), std::move(obj), std::move(face), std::move(image), std::move(rig)});
  return *one;
}

// Spacings of the grid, micrometres.
void sizes(benchmark::internal::Benchmark* bench) {
  for (const int spacing : {4200, 2100, 1050, 525, 430}) bench->Arg(spacing);
  bench->Unit(benchmark::kMillisecond);
}

void say(benchmark::State& state, const Scene& s) {
  const auto vertices = static_cast<double>(s.face.skin.surface.rows);
  state.counters["vertices"] = vertices;
  state.counters["per_vertex"] =
      benchmark::Counter(vertices, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

void read_obj(benchmark::State& state) {
  const Scene& s = scene(state.range(0));
  for (auto _ : state) benchmark::DoNotOptimize(runtime::read_obj(s.obj, "head.obj"));
  say(state, s);
}
BENCHMARK(read_obj)->Apply(sizes);

void make(benchmark::State& state) {
  const Scene& s = scene(state.range(0));
  for (auto _ : state) benchmark::DoNotOptimize(make_face(s.head));
  say(state, s);
}
BENCHMARK(make)->Apply(sizes);

void bind(benchmark::State& state) {
  const Scene& s = scene(state.range(0));
  for (auto _ : state) {
    std::vector<runtime::RigGap> gaps;
    benchmark::DoNotOptimize(runtime::bind(s.face, s.image.program(), &gaps));
  }
  say(state, s);
}
BENCHMARK(bind)->Apply(sizes);

/// A frame in which every action unit stands at 30 %.
void a_frame(benchmark::State& state) {
  const Scene& s = scene(state.range(0));
  runtime::Pose pose = runtime::make_pose(s.face, s.rig);
  const std::vector<float> values(s.rig.channel_count(), 0.3F);
  for (auto _ : state) {
    runtime::pose_face(s.face, s.rig, values, pose);
    benchmark::DoNotOptimize(pose.normals.data());
  }
  say(state, s);
}
BENCHMARK(a_frame)->Apply(sizes);

}  // namespace
