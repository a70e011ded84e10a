#include <nms/compiler/compile.h>

#include <algorithm>
#include <deque>
#include <string>
#include <string_view>

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
#include "lower_utterance.h"
#include "merge.h"
#include "movement.h"
#include "name_index.h"
#include "plain_movement.h"
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
  const NodeRef params = evaluator.declarations().params(d);
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
  const auto before = [](const Declaration* a, const Declaration* b) {
    return a->file != b->file ? a->file < b->file : a->node.index() < b->node.index();
  };
  if (!std::is_sorted(out.begin(), out.end(), before)) std::stable_sort(out.begin(), out.end(), before);
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

/// Names of clips. They stand in files and players: one name, one clip.
class ClipNames {
 public:
  ClipNames(const std::vector<const Declaration*>& sources, const Declarations& declarations)
      : sources_(sources), declarations_(declarations), taken_(declarations.movements.size()) {}

  /// A name that comes from the source of that number. False: there is one of that name.
  bool add(std::string_view name, std::uint32_t source) {
    const Declaration& d = *sources_[source];
    // The names of movements are in an index already: one that is alone needs no place in another.
    if (const std::uint32_t movement = declarations_.movement_number(d);
        movement != kUnreachable && !declarations_.has_namesake(movement)) {
      if (find(name) != NameIndex::kNothing) return false;
      taken_[movement] = true;
      return true;
    }
    if (has(name)) return false;
    if (name == d.name) {
      index_.insert(name, source);
    } else {
      index_.insert(name, static_cast<std::uint32_t>(sources_.size() + made_.size()));
      made_.emplace_back(name);
    }
    return true;
  }
  [[nodiscard]] bool has(std::string_view name) const {
    const std::uint32_t movement = declarations_.only_movement(name);
    return (movement != kUnreachable && taken_[movement]) || find(name) != NameIndex::kNothing;
  }

 private:
  [[nodiscard]] std::uint32_t find(std::string_view name) const {
    return index_.find(name, [&](std::uint32_t i) {
      return i < sources_.size() ? sources_[i]->name == name : made_[i - sources_.size()] == name;
    });
  }

  const std::vector<const Declaration*>& sources_;
  const Declarations& declarations_;
  NameIndex index_;
  std::vector<bool> taken_;       ///< of movements that no other has the name of
  std::deque<std::string> made_;  ///< names that stand in no source
};

std::size_t count_knots(const std::vector<MergedCurve>& curves) {
  std::size_t knots = 0;
  for (const MergedCurve& m : curves) knots += m.curve.knots.size();
  return knots;
}

/// The knots of all clips, for their limit. Of an expression that nobody wants drawn the most there can be is enough,
/// as long as all together stay below the limit; past it they are drawn after all.
class KnotCount {
 public:
  KnotCount(const Emitter& emitter, Evaluator& evaluator) : emitter_(emitter), evaluator_(evaluator) {}

  void add_at_most(const Declaration& expression, std::size_t knots) {
    estimated_.push_back(&expression);
    estimate_ += knots;
  }
  [[nodiscard]] bool past_limit() {
    if (emitter_.draft.knots.size() + counted_ + estimate_ <= kMaxKnots) return false;
    for (const Declaration* d : estimated_)
      if (const auto clip = lower_expression(*d, evaluator_))
        counted_ += count_knots(merge(*clip, evaluator_.channels()));
    estimated_.clear();
    estimate_ = 0;
    return emitter_.draft.knots.size() + counted_ > kMaxKnots;
  }

 private:
  const Emitter& emitter_;
  Evaluator& evaluator_;
  std::size_t counted_ = 0;  ///< of what was drawn to be counted
  std::size_t estimate_ = 0;
  std::vector<const Declaration*> estimated_;
};

/// Makes the clips of all sources, or finds out what is wrong with them.
class ClipMaking {
 public:
  ClipMaking(std::vector<const Declaration*>&& sources, Evaluator& evaluator, Discourses& discourses, Emitter& emitter,
             ExplainRequest* explained)
      : sources_(std::move(sources)),
        evaluator_(evaluator),
        discourses_(discourses),
        emitter_(emitter),
        explained_(explained),
        names_(sources_, evaluator.declarations()),
        knots_(emitter, evaluator) {}

  void run() {
    for (std::uint32_t i = 0; i < sources_.size(); ++i) {
      const Declaration& d = *sources_[i];
      if (const auto most = evaluator_.most_knots(d)) {
        if (*most == 0) continue;
        if (take_name(i, d.name)) knots_.add_at_most(d, *most);
      } else {
        for (ClipDraft& clip : lower(d, evaluator_, discourses_)) add(i, clip);
      }
      if (knots_.past_limit()) {
        evaluator_.report({}, d.node, TooLarge{"the program", fmt::format("{} knots", kMaxKnots)});
        return;
      }
    }
  }

