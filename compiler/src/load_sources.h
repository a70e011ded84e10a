#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <nms/lang/diagnostic.h>
#include <nms/lang/source.h>
#include <nms/lang/tree.h>

namespace nms::compiler {

/// One file in use, and how far every other file is from it by `use`.
struct LoadedFile {
  std::shared_ptr<const lang::Tree> tree;
  bool root = false;                    ///< named by the caller; its clips are made
  std::vector<std::uint32_t> uses;      ///< files it uses, in order; the prelude last
  std::vector<std::uint32_t> distance;  ///< for each file: steps of `use` from here, or kUnreachable
};

inline constexpr std::uint32_t kUnreachable = 0xFFFFFFFFU;

/// All files that the roots use, each once, roots first. Only what is used is read.
/// A root whose text is the same as a used file's is that file.
[[nodiscard]] std::vector<LoadedFile> load_sources(const std::vector<std::shared_ptr<const lang::Source>>& roots,
                                                   lang::SourceProvider& provider, lang::Diagnostics& diagnostics);

/// Adds one file (and what it uses) that a construct names without `use`: `in asl`. False: there is none.
bool load_named(std::vector<LoadedFile>& files, std::uint32_t from, const std::string& name, lang::SourceProvider& provider,
                lang::Diagnostics& diagnostics);

}  // namespace nms::compiler
