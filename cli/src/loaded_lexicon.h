#pragma once

#include <memory>
#include <optional>
#include <string>

#include <nms/compiler/lexicon_index.h>
#include <nms/lang/diagnostic.h>
#include <nms/lang/source.h>
#include <nms/program/program.h>

#include "commands.h"
#include "source_files.h"

namespace nms::cli {

/// A lexicon by itself: what its entries say, and what they compile to.
struct LoadedLexicon {
  std::shared_ptr<const lang::Source> root;  ///< the file that declares it
  compiler::LexiconRecord lexicon;
  compiler::FaceRecord face;
  program::Image image;  ///< a clip for each entry, inherited ones included, and the face's rig description
};

/// @param name  a lexicon of the standard library, or the path of a .nms file that declares one
/// @param face  the face whose rig description is wanted
/// Nothing: `diagnostics` says why.
[[nodiscard]] std::optional<LoadedLexicon> load_lexicon(const GlobalOptions& global, const std::string& name,
                                                        const std::string& face, SourceFiles& sources,
                                                        lang::Diagnostics& diagnostics);

}  // namespace nms::cli
