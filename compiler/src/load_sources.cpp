#include "load_sources.h"

#include <algorithm>
#include <deque>
#include <string>

#include <nms/compiler/diagnostic_kinds.h>
#include <nms/lang/parse.h>

namespace nms::compiler {
namespace {

using lang::NodeKind;
using lang::NodeRef;

constexpr const char* kPrelude = "prelude.nms";

std::uint32_t find_loaded(const std::vector<LoadedFile>& files, const lang::Source& source) {
  for (std::uint32_t i = 0; i < files.size(); ++i) {
    const lang::Source& other = files[i].tree->source();
    if (other.path() == source.path() || (files[i].root && other.text() == source.text())) return i;
  }
  return kUnreachable;
}

std::uint32_t load(std::vector<LoadedFile>& files, std::shared_ptr<const lang::Source> source, bool root,
                   lang::SourceProvider& provider, lang::Diagnostics& diagnostics) {
  const std::uint32_t known = find_loaded(files, *source);
  if (known != kUnreachable) return known;
  const auto index = static_cast<std::uint32_t>(files.size());
  files.push_back({lang::parse(std::move(source), diagnostics), root, {}, {}});
  const std::shared_ptr<const lang::Tree> tree = files[index].tree;
  for (NodeRef declaration : tree->root().children()) {
    if (!declaration.is(NodeKind::use)) continue;
    const NodeRef name = declaration.child(NodeKind::string);
    if (!name || name.text().size() < 2) continue;
    const std::string path(name.text().substr(1, name.text().size() - 2));
    std::shared_ptr<const lang::Source> used = provider.find(path, tree->source().path());
    if (!used) {
      diagnostics.report(tree->source_pointer(), name.range(), UseNotFound{path});
      continue;
    }
    const std::uint32_t other = load(files, std::move(used), false, provider, diagnostics);
    files[index].uses.push_back(other);
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
        for (NodeRef d : file.tree->root().children()) {
          if (!d.is(NodeKind::use)) continue;
          const NodeRef name = d.child(NodeKind::string);
          const std::string& path = files[used].tree->source().path();
          const std::string_view wanted = name ? name.text().substr(1, name.text().size() - 2) : std::string_view();
          if (path.size() >= wanted.size() && path.ends_with(wanted)) {
            diagnostics.report(file.tree->source_pointer(), name.range(), UseCycle{path});
            break;
          }
        }
      } else if (marks[used] == Mark::fresh) {
        marks[used] = Mark::open;
        stack.push_back({used, 0});
      }
    }
  }
}

void measure_distances(std::vector<LoadedFile>& files) {
  for (std::uint32_t start = 0; start < files.size(); ++start) {
    std::vector<std::uint32_t>& distance = files[start].distance;
    distance.assign(files.size(), kUnreachable);
    distance[start] = 0;
    std::deque<std::uint32_t> queue{start};
    while (!queue.empty()) {
      const std::uint32_t at = queue.front();
      queue.pop_front();
      for (const std::uint32_t used : files[at].uses) {
        if (distance[used] != kUnreachable) continue;
        distance[used] = distance[at] + 1;
        queue.push_back(used);
      }
    }
  }
}

/// Every file sees the prelude, after all that it uses itself. Files that the prelude is made of do not use it.
void add_prelude(std::vector<LoadedFile>& files, lang::SourceProvider& provider, lang::Diagnostics& diagnostics) {
  std::shared_ptr<const lang::Source> source = provider.find(kPrelude, "");
  if (!source) return;
  const std::uint32_t prelude = load(files, std::move(source), false, provider, diagnostics);
  measure_distances(files);
  for (std::uint32_t i = 0; i < files.size(); ++i)
    if (files[prelude].distance[i] == kUnreachable) files[i].uses.push_back(prelude);
}

}  // namespace

std::vector<LoadedFile> load_sources(const std::vector<std::shared_ptr<const lang::Source>>& roots,
                                     lang::SourceProvider& provider, lang::Diagnostics& diagnostics) {
  std::vector<LoadedFile> files;
  for (const auto& root : roots) {
    const std::uint32_t index = load(files, root, true, provider, diagnostics);
    files[index].root = true;
  }
  report_cycles(files, diagnostics);
  add_prelude(files, provider, diagnostics);
  measure_distances(files);
  return files;
}

bool load_named(std::vector<LoadedFile>& files, std::uint32_t from, const std::string& name, lang::SourceProvider& provider,
                lang::Diagnostics& diagnostics) {
  std::shared_ptr<const lang::Source> source = provider.find(name, "");
  if (!source) return false;
  const std::uint32_t index = load(files, std::move(source), false, provider, diagnostics);
  auto& uses = files[from].uses;
  if (std::find(uses.begin(), uses.end(), index) == uses.end()) uses.push_back(index);
  add_prelude(files, provider, diagnostics);
  measure_distances(files);
  return true;
}

}  // namespace nms::compiler
