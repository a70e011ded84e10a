#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nms/lang/parse.h>

namespace {

using namespace nms::lang;
namespace fs = std::filesystem;

std::shared_ptr<const Tree> parsed(const std::string& text, bool* good = nullptr) {
  Diagnostics diagnostics;
  auto tree = parse(std::make_shared<const Source>("file.nms", text), diagnostics);
  if (good != nullptr) *good = diagnostics.error_count() == 0;
  return tree;
}

std::string ranged(const std::string& text, std::uint32_t first, std::uint32_t last) {
  return format_range(*parsed(text), first, last);
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> out;
  std::stringstream stream(text);
  for (std::string line; std::getline(stream, line);) out.push_back(line);
  return out;
}

const std::string kMessy =
    "pose   a=AU1\n"                  // 1
    "pose   b=AU2;pose c  = AU4\n"    // 2
    "\n"                              // 3
    "lexicon l   \"L\" {\n"           // 4
    "     entry e {\n"                // 5
    "   AU1  ;  AU2\n"                // 6
    "   brow_raise{onset 100ms}\n"    // 7
    "}\n"                             // 8
    "  entry f   {AU4}   // trail\n"  // 9
    "}\n"                             // 10
    "pose  d=AU5\n";                  // 11

TEST(FormatRange, one_declaration) {
  EXPECT_EQ(ranged("pose   a=AU1\npose   b=AU2\n", 2, 2), "pose   a=AU1\npose b = AU2\n");
}

TEST(FormatRange, what_shares_a_line_goes_together) {
  const auto lines = lines_of(ranged(kMessy, 2, 2));
  ASSERT_EQ(lines.size(), 12U);
  EXPECT_EQ(lines[0], "pose   a=AU1");
  EXPECT_EQ(lines[1], "pose b = AU2");
  EXPECT_EQ(lines[2], "pose c = AU4");
  EXPECT_EQ(lines[11], "pose  d=AU5");
}

TEST(FormatRange, a_statement_inside_a_block) {
  auto want = lines_of(kMessy);
  want[6] = "    brow_raise { onset 100ms }";
  EXPECT_EQ(lines_of(ranged(kMessy, 7, 7)), want);
  want = lines_of(kMessy);
  want[8] = "  entry f { AU4 }  // trail";
  EXPECT_EQ(lines_of(ranged(kMessy, 9, 9)), want);
}

TEST(FormatRange, the_line_of_a_header_is_the_whole_block) {
  const auto lines = lines_of(ranged(kMessy, 5, 5));
  EXPECT_EQ(lines[3], "lexicon l   \"L\" {");
  EXPECT_EQ(lines[4], "  entry e {");
  EXPECT_EQ(lines[5], "    AU1");
  EXPECT_EQ(lines[6], "    AU2");
}

TEST(FormatRange, lines_without_a_statement_change_nothing) {
  EXPECT_EQ(ranged(kMessy, 3, 3), kMessy);
  EXPECT_EQ(ranged(kMessy, 40, 50), kMessy);
  EXPECT_EQ(ranged("", 1, 1), "");
}

TEST(FormatRange, all_lines_make_canonical_text) { EXPECT_EQ(ranged(kMessy, 1, 11), format(*parsed(kMessy))); }

TEST(FormatRange, errors_are_left_alone) {
  const std::string broken = "pose = = AU1\npose   b=AU2\n";
  EXPECT_EQ(ranged(broken, 2, 2), broken);
}

TEST(FormatRange, line_ends_of_other_lines_stay) {
  EXPECT_EQ(ranged("pose   a=AU1\r\npose   b=AU2\r\npose   c=AU4\r\n", 2, 2),
            "pose   a=AU1\r\npose b = AU2\npose   c=AU4\r\n");
}

/// Any lines of any file: the tree and the comments stay, nothing outside changes, and a second time changes nothing.
TEST(FormatRange, of_any_lines_of_any_file) {
  const fs::path root = NMS_SOURCE_DIR;
  std::vector<fs::path> paths;
  for (const char* folder : {"tests/golden/lang", "tests/golden/check", "tests/golden/program", "examples"})
    for (const fs::directory_entry& e : fs::directory_iterator(root / folder))
      if (e.path().extension() == ".nms" && e.file_size() < 2500) paths.push_back(e.path());
  std::sort(paths.begin(), paths.end());
  std::size_t ranges = 0;
  std::size_t changed = 0;
  for (const fs::path& path : paths) {
    std::ifstream file(path, std::ios::binary);
    std::stringstream stream;
    stream << file.rdbuf();
    std::string text = stream.str();
    if (text.find('\r') != std::string::npos) continue;
    bool good = false;
    (void)parsed(text, &good);
    if (!good) continue;
    // Files in the repository are in canonical form; blanks make them messy.
    for (std::size_t at = text.find(" = "); at != std::string::npos; at = text.find(" = ", at + 5))
      text.insert(at, "  ");
    for (std::size_t at = text.find("\n  "); at != std::string::npos; at = text.find("\n  ", at + 2))
      text.insert(at + 1, " ");
    const auto tree = parsed(text, &good);
    if (!good) continue;
    const auto lines = lines_of(text);
    const auto count = static_cast<std::uint32_t>(lines.size());
    for (std::uint32_t first = 1; first <= count; ++first)
      for (const std::uint32_t length : {0U, 1U, 4U, 30U}) {
        const std::uint32_t last = std::min(first + length, count);
        SCOPED_TRACE(path.filename().string() + ":" + std::to_string(first) + ".." + std::to_string(last));
        const std::string once = format_range(*tree, first, last);
        ++ranges;
        if (once == text) continue;
        ++changed;
        const auto again = parsed(once, &good);
        ASSERT_TRUE(good) << once;
        ASSERT_EQ(again->comments().size(), tree->comments().size()) << once;
        // The same tree: its canonical text is the same.
        ASSERT_EQ(format(*again), format(*tree)) << once;
        // The lines that changed are one stretch or several, each of which a statement that was touched explains: what
        // lies before the first and behind the last statement touched is as it was.
        const auto result = lines_of(once);
        std::size_t same_before = 0;
        while (same_before < std::min(lines.size(), result.size()) && lines[same_before] == result[same_before])
          ++same_before;
        std::size_t same_after = 0;
        while (same_after < std::min(lines.size(), result.size()) - same_before &&
               lines[lines.size() - 1 - same_after] == result[result.size() - 1 - same_after])
          ++same_after;
        std::uint32_t begin = count;
        std::uint32_t end = 0;
        for (NodeRef d : tree->root().children()) {
          const std::uint32_t from = tree->source().position(d.range().begin).line;
          const std::uint32_t to = tree->source().position(d.range().end).line;
          if (from > last || to < first) continue;
          begin = std::min(begin, from);
          end = std::max(end, to);
        }
        ASSERT_GE(same_before + 1, begin);
        ASSERT_LE(lines.size() - same_after, end);
        // Again, over what these lines have become.
        const auto grown = static_cast<std::int64_t>(result.size()) - static_cast<std::int64_t>(lines.size());
        const auto new_last =
            static_cast<std::uint32_t>(std::max<std::int64_t>(first, static_cast<std::int64_t>(last) + grown));
        if (length == 0 && grown == 0) {
          ASSERT_EQ(format_range(*again, first, new_last), once);
        }
      }
  }
  EXPECT_GT(ranges, 1000U);
  EXPECT_GT(changed, 500U);
}

}  // namespace