 private:
  bool take_name(std::uint32_t source, std::string_view name) {
    if (names_.add(name, source)) return true;
    evaluator_.report({}, sources_[source]->node.child(NodeKind::name), DuplicateName{"clip", std::string(name)});
    return false;
  }

  void add(std::uint32_t source, ClipDraft& clip) {
    // An entry gives way and takes its lexicon's name along.
    if (clip.kind == program::ClipKind::entry && names_.has(clip.name))
      clip.name = fmt::format("{}_{}", evaluator_.declarations().lexicons[sources_[source]->lexicon].declaration.name,
                              clip.name);
    if (!take_name(source, clip.name)) return;
    const Channels& channels = evaluator_.channels();
    if (explained_ != nullptr) explained_->clips.push_back(clip.name);
    std::vector<MergedCurve> curves;
    if (explained_ != nullptr && clip.name == explained_->options.clip) {
      ExplanationRecorder recorder(clip, channels, explained_->options.time_ns);
      curves = merge(clip, channels, &recorder);
      explained_->found = true;
      explained_->channels = recorder.take();
    } else {
      curves = merge(clip, channels);
    }
    if (const auto too_large = emitter_.clip(clip, curves, channels))
      evaluator_.report({}, sources_[source]->node, *too_large);
  }

  const std::vector<const Declaration*> sources_;
  Evaluator& evaluator_;
  Discourses& discourses_;
  Emitter& emitter_;
  ExplainRequest* explained_;
  ClipNames names_;
  KnotCount knots_;
};

/// Nothing: an error was reported, or no program was asked for.
std::optional<program::Draft> compile_all(const std::vector<std::shared_ptr<const lang::Source>>& roots,
                                          lang::SourceProvider& provider, lang::Diagnostics& diagnostics,
                                          const CompileOptions& options, Product product, TestRequest* request,
                                          ExplainRequest* explained = nullptr) {
  OutsideTimes outside(options.times, diagnostics);
  std::vector<LoadedFile> files = load_sources(roots, provider, diagnostics, options.trees);
  const Declarations declarations = Declarations::collect(files, provider, diagnostics, options.trees);
  const Channels channels = build_channels(files, declarations, diagnostics);
  Evaluator evaluator(files, declarations, channels, outside, diagnostics, product);
  Discourses discourses(evaluator);
  Emitter emitter;
  emitter.channels(channels);
  build_rig(options.face, evaluator, emitter);

  PlainMovements plain(evaluator);
  for (std::uint32_t i = 0; i < declarations.movements.size(); ++i) {
    const Declaration& d = declarations.movements[i];
    if (files[d.file].root && !plain.work_out(i)) check_movement(d, evaluator);
  }
  for (const Declaration& d : declarations.degrees)
    if (files[d.file].root) evaluator.degree_of(d);
  for (const Declaration& d : declarations.ambients)
    if (files[d.file].root) check_ambient(d, evaluator);
  check_combinations(evaluator);
  ClipMaking(clip_sources(files, declarations, options.lexicon), evaluator, discourses, emitter, explained).run();
  visit_tests(files, evaluator, discourses, request);
  if (diagnostics.error_count() != 0) return std::nullopt;
  // Tests are run file by file, and one table may serve them all.
  if (request == nullptr) outside.report_unused(diagnostics);
  if (product == Product::diagnostics) return std::nullopt;
  return std::move(emitter.draft);
}

}  // namespace

std::optional<program::Draft> compile(const std::vector<std::shared_ptr<const lang::Source>>& roots,
                                      lang::SourceProvider& provider, lang::Diagnostics& diagnostics,
                                      const CompileOptions& options) {
  return compile_all(roots, provider, diagnostics, options, Product::program, nullptr);
}

void check(const std::vector<std::shared_ptr<const lang::Source>>& roots, lang::SourceProvider& provider,
           lang::Diagnostics& diagnostics, const CompileOptions& options) {
  static_cast<void>(compile_all(roots, provider, diagnostics, options, Product::diagnostics, nullptr));
}

std::vector<TestResult> run_tests(const std::vector<std::shared_ptr<const lang::Source>>& roots,
                                  lang::SourceProvider& provider, lang::Diagnostics& diagnostics,
                                  const TestOptions& options) {
  TestRequest request{options.filter, {}};
  CompileOptions compile_options;
  compile_options.times = options.times;
  if (!compile_all(roots, provider, diagnostics, compile_options, Product::program, &request)) return {};
  return std::move(request.results);
}

std::optional<Explanation> explain(const std::vector<std::shared_ptr<const lang::Source>>& roots,
                                   lang::SourceProvider& provider, lang::Diagnostics& diagnostics,
                                   const ExplainOptions& options) {
  ExplainRequest request{options, {}, false, {}};
  CompileOptions compile_options;
  compile_options.times = options.times;
  auto draft = compile_all(roots, provider, diagnostics, compile_options, Product::program, nullptr, &request);
  if (!draft) return std::nullopt;
  return Explanation{std::move(*draft), std::move(request.clips), request.found, std::move(request.channels)};
}

}  // namespace nms::compiler
