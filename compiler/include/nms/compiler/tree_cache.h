#pragma once

#include <memory>
#include <unordered_map>
#include <utility>

#include <nms/lang/source.h>
#include <nms/lang/tree.h>

namespace nms::compiler {

/// Trees of library files, kept from one compilation to the next: whoever compiles many utterances over one lexicon
/// parses it once. `CompileOptions::trees` takes it; results are the same with and without.
///
/// A file is known by its Source object, so the provider has to give the same one each time, and a file that changed is
/// a new one. Only files that are used are kept, not roots, and only those without diagnostics. Grows with what is
/// used; not for several threads at once.
class TreeCache {
 public:
  [[nodiscard]] std::shared_ptr<const lang::Tree> find(const std::shared_ptr<const lang::Source>& source) const {
    const auto it = trees_.find(source.get());
    return it == trees_.end() ? nullptr : it->second;
  }
  void keep(std::shared_ptr<const lang::Tree> tree) {
    const lang::Source* source = tree->source_pointer().get();
    trees_.emplace(source, std::move(tree));  // the tree holds its source: its address stays its own
  }

 private:
  std::unordered_map<const lang::Source*, std::shared_ptr<const lang::Tree>> trees_;
};

}  // namespace nms::compiler
