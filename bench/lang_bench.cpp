// How fast a large file of poses and expressions is parsed, formatted.
#include <cstdint>
#include <string>

#include <benchmark/benchmark.h>
#include <nms/lang/parse.h>

namespace {

using namespace nms::lang;

// A fixed sequence, so that runs compare.
class Sequence {
 public:
  std::uint32_t below(std::uint32_t n) {
    state_ = state_ * 6364136223846793005U + 1442695040888963407U;
    return static_cast<std::uint32_t>(state_ >> 33U) % n;
  }

 private:
  std::uint64_t state_ = 1;
};

// 60 % poses of 2 to 6 action units, 40 % expressions of 2 to 4 poses.
std::string corpus(std::size_t bytes) {
  Sequence s;
  std::string out;
  int poses = 0;
  int expressions = 0;
  while (out.size() < bytes) {
    if (poses == 0 || s.below(10) < 6) {
      out += "pose pose_" + std::to_string(poses++) + " = ";
      const std::uint32_t n = 2 + s.below(5);
      for (std::uint32_t i = 0; i < n; ++i) {
        if (i > 0) out += " + ";
        out += std::to_string(5 + s.below(96)) + "% AU" + std::to_string(1 + s.below(45));
      }
      out += '\n';
    } else {
      out += "expression expression_" + std::to_string(expressions++) + " " + std::to_string(1 + s.below(4)) + "." +
             std::to_string(s.below(100)) + "s {\n";
      const std::uint32_t n = 2 + s.below(3);
      for (std::uint32_t i = 0; i < n; ++i)
        out += "  " + std::to_string(100 / n) + "%: pose_" +
               std::to_string(s.below(static_cast<std::uint32_t>(poses))) + "\n";
      out += "}\n";
    }
  }
  return out;
}

const std::shared_ptr<const Source>& source() {
  static const auto made = std::make_shared<const Source>("bench.nms", corpus(10'000'000));
  return made;
}

void parse_poses_and_expressions(benchmark::State& state) {
  double per_byte = 0;
  for (auto _ : state) {
    Diagnostics diagnostics;
    const auto tree = parse(source(), diagnostics);
    if (diagnostics.error_count() > 0) state.SkipWithError("the corpus does not parse");
    per_byte = static_cast<double>(tree->nodes().size() * sizeof(Node)) / static_cast<double>(source()->text().size());
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
