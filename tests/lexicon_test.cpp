// What holds for every lexicon of the library: each entry plays, no two look the same unless they say so, and each row
// of the table of facts (tests/lexicon_rows.tsv) has its entries.
#include <cmath>
#include <cstdint>
#include <fstream>
#include <map>
#include <memory>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include <nms/compiler/compile.h>
#include <nms/lang/parse.h>
#include <nms/lang/render.h>
#include <nms/program/play.h>
#include <nms/program/program.h>
#include <nms/stdlib/embedded.h>

#include "embedded_library.h"

namespace {

using namespace nms;

struct Entry {
  std::string name;
  std::vector<std::string> ids, synonyms;
};

struct Include {
  std::vector<std::string> names;
  std::string from;
};

struct Lexicon {
  std::string extends;
  std::vector<Entry> entries;
  std::vector<Include> includes;
};

std::string unquoted(lang::NodeRef node) {
  std::string text(node.text());
  return text.size() >= 2 && text.front() == '"' ? text.substr(1, text.size() - 2) : text;
}

Entry read_entry(lang::NodeRef node) {
  Entry entry{std::string(node.child(lang::NodeKind::name).text()), {}, {}};
  for (const lang::NodeRef item : node.children()) {
    if (!item.is(lang::NodeKind::property)) continue;
    const std::string_view property = item.at(0).text();
    if (property != "id" && property != "synonym") continue;
    for (const lang::NodeRef value : item.children())
      if (value != item.at(0)) (property == "id" ? entry.ids : entry.synonyms).push_back(unquoted(value));
  }
  return entry;
}

Include read_include(lang::NodeRef node) {
  Include include;
  for (const lang::NodeRef name : node.children()) include.names.emplace_back(name.text());
  include.from = include.names.back();
  include.names.pop_back();
  return include;
}

/// All lexicons of the library, by name.
const std::map<std::string, Lexicon>& lexicons() {
  static const auto* const all = [] {
    auto* found = new std::map<std::string, Lexicon>;
    for (const auto& file : stdlib::embedded_files()) {
      if (!file.path.starts_with("lexicons/")) continue;
      lang::Diagnostics diagnostics;
      const auto tree = lang::parse(
          std::make_shared<const lang::Source>(std::string(file.path), std::string(file.text)), diagnostics);
      for (const lang::NodeRef node : tree->root().children()) {
        if (!node.is(lang::NodeKind::lexicon)) continue;
        Lexicon& lexicon = (*found)[std::string(node.child(lang::NodeKind::name).text())];
        if (const lang::NodeRef extends = node.child(lang::NodeKind::extends))
          lexicon.extends = extends.child(lang::NodeKind::name).text();
        for (const lang::NodeRef part : node.children())
          if (part.is(lang::NodeKind::entry))
            lexicon.entries.push_back(read_entry(part));
          else if (part.is(lang::NodeKind::include))
            lexicon.includes.push_back(read_include(part));
      }
    }
    return found;
  }();
  return *all;
}

/// The lexicon's entry of that name, its own or one that it includes.
const Entry* find_entry(const std::string& lexicon, const std::string& name) {
  for (const Entry& e : lexicons().at(lexicon).entries)
    if (e.name == name) return &e;
  for (const Include& i : lexicons().at(lexicon).includes)
    for (const std::string& included : i.names)
      if (included == name) return find_entry(i.from, name);
  return nullptr;
}

/// Entries that an utterance `in` the lexicon can use: its own, then those of the lexicons it extends that have no
/// entry of the same name before them.
std::vector<Entry> visible(std::string name) {
  std::vector<Entry> out;
  std::set<std::string> seen;
  for (; !name.empty(); name = lexicons().at(name).extends) {
    for (const Entry& e : lexicons().at(name).entries)
      if (seen.insert(e.name).second) out.push_back(e);
    for (const Include& i : lexicons().at(name).includes)
      for (const std::string& included : i.names)
        if (const Entry* e = find_entry(i.from, included); e != nullptr && seen.insert(included).second)
          out.push_back(*e);
  }
  return out;
}

/// A clip's curves, sampled every 10 ms on one clock, channel by channel.
struct Look {
  std::string name;
  std::vector<std::vector<float>> frames;
};

constexpr std::int64_t kFrame = 10'000'000;
constexpr std::int64_t kFrom = -1'000'000'000, kTo = 4'000'000'000;

/// Every entry over the same three signs.
std::vector<Look> looks(const std::string& lexicon, const std::vector<Entry>& entries) {
  std::string text = "use \"lexicons/" + lexicon + ".nms\"\n";
  for (std::size_t i = 0; i < entries.size(); ++i)
    text += "utterance u" + std::to_string(i) + " in " + lexicon + " { signs { A@0s..0.4s B@0.5s..0.9s C@1s..1.4s }; " +
            entries[i].name + " over A..C }\n";
  EmbeddedLibrary library;
  lang::Diagnostics diagnostics;
  const auto draft = compiler::compile({std::make_shared<const lang::Source>("looks.nms", text)}, library, diagnostics);
  EXPECT_EQ(diagnostics.error_count(), 0U) << lexicon << "\n" << lang::render_text(diagnostics, false);
  std::vector<Look> out;
  if (!draft) return out;
  const auto image = program::Image::from(draft.value());
  const program::Program& p = image.value().program();
  std::vector<float> values(p.channels.size());
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const program::Clip* clip = p.find_clip("u" + std::to_string(i));
    EXPECT_NE(clip, nullptr) << entries[i].name;
    if (clip == nullptr) continue;
    Look look{entries[i].name, {}};
    program::Player player(p, *clip);
    for (std::int64_t t = kFrom; t <= kTo; t += kFrame) {
      player.advance(t, values);
      if (t < clip->start_ns || t > clip->end_ns) std::fill(values.begin(), values.end(), 0.0F);
      look.frames.push_back(values);
    }
    out.push_back(std::move(look));
  }
  return out;
}

