#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <nms/compiler/lexicon_index.h>
#include <nms/program/program.h>

namespace nms::cli {

/// A test that plays an entry.
struct SiteTest {
  std::string name;
  std::string place;  ///< "asl_test.nms:12"
  std::string text;
};

/// One page: an entry, and its clip in the lexicon's program.
struct SiteEntry {
  const compiler::EntryRecord* record = nullptr;
  const program::Clip* clip = nullptr;
  std::vector<SiteTest> tests;
};

struct SiteLexicon {
  const compiler::LexiconRecord* record = nullptr;
  const program::Program* program = nullptr;
  std::vector<SiteEntry> entries;
};

/// The pages of `nmsc doc`: static, in HTML that is well-formed XML too. They ask for nothing from elsewhere and load
/// nothing but classic scripts, so they work from a folder as from a server. The same lexicons give the same bytes.
///
/// Beside index.html stand assets/site.css, assets/site.js, assets/viewer.js, and for each lexicon L the folder L/ with
/// face.js (the face and all clips), and for each entry E the page E.html, the plot E.svg and the picture E.png.
[[nodiscard]] std::string index_page(const std::vector<SiteLexicon>& lexicons, std::string_view face);
/// @param index  of the entry among the lexicon's
[[nodiscard]] std::string entry_page(const SiteLexicon& lexicon, std::size_t index, std::string_view face);

/// The time at which a clip shows most: where its channels are farthest from rest, all together.
[[nodiscard]] std::int64_t telling_time(const program::Program& program, const program::Clip& clip);

/// The style sheet and the script of all pages; they are parts of the command.
[[nodiscard]] std::string_view site_css();
[[nodiscard]] std::string_view site_js();

}  // namespace nms::cli
