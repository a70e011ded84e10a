#include "lexicon_text.h"

#include <memory>
#include <set>

#include <nms/compiler/lexicon_index.h>

#include "../tests/embedded_library.h"

namespace nms::bench {

std::string lexicon_text() {
  EmbeddedLibrary library;
  lang::Diagnostics diagnostics;
  std::set<std::string> names;
  std::string included;
  for (const char* file : {"lexicons/asl.nms", "lexicons/hns.nms"}) {
    for (const compiler::LexiconRecord& l : compiler::index_lexicons({library.find(file, "")}, library, diagnostics)) {
      if (!l.root) continue;
      for (const compiler::EntryRecord& e : l.entries) {
        if (names.size() == kEntries) break;
        if (names.insert(e.name).second && l.name == "hns") included += (included.empty() ? "" : ", ") + e.name;
      }
    }
  }
  return "use \"lexicons/asl.nms\"\nuse \"lexicons/hns.nms\"\nlexicon bench \"Of so many entries\" extends asl {\n  "
         "include " +
         included + " from hns\n}\n";
}

}  // namespace nms::bench
