#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include <nms/lang/diagnostic.h>
#include <nms/lang/tree.h>

#include "load_sources.h"

namespace nms::compiler {

/// A named declaration of any file in use.
struct Declaration {
  lang::NodeRef node;
  std::string_view name;
  std::uint32_t file = 0;
  std::uint32_t lexicon = 0xFFFFFFFFU;  ///< of an entry: index into Declarations::lexicons
};

/// A lexicon with its own entries; those it extends are looked up through `extends`.
struct LexiconDeclaration {
  Declaration declaration;
  std::uint32_t extends = 0xFFFFFFFFU;
  std::vector<std::uint32_t> entries;                           ///< indices into Declarations::entries, in order
  std::unordered_map<std::string_view, std::uint32_t> by_name;  ///< names, labels and aliases, without quotes
};

/// What names stand for, over all files in use. One namespace for each kind of thing.
class Declarations {
 public:
  /// Collects all declarations and reports names declared twice. Lexicons that are named by `in` and `extends` and not
  /// in use are loaded from the stdlib: files may grow.
  static Declarations collect(std::vector<LoadedFile>& files, lang::SourceProvider& provider,
                              lang::Diagnostics& diagnostics);

  std::vector<Declaration> movements;  ///< pose, expression, motion
  std::vector<Declaration> clips;      ///< timeline, utterance, discourse
  std::vector<Declaration> entries;
  std::vector<LexiconDeclaration> lexicons;
  std::vector<Declaration> tracks, axes, units, muscles, faces, tests;

  /// The movement `name` as file `from` sees it: its own first, then those of the files it uses, nearest first.
  [[nodiscard]] const Declaration* find_movement(std::string_view name, std::uint32_t from) const;
  /// The timeline, utterance or discourse of that name that is nearest to file `from`.
  [[nodiscard]] const Declaration* find_clip(std::string_view name, std::uint32_t from) const;
  [[nodiscard]] std::uint32_t find_lexicon(std::string_view name) const;
  /// An entry by name, label or alias, in a lexicon or one that it extends.
  [[nodiscard]] const Declaration* find_entry(std::string_view name, std::uint32_t lexicon) const;
  /// All entries a lexicon has, its own first.
  [[nodiscard]] std::vector<const Declaration*> entries_of(std::uint32_t lexicon) const;

  /// Names of all movements that `from` sees, for "did you mean".
  [[nodiscard]] std::vector<std::string> movement_names(std::uint32_t from) const;
  [[nodiscard]] std::vector<std::string> entry_names(std::uint32_t lexicon) const;

 private:
  std::unordered_map<std::string_view, std::vector<std::uint32_t>> movement_index_;
  std::unordered_map<std::string_view, std::vector<std::uint32_t>> clip_index_;
  const std::vector<LoadedFile>* files_ = nullptr;
};

/// A property that has a name: one that did not parse may have none.
[[nodiscard]] bool is_property(lang::NodeRef node);

/// The text of a string node without its quotes, or of a gloss without its backquotes.
[[nodiscard]] std::string_view unquoted(lang::NodeRef node);

}  // namespace nms::compiler
