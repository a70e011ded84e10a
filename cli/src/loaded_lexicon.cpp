#include "loaded_lexicon.h"

#include <utility>

#include <fmt/format.h>

#include <nms/compiler/tree_cache.h>

#include "loading.h"
#include "report.h"

namespace nms::cli {
namespace {

/// The file that declares a lexicon: a path to one, or a name in the standard library.
std::shared_ptr<const lang::Source> lexicon_source(const std::string& name, SourceFiles& sources,
                                                   lang::Diagnostics& diagnostics) {
  if (name.ends_with(".nms")) {
    auto opened = sources.open(name);
    if (opened) return *opened;
    add_failure(diagnostics, opened.error());
    return nullptr;
  }
  auto found = sources.stdlib(fmt::format("lexicons/{}.nms", name));
  if (found == nullptr)
    add_failure(diagnostics, {"unknown_lexicon", name, "the standard library has no lexicon of that name",
                              "give a name such as asl, or the path of a .nms file that declares one"});
  return found;
}

}  // namespace

std::optional<LoadedLexicon> load_lexicon(const GlobalOptions& global, const std::string& name, const std::string& face,
                                          SourceFiles& sources, lang::Diagnostics& diagnostics) {
  const auto root = lexicon_source(name, sources, diagnostics);
  if (root == nullptr) return std::nullopt;
  compiler::TreeCache trees;
  lang::Diagnostics again;  // whatever it finds is found by the compilation too
  for (compiler::LexiconRecord& record : compiler::index_lexicons({root}, sources, again, &trees)) {
    if (!record.root) continue;
    auto image = load_lexicon_program(global, root->path(), record.name, face, sources, diagnostics, trees);
    if (!image) return std::nullopt;
    compiler::FaceRecord of{face, {}};
    for (compiler::FaceRecord& f : compiler::index_faces({face_source(face, sources)}, sources, again, &trees))
      of = std::move(f);
    return LoadedLexicon{root, std::move(record), std::move(of), std::move(*image)};
  }
  add_failure(diagnostics, {"unknown_lexicon", name, "it declares no lexicon",
                            "give a file with `lexicon NAME \"title\" { ... }` in it"});
  return std::nullopt;
}

}  // namespace nms::cli
