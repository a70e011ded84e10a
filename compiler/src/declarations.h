#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include <nms/lang/diagnostic.h>
#include <nms/lang/tree.h>

#include "load_sources.h"
#include "name_index.h"

namespace nms::compiler {

/// A named declaration of any file in use.
struct Declaration {
  lang::NodeRef node;
  std::string_view name;
  std::uint32_t file = 0;
  std::uint32_t lexicon = 0xFFFFFFFFU;  ///< of an entry: index into Declarations::lexicons
};

/// A string that is looked up by what it says.
struct TextHash {
  using is_transparent = void;
  [[nodiscard]] std::size_t operator()(std::string_view text) const { return std::hash<std::string_view>{}(text); }
};

/// A lexicon with the entries that it declares or includes; those it extends are looked up through `extends`.
struct LexiconDeclaration {
  Declaration declaration;
  std::uint32_t extends = 0xFFFFFFFFU;
  std::vector<std::uint32_t> entries;                           ///< indices into Declarations::entries, in order
  std::unordered_map<std::string_view, std::uint32_t> by_name;  ///< of its entries
  /// Labels and aliases of its entries; one that several share has several.
  std::unordered_map<std::string, std::vector<std::uint32_t>, TextHash, std::equal_to<>> by_label;
  std::unordered_set<std::string_view> removed;  ///< names of inherited entries that it does without
  std::vector<lang::NodeRef> combinations;       ///< `combine` nodes, in order
};

/// What names stand for, over all files in use. One namespace for each kind of thing.
class Declarations {
 public:
  /// Collects all declarations and reports names declared twice. Lexicons that are named by `in` and `extends` and not
  /// in use are loaded from the stdlib: files may grow.
  static Declarations collect(std::vector<LoadedFile>& files, lang::SourceProvider& provider,
                              lang::Diagnostics& diagnostics, TreeCache* trees = nullptr);

  std::vector<Declaration> movements;  ///< pose, expression, motion
  std::vector<Declaration> clips;      ///< timeline, utterance, discourse
  std::vector<Declaration> entries;
  std::vector<LexiconDeclaration> lexicons;
  std::vector<Declaration> tracks, axes, units, muscles, faces, tests, degrees, ambients;

  /// Its index in `movements`, or kUnreachable for what is none of them.
  [[nodiscard]] std::uint32_t movement_number(const Declaration& d) const;
  /// Whether another movement, of any file, has the same name.
  [[nodiscard]] bool has_namesake(std::uint32_t movement) const { return has_namesake_[movement]; }
  /// Whether a movement has parameters.
  [[nodiscard]] bool has_params(std::uint32_t movement) const { return has_params_[movement]; }
  /// The number of the only movement of that name, or kUnreachable.
  [[nodiscard]] std::uint32_t only_movement(std::string_view name) const { return only_movement(NameKey(name)); }
  [[nodiscard]] std::uint32_t only_movement(const NameKey& name) const;
  /// The same, if it is `file` that declares it.
  [[nodiscard]] std::uint32_t own_movement(const NameKey& name, std::uint32_t file) const;
  /// Asks memory for what `only_movement` will soon need; changes nothing.
  void prefetch_movement(const NameKey& name) const { movement_index_.prefetch(name); }
  /// The movement `name` as file `from` sees it: its own first, then those of the files it uses, nearest first.
  [[nodiscard]] const Declaration* find_movement(std::string_view name, std::uint32_t from) const;
  /// The timeline, utterance or discourse of that name that is nearest to file `from`.
  [[nodiscard]] const Declaration* find_clip(std::string_view name, std::uint32_t from) const;
  /// A degree, as `slightly`, by the same rule.
  [[nodiscard]] const Declaration* find_degree(std::string_view name, std::uint32_t from) const;
  [[nodiscard]] std::vector<std::string> degree_names(std::uint32_t from) const;
  /// The ambient of that name that is nearest to file `from`.
  [[nodiscard]] const Declaration* find_ambient(std::string_view name, std::uint32_t from) const;
  /// The parameters of a declaration, if it has any. Of one of `movements` that has none it looks nowhere.
  [[nodiscard]] lang::NodeRef params(const Declaration& d) const;
  [[nodiscard]] std::uint32_t find_lexicon(std::string_view name) const;
  /// An entry by name, label or alias, in a lexicon or one that it extends: the nearest lexicon first, and in it names
  /// before labels. Of several that share the label, the first.
  [[nodiscard]] const Declaration* find_entry(std::string_view name, std::uint32_t lexicon) const;
  /// All that a word may mean there: several for a label that entries of one lexicon share.
  [[nodiscard]] std::vector<const Declaration*> find_entries(std::string_view name, std::uint32_t lexicon) const;
  /// All entries a lexicon has, its own first.
  [[nodiscard]] std::vector<const Declaration*> entries_of(std::uint32_t lexicon) const;

  /// Names of all movements that `from` sees, for "did you mean".
  [[nodiscard]] std::vector<std::string> movement_names(std::uint32_t from) const;
  [[nodiscard]] std::vector<std::string> ambient_names(std::uint32_t from) const;
  [[nodiscard]] std::vector<std::string> entry_names(std::uint32_t lexicon) const;
  /// A lexicon that has an entry of that name, label or alias, if any has.
  [[nodiscard]] const LexiconDeclaration* lexicon_with(std::string_view name) const;

 private:
  /// Whether a lexicon between `from` and `at`, which has it, has its own in its place or does without.
  [[nodiscard]] bool hidden(const Declaration& entry, std::uint32_t from, std::uint32_t at) const;
  /// Collects a pose, expression or motion.
  void movement(const Declaration& d, const NameKey& name, const std::vector<LoadedFile>& files,
                lang::Diagnostics& diagnostics);

  std::unordered_map<std::string_view, std::vector<std::uint32_t>> clip_index_;
  std::unordered_map<std::string_view, std::vector<std::uint32_t>> degree_index_;
  std::unordered_map<std::string_view, std::uint32_t> lexicon_index_;
  std::unordered_map<std::string_view, std::vector<std::uint32_t>> ambient_index_;
  NameIndex movement_index_;
  std::vector<bool> has_namesake_;            ///< of movements
  std::vector<bool> has_params_;              ///< of movements
  std::vector<std::uint32_t> movements_end_;  ///< by file: number past its last movement; they stand file by file
  /// Of movements that are not the last of their name: the next one. Few are.
  std::unordered_map<std::uint32_t, std::uint32_t> next_of_name_;
  [[nodiscard]] std::uint32_t next_of_name(std::uint32_t movement) const;
  const std::vector<LoadedFile>* files_ = nullptr;
};

/// A property that has a name: one that did not parse may have none.
[[nodiscard]] bool is_property(lang::NodeRef node);

/// What a string node says: without its quotes, `\"` and `\\` being `"` and `\`. A gloss without its backquotes.
[[nodiscard]] std::string unquoted(lang::NodeRef node);
/// A gloss without its backquotes.
[[nodiscard]] std::string_view gloss_text(lang::NodeRef node);

}  // namespace nms::compiler
