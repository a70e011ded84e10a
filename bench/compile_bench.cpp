#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include <nms/compiler/compile.h>
#include <nms/program/evaluate.h>
#include <nms/program/program.h>

#include "../tests/embedded_library.h"

/// From an utterance's text to its first evaluated pose, in a process that has the library in memory: what a
/// translation system waits for.
namespace {

using namespace nms;

constexpr const char* kUtterance = R"(
utterance where_is_the_book in asl {
  signs { topic[ BOOK@0.00s..0.62s ] wh[ IX-3@0.70s..0.95s WHERE{wh}@0.95s..1.20s~1.60s ] }
  blink at end of BOOK
}
)";

/// Value of the first channel of the clip half-way through it.
float first_pose(lang::SourceProvider& library, compiler::TreeCache* trees) {
  lang::Diagnostics diagnostics;
  compiler::CompileOptions options;
  options.trees = trees;
  const auto source = std::make_shared<const lang::Source>("utterance.nms", kUtterance);
  const auto draft = compiler::compile({source}, library, diagnostics, options);
  if (!draft) return -1.0F;
  const auto image = program::Image::from(*draft);
  if (!image) return -1.0F;
  const program::Program& program = image->program();
  std::vector<float> values(program.channels.size());
  program::evaluate(program, program.clips[0], 500'000'000, values);
  return values[static_cast<std::size_t>(program.curves[program.clips[0].first_curve].channel)];
}

void utterance_to_first_pose_trees_kept(benchmark::State& state) {
  EmbeddedLibrary library;
  compiler::TreeCache trees;
  if (first_pose(library, &trees) < 0.0F) state.SkipWithError("the utterance does not compile");
  for (auto _ : state) benchmark::DoNotOptimize(first_pose(library, &trees));
}
BENCHMARK(utterance_to_first_pose_trees_kept);

void utterance_to_first_pose_library_parsed_anew(benchmark::State& state) {
  EmbeddedLibrary library;
  for (auto _ : state) benchmark::DoNotOptimize(first_pose(library, nullptr));
}
BENCHMARK(utterance_to_first_pose_library_parsed_anew);

}  // namespace
