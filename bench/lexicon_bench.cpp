// What a build server waits for: all of the library checked, a lexicon compiled.
#include <memory>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include <nms/compiler/compile.h>
#include <nms/stdlib/embedded.h>

#include "../tests/embedded_library.h"
#include "lexicon_text.h"

namespace {

using namespace nms;

/// Each file as `nmsc check FILE` has it, but that trees of what they use are kept from one to the next.
void library_checked(benchmark::State& state) {
  EmbeddedLibrary library;
  std::vector<std::string> paths;
  for (const auto& file : stdlib::embedded_files())
    if (file.path.ends_with(".nms")) paths.emplace_back(file.path);
  for (auto _ : state) {
    compiler::TreeCache trees;
    compiler::CompileOptions options;
    options.trees = &trees;
    for (const std::string& path : paths) {
      lang::Diagnostics diagnostics;
      compiler::check({library.find(path, "")}, library, diagnostics, options);
      if (diagnostics.error_count() != 0) state.SkipWithError(path.c_str());
    }
  }
  state.counters["files"] = static_cast<double>(paths.size());
}
BENCHMARK(library_checked)->Unit(benchmark::kMillisecond);

/// @param kept  trees of the library are kept from one compilation to the next
void compile_lexicon(benchmark::State& state, bool kept) {
  EmbeddedLibrary library;
  compiler::TreeCache trees;
  const auto source = std::make_shared<const lang::Source>("bench.nms", bench::lexicon_text());
  std::size_t clips = 0;
  for (auto _ : state) {
    lang::Diagnostics diagnostics;
    compiler::CompileOptions options;
    options.lexicon = "bench";
    if (kept) options.trees = &trees;
    const auto draft = compiler::compile({source}, library, diagnostics, options);
    clips = draft ? draft->clips.size() : 0;
  }
  if (clips != bench::kEntries) state.SkipWithError("the lexicon has not that many entries");
}
void lexicon_of_150_compiled(benchmark::State& state) { compile_lexicon(state, false); }
BENCHMARK(lexicon_of_150_compiled)->Unit(benchmark::kMillisecond);
void lexicon_of_150_compiled_trees_kept(benchmark::State& state) { compile_lexicon(state, true); }
BENCHMARK(lexicon_of_150_compiled_trees_kept)->Unit(benchmark::kMillisecond);

}  // namespace