/// For how many frames some channel of the two is a tenth of a unit apart; counts no further than `enough`.
int frames_apart(const Look& a, const Look& b, int enough) {
  int apart = 0;
  for (std::size_t f = 0; f < a.frames.size() && apart < enough; ++f)
    for (std::size_t c = 0; c < a.frames[f].size(); ++c)
      if (std::abs(a.frames[f][c] - b.frames[f][c]) >= 0.1F) {
        ++apart;
        break;
      }
  return apart;
}

bool synonyms(const Entry& a, const Entry& b) {
  for (const std::string& s : a.synonyms)
    if (s == b.name) return true;
  for (const std::string& s : b.synonyms)
    if (s == a.name) return true;
  return false;
}

class EveryLexicon : public testing::TestWithParam<std::string> {};

TEST_P(EveryLexicon, TellsItsEntriesApart) {
  const std::vector<Entry> entries = visible(GetParam());
  const std::vector<Look> all = looks(GetParam(), entries);
  ASSERT_EQ(all.size(), entries.size());
  constexpr int kEnough = 10;  // 100 ms
  for (std::size_t i = 0; i < all.size(); ++i)
    for (std::size_t k = i + 1; k < all.size(); ++k) {
      const int apart = frames_apart(all[i], all[k], kEnough);
      if (synonyms(entries[i], entries[k]))
        EXPECT_LT(apart, kEnough) << all[i].name << " and " << all[k].name << " are called synonyms and look different";
      else
        EXPECT_GE(apart, kEnough) << all[i].name << " and " << all[k].name << " look the same for all but "
                                  << apart * 10 << " ms";
    }
}

TEST_P(EveryLexicon, PlaysEveryEntry) {
  const std::vector<Entry> entries = visible(GetParam());
  for (const Look& look : looks(GetParam(), entries)) {
    float most = 0.0F;
    for (const auto& frame : look.frames)
      for (const float v : frame) most = std::max(most, std::abs(v));
    // Gaze at the addressee is straight ahead, and so at rest.
    if (look.name == "gaze_AD") continue;
    EXPECT_GE(most, 0.04F) << look.name << " moves nothing";
  }
}

std::vector<std::string> names() {
  std::vector<std::string> out;
  for (const auto& [name, lexicon] : lexicons()) out.push_back(name);
  return out;
}

INSTANTIATE_TEST_SUITE_P(Library, EveryLexicon, testing::ValuesIn(names()),
                         [](const auto& instance) { return instance.param; });

struct Row {
  std::vector<std::string> lexicons;
  std::string instead;  ///< why it has no entry: where the language itself has it
};

std::map<std::string, Row> rows() {
  std::map<std::string, Row> out;
  std::ifstream file(std::string(NMS_SOURCE_DIR) + "/tests/lexicon_rows.tsv");
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::istringstream cells(line);
    std::string id, languages, instead;
    std::getline(cells, id, '\t');
    std::getline(cells, languages, '\t');
    std::getline(cells, instead, '\t');
    Row& row = out[id];
    row.instead = instead;
    std::istringstream words(languages);
    for (std::string word; words >> word;) row.lexicons.push_back(word);
  }
  return out;
}

TEST(LexiconRows, EveryRowHasAnEntryInEveryLanguageItNames) {
  const auto table = rows();
  EXPECT_EQ(table.size(), 158U);
  for (const auto& [id, row] : table) {
    EXPECT_FALSE(row.lexicons.empty()) << id;
    for (const std::string& lexicon : row.lexicons) {
      ASSERT_TRUE(lexicons().contains(lexicon)) << id << ": no lexicon " << lexicon;
      bool found = false;
      for (const Entry& e : visible(lexicon))
        for (const std::string& own : e.ids) found |= own == id;
      EXPECT_NE(found, !row.instead.empty()) << id << " in " << lexicon;
    }
  }
}

TEST(LexiconRows, EveryIdIsARow) {
  const auto table = rows();
  for (const auto& [name, lexicon] : lexicons())
    for (const Entry& e : lexicon.entries)
      for (const std::string& id : e.ids) EXPECT_TRUE(table.contains(id)) << name << ": " << e.name << " has id " << id;
}

TEST(Lexicons, HnsHasAllCodesOfSigml) {
  // Shoulders 9, body 10, head 11, gaze 15, brows 4, lids 13, nose 3, mouth gestures 9 + 4 + 35 + 13 + 17.
  EXPECT_EQ(lexicons().at("hns").entries.size(), 143U);
}

}  // namespace
