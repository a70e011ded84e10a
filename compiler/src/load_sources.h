#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <nms/compiler/tree_cache.h>
#include <nms/lang/diagnostic.h>
#include <nms/lang/source.h>
#include <nms/lang/tree.h>

namespace nms::compiler {

/// One file in use, and how far every other file is from it by `use`.
struct LoadedFile {
  std::shared_ptr<const lang::Tree> tree;
  bool root = false;                  ///< named by the caller; its clips are made
  bool prelude = false;               ///< the file that every file sees without using it
  std::vector<std::uint32_t> uses;    ///< files it uses, in order
  std::vector<lang::NodeRef> use_at;  ///< for each of them where it says so; none for a lexicon that it names
  /// For each file its rank from here, or kUnreachable: 0 this one, then those it uses, then theirs, each in order;
  /// what only the prelude uses comes after all of them.
  std::vector<std::uint32_t> distance;
};

inline constexpr std::uint32_t kUnreachable = 0xFFFFFFFFU;

/// All files that the roots use, each once, roots first. Only what is used is read.
/// A root whose text is the same as a used file's is that file.
[[nodiscard]] std::vector<LoadedFile> load_sources(const std::vector<std::shared_ptr<const lang::Source>>& roots,
                                                   lang::SourceProvider& provider, lang::Diagnostics& diagnostics,
                                                   TreeCache* trees = nullptr);

/// Adds one file (and what it uses) that a construct names without `use`: `in asl`. False: there is none.
bool load_named(std::vector<LoadedFile>& files, std::uint32_t from, const std::string& name,
                lang::SourceProvider& provider, lang::Diagnostics& diagnostics, TreeCache* trees = nullptr);

}  // namespace nms::compiler
