#include <nms/compiler/mutation.h>

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>

#include <nms/compiler/diagnostic_kinds.h>

#include "removals.h"
#include "test_run.h"

namespace nms::compiler {
namespace {

using lang::NodeKind;
using lang::NodeRef;
using Sources = std::shared_ptr<const lang::Source>;

/// Gives one file another text.
class ReplacingProvider : public lang::SourceProvider {
 public:
  ReplacingProvider(lang::SourceProvider& inner, Sources replaced) : inner_(inner), replaced_(std::move(replaced)) {}
  Sources find(std::string_view name, std::string_view from) override {
    Sources found = inner_.find(name, from);
    return found != nullptr && found->path() == replaced_->path() ? replaced_ : found;
  }

 private:
  lang::SourceProvider& inner_;
  Sources replaced_;
};

/// A root as far as its tests need it: names, channels, and whatever a test asks for. No clip is made that none plays.
struct Compilation {
  Compilation(const Sources& root, lang::SourceProvider& provider, const std::vector<TimeTable>& times,
              lang::Diagnostics& diagnostics, TreeCache& trees)
      : outside(times, diagnostics),
        files(load_sources({root}, provider, diagnostics, &trees)),
        declarations(Declarations::collect(files, provider, diagnostics, &trees)),
        channels(build_channels(files, declarations, diagnostics)),
        evaluator(files, declarations, channels, outside, diagnostics),
        discourses(evaluator),
        tests(evaluator, discourses) {}

  OutsideTimes outside;
  std::vector<LoadedFile> files;
  Declarations declarations;
  Channels channels;
  Evaluator evaluator;
  Discourses discourses;
  TestRun tests;
};

/// An entry by the place where it is written.
using EntryPlace = std::pair<std::string, std::uint32_t>;

EntryPlace place_of(const Declaration& entry) { return {entry.node.tree().source().path(), entry.node.range().begin}; }

/// Which of a root's tests play an entry: their numbers among all tests that are collected.
struct Players {
  std::size_t root = 0;
  std::vector<std::size_t> tests;
};

/// Text that all removals together may parse: twenty times what the library takes. Some 20 s.
constexpr std::uint64_t kMaxBytes = 2'000'000'000;

class Mutation {
 public:
  Mutation(const std::vector<Sources>& roots, lang::SourceProvider& provider, lang::Diagnostics& diagnostics,
           const MutationOptions& options)
      : roots_(roots), provider_(provider), diagnostics_(diagnostics), options_(options) {}

  MutationResult run() {
    for (std::size_t r = 0; r < roots_.size(); ++r) play_all(r);
    if (diagnostics_.error_count() != 0) return {};
    if (!result_.failing.empty()) return std::move(result_);
    if (too_large()) return {};
    for (const auto& [place, entry] : entries_) take_apart(place, entry);
    return std::move(result_);
  }

 private:
  struct Entry {
    std::shared_ptr<const lang::Tree> tree;
    std::uint32_t node = 0;
    std::string lexicon;
    std::vector<Players> players;
  };

