// How fast a large file of poses and expressions is parsed, formatted.
#include <cstdint>

#include <benchmark/benchmark.h>
#include <nms/lang/parse.h>

#include "pose_stream.h"

namespace {

using namespace nms::lang;

const std::shared_ptr<const Source>& source() {
  static const auto made = std::make_shared<const Source>("bench.nms", nms::bench::make_pose_stream(10'000'000).nms);
  return made;
}

void parse_poses_and_expressions(benchmark::State& state) {
  double per_byte = 0;
  for (auto _ : state) {
    Diagnostics diagnostics;
    const auto tree = parse(source(), diagnostics);
    if (diagnostics.error_count() > 0) state.SkipWithError("the corpus does not parse");
    per_byte =
        static_cast<double>(tree->nodes().size() * NodeList::kNodeBytes) / static_cast<double>(source()->text().size());
  }
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations()) *
                          static_cast<std::int64_t>(source()->text().size()));
  state.counters["tree_bytes_per_byte"] = per_byte;
}
BENCHMARK(parse_poses_and_expressions)->Unit(benchmark::kMillisecond);

void format_poses_and_expressions(benchmark::State& state) {
  Diagnostics diagnostics;
  const auto tree = parse(source(), diagnostics);
  for (auto _ : state) benchmark::DoNotOptimize(format(*tree));
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations()) *
                          static_cast<std::int64_t>(source()->text().size()));
}
BENCHMARK(format_poses_and_expressions)->Unit(benchmark::kMillisecond);

}  // namespace
