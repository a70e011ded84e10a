#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <set>
#include <string_view>

#include <fmt/format.h>

#include <nms/lang/parse.h>

#include "commands.h"
#include "differences.h"
#include "loading.h"
#include "report.h"

namespace nms::cli {
namespace {

namespace fs = std::filesystem;

/// One side of the comparison: its program, and the labels of its entries.
struct Version {
  std::optional<LoadedProgram> image;
  std::map<std::string, std::set<std::string>> labels;  ///< by entry; empty for a compiled program
  bool has_labels = false;
};

/// A file; all sources of a folder and those below it, by name; or a lexicon of the standard library.
std::vector<std::string> files_of(const std::string& argument, lang::Diagnostics& diagnostics) {
  std::error_code error;
  if (!fs::is_directory(argument, error)) return {argument};
  std::vector<std::string> files;
  for (auto it = fs::recursive_directory_iterator(argument, error); !error && it != fs::recursive_directory_iterator();
       it.increment(error))
    if (it->path().extension() == ".nms" && it->is_regular_file(error)) files.push_back(it->path().string());
  std::sort(files.begin(), files.end());
  if (files.empty())
    add_failure(diagnostics, {"cannot_read", argument, "there are no .nms files in this folder", "name another"});
  return files;
}

void collect_labels(lang::NodeRef node, std::map<std::string, std::set<std::string>>& labels) {
  for (lang::NodeRef child : node.children()) {
    if (child.is(lang::NodeKind::lexicon)) collect_labels(child, labels);
    if (!child.is(lang::NodeKind::entry)) continue;
    std::set<std::string>& own = labels[std::string(child.child(lang::NodeKind::name).text())];
    for (lang::NodeRef p : child.children()) {
      if (!p.is(lang::NodeKind::property) || p.at(0).text() != "label") continue;
      for (lang::NodeRef value : p.children())
        if (value.is(lang::NodeKind::string) && value.text().size() >= 2)
          own.insert(std::string(value.text().substr(1, value.text().size() - 2)));
    }
  }
}

Version load(const GlobalOptions& global, const std::string& argument, SourceFiles& sources,
             lang::Diagnostics& diagnostics) {
  Version out;
  const std::vector<std::string> files = files_of(argument, diagnostics);
  if (diagnostics.error_count() != 0) return out;
  out.image = load_program(global, files, "", sources, diagnostics);
  if (!out.image) return out;
  for (const std::string& file : files) {
    const auto source = file.ends_with(".auc") ? nullptr : sources.open(file).value_or(nullptr);
    if (source == nullptr) continue;
    lang::Diagnostics parsed;  // it has been compiled: there is nothing to report
    collect_labels(lang::parse(source, parsed)->root(), out.labels);
    out.has_labels = true;
  }
  return out;
}

std::vector<LabelChange> label_changes(const Version& before, const Version& after) {
  std::vector<LabelChange> out;
  if (!before.has_labels || !after.has_labels) return out;
  for (const auto& [entry, labels] : after.labels) {
    const auto old = before.labels.find(entry);
    if (old == before.labels.end()) continue;  // the entry is new: that has been said
    for (const std::string& l : old->second)
      if (labels.count(l) == 0) out.push_back({entry, l, false});
    for (const std::string& l : labels)
      if (old->second.count(l) == 0) out.push_back({entry, l, true});
  }
  return out;
}

}  // namespace

int diff(const GlobalOptions& global, const DiffOptions& options) {
  lang::Diagnostics diagnostics;
  AllDifferences all;
  {
    // Each side has a standard library of its own, should the two be different folders.
    SourceFiles old_sources(options.old_stdlib.empty() ? global.stdlib : options.old_stdlib);
    SourceFiles sources(global.stdlib);
    const Version before = load(global, options.before, old_sources, diagnostics);
    const Version after = load(global, options.after, sources, diagnostics);
    if (before.image && after.image) {
      all.programs = program::compare(before.image->program(), after.image->program());
      all.labels = label_changes(before, after);
    }
  }
  if (finish(global, diagnostics) != kSuccess) return kUsage;
  const std::string out = options.json ? differences_json(all) : differences_text(all);
  std::fwrite(out.data(), 1, out.size(), stdout);
  return all.empty() ? kSuccess : kErrors;
}

}  // namespace nms::cli