  /// Each removal parses its file anew: work grows as the square of a file. Reported once.
  bool too_large() {
    std::uint64_t bytes = 0;
    for (const auto& [place, entry] : entries_) {
      const NodeRef node(entry.tree.get(), entry.node);
      bytes += removable_parts(node).size() * std::uint64_t{entry.tree->source().text().size()};
      if (bytes <= kMaxBytes) continue;
      diagnostics_.report(entry.tree->source_pointer(), node.child(NodeKind::name).range(),
                          TooLarge{"what would be read anew, once for each part that is taken out",
                                   fmt::format("{} GB", kMaxBytes / 1'000'000'000)});
      return true;
    }
    return false;
  }

  /// Runs the tests with everything in place, and notes what each plays.
  void play_all(std::size_t r) {
    Compilation c(roots_[r], provider_, options_.times, diagnostics_, trees_);
    if (diagnostics_.error_count() != 0) return;
    const auto root_file = static_cast<std::uint32_t>(
        std::find_if(c.files.begin(), c.files.end(), [](const LoadedFile& f) { return f.root; }) - c.files.begin());
    // Its own tree is kept too: only one file is parsed anew for a removal.
    trees_.keep(c.files[root_file].tree);
    const std::vector<std::uint32_t>& uses = c.files[root_file].uses;
    for (const Declaration& e : c.declarations.entries) {
      if (e.node.has(lang::kFlagError)) continue;
      if (e.file != root_file && std::find(uses.begin(), uses.end(), e.file) == uses.end()) continue;
      Entry entry{c.files[e.file].tree, e.node.index(), lexicon_of(e, c.declarations), {}};
      entries_.try_emplace(place_of(e), std::move(entry));
    }
    for (std::size_t t = 0; t < c.declarations.tests.size(); ++t) {
      if (c.declarations.tests[t].file != root_file) continue;
      TestResult result = c.tests.run(c.declarations.tests[t]);
      for (const PlayedEntry& e : result.plays) {
        std::vector<Players>& players = players_[{e.file, e.begin}];
        if (players.empty() || players.back().root != r) players.push_back({r, {}});
        players.back().tests.push_back(t);
      }
      if (!result.passed()) result_.failing.push_back(std::move(result));
    }
  }

  /// The lexicon an entry is written in: others may take it over.
  static std::string lexicon_of(const Declaration& entry, const Declarations& all) {
    for (const LexiconDeclaration& l : all.lexicons) {
      const Declaration& d = l.declaration;
      if (d.file == entry.file && d.node.range().begin <= entry.node.range().begin &&
          entry.node.range().end <= d.node.range().end)
        return std::string(d.name);
    }
    return {};
  }

  void take_apart(const EntryPlace& place, const Entry& entry) {
    const NodeRef node(entry.tree.get(), entry.node);
    const std::vector<Players>& players = players_[place];
    std::uint32_t tests = 0;
    for (const Players& p : players) tests += static_cast<std::uint32_t>(p.tests.size());
    for (const RemovablePart& part : removable_parts(node)) {
      Removal removal{entry.tree->source_pointer(),
                      part.range,
                      entry.lexicon,
                      std::string(node.child(NodeKind::name).text()),
                      part.part,
                      Removal::Fate::untried,
                      tests};
      if (result_.removals.size() % std::max(options_.shares, 1U) == options_.share)
        removal.fate = players.empty() ? Removal::Fate::untested : fate_without(part, *entry.tree, players);
      result_.removals.push_back(std::move(removal));
    }
  }

  Removal::Fate fate_without(const RemovablePart& part, const lang::Tree& tree, const std::vector<Players>& players) {
    const lang::Source& whole = tree.source();
    std::string text(whole.text());
    text.replace(part.cut.begin, part.cut.end - part.cut.begin, part.instead.empty() ? " " : part.instead);
    const Sources without = std::make_shared<const lang::Source>(whole.path(), std::move(text));
    ReplacingProvider provider(provider_, without);
    TreeCache trees = trees_;  // what it keeps of this removal goes with it
    for (const Players& p : players) {
      lang::Diagnostics diagnostics;
      const Sources& root = roots_[p.root]->path() == whole.path() ? without : roots_[p.root];
      Compilation c(root, provider, options_.times, diagnostics, trees);
      for (const std::size_t t : p.tests) {
        if (diagnostics.error_count() != 0) return Removal::Fate::impossible;
        const TestResult result = c.tests.run(c.declarations.tests[t]);
        if (diagnostics.error_count() != 0) return Removal::Fate::impossible;
        if (!result.passed()) return Removal::Fate::noticed;
      }
    }
    return Removal::Fate::unnoticed;
  }

  const std::vector<Sources>& roots_;
  lang::SourceProvider& provider_;
  lang::Diagnostics& diagnostics_;
  const MutationOptions& options_;
  TreeCache trees_;
  std::map<EntryPlace, Entry> entries_;
  std::map<EntryPlace, std::vector<Players>> players_;
  MutationResult result_;
};

}  // namespace

MutationResult mutate(const std::vector<std::shared_ptr<const lang::Source>>& roots, lang::SourceProvider& provider,
                      lang::Diagnostics& diagnostics, const MutationOptions& options) {
  return Mutation(roots, provider, diagnostics, options).run();
}

std::string_view name_of(Removal::Part part) {
  switch (part) {
    case Removal::Part::component:
      return "component";
    case Removal::Part::term:
      return "term";
    case Removal::Part::step:
      return "step";
    case Removal::Part::phase:
      return "phase";
    case Removal::Part::profile:
      return "profile";
    case Removal::Part::span:
      return "span";
  }
  return {};
}

lang::Description RemovalUnnoticed::describe() const {
  const bool untested = removal.fate == Removal::Fate::untested;
  const std::string_view part = name_of(removal.part);
  lang::Description d{untested ? fmt::format("no test plays the entry {} of {}, of which this {} is a part",
                                             removal.entry, removal.lexicon, part)
                               : fmt::format("no test notices when this {} of the entry {} of {} is gone", part,
                                             removal.entry, removal.lexicon),
                      {},
                      {}};
  d.fields = {{"lexicon", removal.lexicon},
              {"entry", removal.entry},
              {"part", std::string(part)},
              {"tests", std::to_string(removal.tests)}};
  d.helps.push_back(untested ? fmt::format("write one: test \"NAME\" {{ play {}; expect ... }}", removal.entry)
                             : "expect what it does: a value at a time when it makes a difference; what makes none "
                               "can go");
  return d;
}

}  // namespace nms::compiler
