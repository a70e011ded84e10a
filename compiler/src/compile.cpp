#include <nms/compiler/compile.h>

#include <algorithm>
#include <string>
#include <unordered_set>

#include <fmt/format.h>

#include <nms/compiler/diagnostic_kinds.h>
#include <nms/compiler/explain.h>
#include <nms/compiler/test.h>

#include "ambient.h"
#include "channels.h"
#include "combine.h"
#include "declarations.h"
#include "emit.h"
#include "explain.h"
#include "load_sources.h"
#include "lower_clip.h"
#include "lower_discourse.h"
#include "merge.h"
#include "movement.h"
#include "rig.h"
#include "test_run.h"

namespace nms::compiler {

using lang::NodeKind;
using lang::NodeRef;

namespace {

constexpr std::size_t kMaxKnots = 20'000'000;

/// Poses and motions make no clip; they are worked out once all the same, so that what is wrong is found where it is.
void check_movement(const Declaration& d, Evaluator& evaluator) {
  Scope outer;
  outer.file = d.file;
  const NodeRef params = d.node.child(NodeKind::params);
  if (params)  // a parameter without a default has no value to try
    for (NodeRef p : params.children())
      if (p.is(NodeKind::param) && !p.at(1)) return;
  const auto scope = evaluator.bind({}, false, d.name, params, d.file, outer);
  if (!scope) return;
  const auto movement = evaluator.declaration(d, *scope);
  if (!movement || d.node.kind() != NodeKind::pose) return;
  for (const Amount& a : movement->pose) {
    const ChannelInfo& c = evaluator.channels().channels[a.channel];
    if (a.value > 1.0 + 1e-9 || a.value < c.low() - 1e-9)
      evaluator.report(outer, d.node.child(NodeKind::name),
                       Saturated{c.name, fmt::format("{:.4g}%", a.value * 100.0),
                                 fmt::format("{:.4g}%", a.value > 1.0 ? 100.0 : c.low() * 100.0)});
  }
}

/// All that becomes clips, in the order it is declared, file by file.
std::vector<const Declaration*> clip_sources(const std::vector<LoadedFile>& files, const Declarations& all,
                                             const std::string& lexicon) {
  if (!lexicon.empty()) {
    const std::uint32_t index = all.find_lexicon(lexicon);
    return index == kUnreachable ? std::vector<const Declaration*>() : all.entries_of(index);
  }
  std::vector<const Declaration*> out;
  for (const Declaration& d : all.movements)
    if (files[d.file].root && d.node.is(NodeKind::expression)) out.push_back(&d);
  for (const Declaration& d : all.clips)
    if (files[d.file].root) out.push_back(&d);
  for (const Declaration& d : all.entries)
    if (files[d.file].root) out.push_back(&d);
  std::stable_sort(out.begin(), out.end(), [](const Declaration* a, const Declaration* b) {
    return a->file != b->file ? a->file < b->file : a->node.index() < b->node.index();
  });
  return out;
}

/// The clips of one declaration: one, but of a discourse one for each participant. None: it has errors, or no length of
/// its own.
std::vector<ClipDraft> lower(const Declaration& d, Evaluator& evaluator, Discourses& discourses) {
  std::vector<ClipDraft> out;
  const auto keep = [&out](std::optional<ClipDraft>&& clip) {
    if (clip) out.push_back(std::move(*clip));
  };
  switch (d.node.kind()) {
    case NodeKind::expression:
      keep(lower_expression(d, evaluator));
      break;
    case NodeKind::timeline:
      keep(lower_timeline(d, evaluator));
      break;
    case NodeKind::entry:
      keep(lower_entry(d, evaluator));
      break;
    case NodeKind::utterance: {
      UtteranceSetting setting;
      setting.places = discourses.places_of(d);
      if (auto utterance = lower_utterance(d, evaluator, setting)) out.push_back(std::move(utterance->clip));
      break;
    }
    case NodeKind::discourse:
      if (auto discourse = discourses.lower(d)) {
        out.push_back(std::move(discourse->clip));
        for (ClipDraft& participant : discourse->participants) out.push_back(std::move(participant));
      }
      break;
    default:
      break;
  }
  return out;
}

/// What is asked of the tests of the roots: they are checked in any case.
struct TestRequest {
  std::string_view filter;
  std::vector<TestResult> results;
};

/// The clip whose merging is to be written down, and what was.
struct ExplainRequest {
  const ExplainOptions& options;
  std::vector<std::string> clips;
  bool found = false;
  std::vector<ChannelExplanation> channels;
};

void visit_tests(const std::vector<LoadedFile>& files, Evaluator& evaluator, Discourses& discourses,
                 TestRequest* request) {
  TestRun tests(evaluator, discourses);
  for (const Declaration& d : evaluator.declarations().tests) {
    if (!files[d.file].root) continue;
    const NodeRef name = d.node.child(NodeKind::string);
    // Once something is wrong, nothing that is worked out counts.
    const bool wanted = request != nullptr && name && evaluator.diagnostics().error_count() == 0 &&
                        unquoted(name).find(request->filter) != std::string_view::npos;
    if (wanted)
      request->results.push_back(tests.run(d));
    else
      tests.check(d);
  }
}

std::optional<program::Draft> compile_all(const std::vector<std::shared_ptr<const lang::Source>>& roots,
                                          lang::SourceProvider& provider, lang::Diagnostics& diagnostics,
                                          const CompileOptions& options, TestRequest* request,
                                          ExplainRequest* explained = nullptr) {
  OutsideTimes outside(options.times, diagnostics);
  std::vector<LoadedFile> files = load_sources(roots, provider, diagnostics);
  const Declarations declarations = Declarations::collect(files, provider, diagnostics);
  const Channels channels = build_channels(files, declarations, diagnostics);
  Evaluator evaluator(files, declarations, channels, outside, diagnostics);
  Discourses discourses(evaluator);
  Emitter emitter;
  emitter.channels(channels);
  build_rig(options.face, evaluator, emitter);

  for (const Declaration& d : declarations.movements)
    if (files[d.file].root) check_movement(d, evaluator);
  for (const Declaration& d : declarations.degrees)
    if (files[d.file].root) evaluator.degree_of(d);
  for (const Declaration& d : declarations.ambients)
    if (files[d.file].root) check_ambient(d, evaluator);
  check_combinations(evaluator);

  std::unordered_set<std::string> names;
  const auto add = [&](const Declaration& d, ClipDraft& clip) {
    // Clips are named in files and players: one name, one clip. An entry gives way and takes its lexicon's name along.
    if (names.count(clip.name) != 0 && clip.kind == program::ClipKind::entry)
      clip.name = fmt::format("{}_{}", declarations.lexicons[d.lexicon].declaration.name, clip.name);
    if (!names.insert(clip.name).second) {
      evaluator.report({}, d.node.child(NodeKind::name), DuplicateName{"clip", clip.name});
      return;
    }
    if (explained != nullptr) explained->clips.push_back(clip.name);
    std::optional<TooLarge> too_large;
    if (explained != nullptr && clip.name == explained->options.clip) {
      ExplanationRecorder recorder(clip, channels, explained->options.time_ns);
      too_large = emitter.clip(clip, merge(clip, channels, &recorder), channels);
      explained->found = true;
      explained->channels = recorder.take();
    } else {
      too_large = emitter.clip(clip, merge(clip, channels), channels);
    }
    if (too_large) evaluator.report({}, d.node, *too_large);
  };
  for (const Declaration* d : clip_sources(files, declarations, options.lexicon)) {
    for (ClipDraft& clip : lower(*d, evaluator, discourses)) add(*d, clip);
    if (emitter.draft.knots.size() > kMaxKnots) {
      evaluator.report({}, d->node, TooLarge{"the program", fmt::format("{} knots", kMaxKnots)});
      break;
    }
  }
  visit_tests(files, evaluator, discourses, request);
  if (diagnostics.error_count() != 0) return std::nullopt;
  // Tests are run file by file, and one table may serve them all.
  if (request == nullptr) outside.report_unused(diagnostics);
  return std::move(emitter.draft);
}

}  // namespace

std::optional<program::Draft> compile(const std::vector<std::shared_ptr<const lang::Source>>& roots,
                                      lang::SourceProvider& provider, lang::Diagnostics& diagnostics,
                                      const CompileOptions& options) {
  return compile_all(roots, provider, diagnostics, options, nullptr);
}

std::vector<TestResult> run_tests(const std::vector<std::shared_ptr<const lang::Source>>& roots,
                                  lang::SourceProvider& provider, lang::Diagnostics& diagnostics,
                                  const TestOptions& options) {
  TestRequest request{options.filter, {}};
  CompileOptions compile_options;
  compile_options.times = options.times;
  if (!compile_all(roots, provider, diagnostics, compile_options, &request)) return {};
  return std::move(request.results);
}

std::optional<Explanation> explain(const std::vector<std::shared_ptr<const lang::Source>>& roots,
                                   lang::SourceProvider& provider, lang::Diagnostics& diagnostics,
                                   const ExplainOptions& options) {
  ExplainRequest request{options, {}, false, {}};
  CompileOptions compile_options;
  compile_options.times = options.times;
  auto draft = compile_all(roots, provider, diagnostics, compile_options, nullptr, &request);
  if (!draft) return std::nullopt;
  return Explanation{std::move(*draft), std::move(request.clips), request.found, std::move(request.channels)};
}

}  // namespace nms::compiler
