// `nmsc test --mutate`: what the tests of a lexicon do not notice.
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <nms/compiler/mutation.h>
#include <nms/lang/render.h>

#include "commands.h"
#include "loading.h"
#include "report.h"
#include "tiers.h"

namespace nms::cli {
namespace {

using compiler::Removal;

/// What one thread works with: sources are not for several at once.
struct Worker {
  SourceFiles sources;
  lang::Diagnostics diagnostics;
  compiler::MutationResult result;
};

/// All removals, each tried by one of several threads.
std::vector<std::unique_ptr<Worker>> mutate_side_by_side(const GlobalOptions& global,
                                                         const std::vector<std::string>& files) {
  const std::uint32_t count = std::max(1U, std::thread::hardware_concurrency());
  std::vector<std::unique_ptr<Worker>> workers;
  for (std::uint32_t i = 0; i < count; ++i)
    workers.push_back(std::make_unique<Worker>(Worker{SourceFiles(global.stdlib), {}, {}}));
  const auto work = [&](std::uint32_t share) {
    Worker& w = *workers[share];
    const auto tables = load_time_tables(global, w.sources, w.diagnostics);
    const auto roots = load_roots(files, w.sources, w.diagnostics);
    if (!tables || w.diagnostics.error_count() != 0) return;
    w.result = compiler::mutate(roots, w.sources, w.diagnostics, {*tables, share, count});
  };
  std::vector<std::thread> others;
  for (std::uint32_t i = 1; i < count; ++i) others.emplace_back(work, i);
  work(0);
  for (std::thread& t : others) t.join();
  return workers;
}

bool survived(const Removal& r) { return r.fate == Removal::Fate::unnoticed || r.fate == Removal::Fate::untested; }

std::string_view fate_name(Removal::Fate fate) {
  switch (fate) {
    case Removal::Fate::noticed:
      return "noticed";
    case Removal::Fate::unnoticed:
      return "unnoticed";
    case Removal::Fate::untested:
      return "untested";
    case Removal::Fate::impossible:
      return "impossible";
    case Removal::Fate::untried:
      break;
  }
  return "untried";
}

void print_json(const std::vector<Removal>& removals) {
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  for (const Removal& r : removals) {
    const lang::Position at = r.source->position(r.range.begin);
    all.push_back({{"file", r.source->path()},
                   {"line", at.line},
                   {"column", at.column},
                   {"lexicon", r.lexicon},
                   {"entry", r.entry},
                   {"part", compiler::name_of(r.part)},
                   {"text", printable(r.source->slice(r.range))},
                   {"fate", fate_name(r.fate)},
                   {"tests", r.tests}});
  }
  fmt::print("{}\n", nlohmann::ordered_json{{"removals", std::move(all)}}.dump(1));
}

}  // namespace

int test_mutate(const GlobalOptions& global, const TestCommandOptions& options) {
  auto workers = mutate_side_by_side(global, options.files);
  lang::Diagnostics& diagnostics = workers.front()->diagnostics;
  if (diagnostics.error_count() != 0) return finish(global, diagnostics);
  const std::vector<compiler::TestResult>& failing = workers.front()->result.failing;
  if (!failing.empty()) {
    add_failure(diagnostics, {"failing_tests", failing.front().name,
                              fmt::format("{} {} with everything in place", failing.size(),
                                          failing.size() == 1 ? "test fails" : "tests fail"),
                              "run nmsc test without --mutate first"});
    return finish(global, diagnostics);
  }
  std::vector<Removal>& removals = workers.front()->result.removals;
  std::size_t counts[5] = {};
  lang::Diagnostics survivors;
  for (std::size_t i = 0; i < removals.size(); ++i) {
    Removal& r = removals[i];
    r.fate = workers[i % workers.size()]->result.removals[i].fate;
    ++counts[static_cast<std::size_t>(r.fate)];
    if (survived(r)) survivors.report(r.source, r.range, compiler::RemovalUnnoticed{r});
  }
  const auto count = [&counts](Removal::Fate fate) { return counts[static_cast<std::size_t>(fate)]; };
  if (removals.empty())
    add_failure(diagnostics,
                {"no_tests", options.files.front(), "there are no lexicons in what is given",
                 "give the tests of one: a file that says use \"LEXICON.nms\", or the lexicon itself"},
                lang::Severity::warning);
  if (options.json) {
    print_json(removals);
  } else {
    const bool color = ::isatty(STDOUT_FILENO) != 0 && std::getenv("NO_COLOR") == nullptr;
    if (global.error_format == ErrorFormat::text) {
      const std::string text = lang::render_text(survivors, color);
      std::fwrite(text.data(), 1, text.size(), stdout);
    } else {
      for (const lang::Diagnostic& d : survivors.all()) diagnostics.add(d);
    }
    fmt::print("{} parts taken out: {} noticed, {} unnoticed, {} untested, {} without which nothing compiles\n",
               removals.size(), count(Removal::Fate::noticed), count(Removal::Fate::unnoticed),
               count(Removal::Fate::untested), count(Removal::Fate::impossible));
  }
  const int code = finish(global, diagnostics);
  return survivors.all().empty() ? code : kErrors;
}

}  // namespace nms::cli
