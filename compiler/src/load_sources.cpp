#include "load_sources.h"

#include <algorithm>
#include <deque>
#include <string>

#include <fmt/format.h>

#include <nms/compiler/diagnostic_kinds.h>
#include <nms/lang/parse.h>

#include "utf8.h"

namespace nms::compiler {
namespace {

using lang::NodeKind;
using lang::NodeRef;

constexpr const char* kPrelude = "prelude.nms";
/// Files in use at once. Each knows its way to every other.
constexpr std::size_t kMaxFiles = 2'000;

std::uint32_t find_loaded(const std::vector<LoadedFile>& files, const lang::Source& source) {
  for (std::uint32_t i = 0; i < files.size(); ++i) {
    const lang::Source& other = files[i].tree->source();
    if (other.path() == source.path() || (files[i].root && other.text() == source.text())) return i;
  }
  return kUnreachable;
}

/// A file's tree: one that was kept, or parsed anew, and then kept if nothing is wrong with it.
std::shared_ptr<const lang::Tree> tree_of(std::shared_ptr<const lang::Source> source, bool root, TreeCache* trees,
                                          lang::Diagnostics& diagnostics) {
  if (trees != nullptr)
    if (auto kept = trees->find(source)) return kept;
  const std::size_t said = diagnostics.all().size();
  std::shared_ptr<const lang::Tree> tree = lang::parse(std::move(source), diagnostics);
  const std::string_view text = tree->source().text();
  if (const std::size_t bad = first_not_utf8(text); bad != text.size()) {
    const auto begin = static_cast<std::uint32_t>(bad);
    diagnostics.report(tree->source_pointer(), {begin, begin + 1}, NotUtf8{static_cast<unsigned char>(text[bad])});
  }
  if (trees != nullptr && !root && diagnostics.all().size() == said) trees->keep(tree);
  return tree;
}

std::uint32_t load(std::vector<LoadedFile>& files, std::shared_ptr<const lang::Source> source, bool root,
                   lang::SourceProvider& provider, lang::Diagnostics& diagnostics, TreeCache* trees) {
  const std::uint32_t known = find_loaded(files, *source);
  if (known != kUnreachable) return known;
  const auto index = static_cast<std::uint32_t>(files.size());
  files.emplace_back();
  files[index].tree = tree_of(std::move(source), root, trees, diagnostics);
  files[index].root = root;
  const std::shared_ptr<const lang::Tree> tree = files[index].tree;
  for (const std::uint32_t declaration : tree->declarations()) {
    if (!tree->at(declaration).is(NodeKind::use)) continue;
    const NodeRef name = tree->at(declaration).child(NodeKind::string);
    if (!name || name.text().size() < 2) continue;
    const std::string path(name.text().substr(1, name.text().size() - 2));
    std::shared_ptr<const lang::Source> used = provider.find(path, tree->source().path());
    if (!used) {
      diagnostics.report(tree->source_pointer(), name.range(), UseNotFound{path});
      continue;
    }
    if (files.size() >= kMaxFiles && find_loaded(files, *used) == kUnreachable) {
      diagnostics.report(tree->source_pointer(), name.range(),
                         TooLarge{"the number of files in use", fmt::format("{}", kMaxFiles)});
      break;
    }
    const std::uint32_t other = load(files, std::move(used), false, provider, diagnostics, trees);
    files[index].uses.push_back(other);
    files[index].use_at.push_back(name);
  }
  return index;
}

/// A cycle of `use` is reported at the `use` that closes it.
void report_cycles(const std::vector<LoadedFile>& files, lang::Diagnostics& diagnostics) {
  enum class Mark : std::uint8_t { fresh, open, done };
  std::vector<Mark> marks(files.size(), Mark::fresh);
  struct Frame {
    std::uint32_t file;
    std::size_t next;
  };
  for (std::uint32_t start = 0; start < files.size(); ++start) {
    if (marks[start] != Mark::fresh) continue;
    std::vector<Frame> stack{{start, 0}};
    marks[start] = Mark::open;
    while (!stack.empty()) {
      Frame& top = stack.back();
      const LoadedFile& file = files[top.file];
      if (top.next == file.uses.size()) {
        marks[top.file] = Mark::done;
        stack.pop_back();
        continue;
      }
      const std::uint32_t used = file.uses[top.next++];
      if (marks[used] == Mark::open) {
        const NodeRef at = file.use_at[top.next - 1];
        diagnostics.report(file.tree->source_pointer(), at.range(), UseCycle{files[used].tree->source().path()});
      } else if (marks[used] == Mark::fresh) {
        marks[used] = Mark::open;
        stack.push_back({used, 0});
      }
    }
  }
}

void measure_distances(std::vector<LoadedFile>& files) {
  std::uint32_t prelude = 0;
  while (prelude < files.size() && !files[prelude].prelude) ++prelude;
  std::vector<std::uint32_t> made_of;
  if (prelude != files.size()) made_of.push_back(prelude);
  for (std::size_t i = 0; i < made_of.size(); ++i)
    for (const std::uint32_t used : files[made_of[i]].uses)
      if (std::find(made_of.begin(), made_of.end(), used) == made_of.end()) made_of.push_back(used);
  for (std::uint32_t start = 0; start < files.size(); ++start) {
    std::vector<std::uint32_t>& distance = files[start].distance;
    distance.assign(files.size(), kUnreachable);
    std::uint32_t rank = 0;
    const auto visit = [&](std::uint32_t from) {
      if (distance[from] != kUnreachable) return;
      distance[from] = rank++;
      std::deque<std::uint32_t> queue{from};
      while (!queue.empty()) {
        const std::uint32_t at = queue.front();
        queue.pop_front();
        for (const std::uint32_t used : files[at].uses) {
          if (distance[used] != kUnreachable) continue;
          distance[used] = rank++;
          queue.push_back(used);
        }
      }
    };
    visit(start);
    // Every file sees the prelude, after all that it uses itself; those that the prelude is made of do not.
    if (prelude != files.size() && std::find(made_of.begin(), made_of.end(), start) == made_of.end()) visit(prelude);
  }
}

void add_prelude(std::vector<LoadedFile>& files, lang::SourceProvider& provider, lang::Diagnostics& diagnostics,
                 TreeCache* trees) {
  std::shared_ptr<const lang::Source> source = provider.find(kPrelude, "");
  if (source) files[load(files, std::move(source), false, provider, diagnostics, trees)].prelude = true;
}

}  // namespace

std::vector<LoadedFile> load_sources(const std::vector<std::shared_ptr<const lang::Source>>& roots,
                                     lang::SourceProvider& provider, lang::Diagnostics& diagnostics, TreeCache* trees) {
  std::vector<LoadedFile> files;
  for (const auto& root : roots) {
    const std::uint32_t index = load(files, root, true, provider, diagnostics, trees);
    files[index].root = true;
  }
  report_cycles(files, diagnostics);
  add_prelude(files, provider, diagnostics, trees);
  measure_distances(files);
  return files;
}

bool load_named(std::vector<LoadedFile>& files, std::uint32_t from, const std::string& name,
                lang::SourceProvider& provider, lang::Diagnostics& diagnostics, TreeCache* trees) {
  std::shared_ptr<const lang::Source> source = provider.find(name, "");
  if (!source) return false;
  const std::uint32_t index = load(files, std::move(source), false, provider, diagnostics, trees);
  auto& uses = files[from].uses;
  if (std::find(uses.begin(), uses.end(), index) == uses.end()) {
    uses.push_back(index);
    files[from].use_at.emplace_back();
  }
  measure_distances(files);
  return true;
}

}  // namespace nms::compiler
