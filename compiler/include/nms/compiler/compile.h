#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <nms/lang/diagnostic.h>
#include <nms/lang/source.h>
#include <nms/program/program.h>

#include <nms/compiler/time_table.h>
#include <nms/compiler/tree_cache.h>

namespace nms::compiler {

struct CompileOptions {
  /// The face whose landmarks and muscles go into the rig description; empty: the first one declared, if any.
  std::string face;
  /// A lexicon: all its entries, inherited ones included, become clips, and nothing else does. Empty: what the roots
  /// declare. One that is not there makes no clips.
  std::string lexicon = {};
  /// Times from outside, for marks and for signs.
  std::vector<TimeTable> times = {};
  /// Where trees of library files are kept from one compilation to the next; may be null.
  TreeCache* trees = nullptr;
};

/// Compiles sources to one AU curve program with its rig description.
///
/// @param roots     the files whose expressions, timelines, entries and utterances become clips, in order
/// @param provider  finds what they `use`, the prelude and the lexicons they name; asked for nothing else
/// @returns nothing if an error was reported. Warnings do not stop it. Several independent errors are reported in one
/// run. Deterministic: the same sources give the same bytes on every machine. No global state.
[[nodiscard]] std::optional<program::Draft> compile(const std::vector<std::shared_ptr<const lang::Source>>& roots,
                                                    lang::SourceProvider& provider, lang::Diagnostics& diagnostics,
                                                    const CompileOptions& options = {});

/// Reports exactly what `compile` would report, and makes no program: what cannot be wrong is not drawn.
/// Parameters are those of `compile`.
void check(const std::vector<std::shared_ptr<const lang::Source>>& roots, lang::SourceProvider& provider,
           lang::Diagnostics& diagnostics, const CompileOptions& options = {});

}  // namespace nms::compiler
