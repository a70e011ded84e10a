#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <nms/lang/diagnostic.h>
#include <nms/lang/source.h>

#include <nms/compiler/tree_cache.h>

namespace nms::compiler {

/// What an entry says of itself, as it is written: for manifests, tables and search.
struct EntryRecord {
  std::string name;      ///< also of the clip that `CompileOptions::lexicon` makes of it
  std::string function;  ///< "syntactic"; empty: none is written
  std::string meaning;
  std::string spreads;
  std::string evidence;
  std::vector<std::string> ids;  ///< rows of a table elsewhere that it stands for
  std::vector<std::string> labels;
  std::vector<std::string> aliases;
  std::vector<std::string> sources;
  std::string comment;  ///< its doc comment, lines joined by blanks
  std::shared_ptr<const lang::Source> source;
  lang::Range range;       ///< its declaration, doc comment included
  std::string file;        ///< path of the source it stands in
  std::uint32_t line = 0;  ///< of its first character, from 1
  std::string lexicon;     ///< the one that declares it: another than asked for if it is included or inherited
  bool inherited = false;  ///< through `extends`
};

/// What a face says of itself.
struct FaceRecord {
  std::string name;
  std::string licence;  ///< of its geometry; empty: none is stated
};

/// A lexicon and all its entries, inherited ones included, its own first; entries that it replaces are left out.
struct LexiconRecord {
  std::string name;
  std::string title;
  std::string extends;
  std::string licence;  ///< of the lexicon; empty: none is stated
  bool root = false;  ///< declared in a file that the caller named
  std::vector<EntryRecord> entries;
};

/// The lexicons that the roots declare, use and extend, in the order they are read. Reports what does not parse and
/// what is declared twice; meanings are not looked at.
/// @param trees  as in CompileOptions: what is parsed here need not be parsed again there
[[nodiscard]] std::vector<LexiconRecord> index_lexicons(const std::vector<std::shared_ptr<const lang::Source>>& roots,
                                                        lang::SourceProvider& provider, lang::Diagnostics& diagnostics,
                                                        TreeCache* trees = nullptr);

/// The faces that the roots declare, in order.
[[nodiscard]] std::vector<FaceRecord> index_faces(const std::vector<std::shared_ptr<const lang::Source>>& roots,
                                                  lang::SourceProvider& provider, lang::Diagnostics& diagnostics,
                                                  TreeCache* trees = nullptr);

}  // namespace nms::compiler
