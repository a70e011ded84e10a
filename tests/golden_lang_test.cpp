// Every tests/golden/lang/*.nms beside its .expect: the tree, the canonical text and the diagnostics.
// NMS_REFRESH=1 rewrites the expectations; what changed is then read in the diff.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <string>

#include <gtest/gtest.h>
#include <nms/lang/diagnostic_kinds.h>
#include <nms/lang/parse.h>
#include <nms/lang/render.h>

namespace {

using namespace nms::lang;
namespace fs = std::filesystem;

const fs::path kGolden = fs::path(NMS_SOURCE_DIR) / "tests/golden/lang";

std::string read(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

std::vector<fs::path> cases() {
  std::vector<fs::path> paths;
  for (const fs::directory_entry& e : fs::directory_iterator(kGolden))
    if (e.path().extension() == ".nms") paths.push_back(e.path());
  std::sort(paths.begin(), paths.end());
  return paths;
}

struct Parsed {
  std::shared_ptr<const Tree> tree;
  Diagnostics diagnostics;
};
Parsed parsed(const std::string& name, std::string text) {
  Parsed p;
  p.tree = parse(std::make_shared<Source>(name, std::move(text)), p.diagnostics);
  return p;
}
Parsed parsed(const fs::path& path) { return parsed(path.filename().string(), read(path)); }

std::string expectation(const Parsed& p) {
  std::string out = "=== tree\n" + dump(*p.tree);
  if (p.diagnostics.all().empty())
    out += "=== format\n" + format(*p.tree);
  else
    out += "=== diagnostics\n" + render_text(p.diagnostics, false);
  return out;
}

TEST(GoldenLang, everything_is_as_expected) {
  const bool refresh = std::getenv("NMS_REFRESH") != nullptr;
  for (const fs::path& path : cases()) {
    SCOPED_TRACE(path.filename().string());
    const std::string got = expectation(parsed(path));
    fs::path expected = path;
    expected.replace_extension(".expect");
    if (refresh) std::ofstream(expected, std::ios::binary) << got;
    EXPECT_EQ(got, read(expected));
  }
}

TEST(GoldenLang, fail_is_in_the_name_exactly_when_an_error_is_reported) {
  for (const fs::path& path : cases()) {
    const bool fails = path.filename().string().rfind("fail_", 0) == 0;
    EXPECT_EQ(parsed(path).diagnostics.error_count() > 0, fails) << path.filename();
  }
}

TEST(GoldenLang, no_expectation_is_unread) {
  for (const fs::directory_entry& e : fs::directory_iterator(kGolden)) {
    fs::path source = e.path();
    source.replace_extension(".nms");
    EXPECT_TRUE(e.path().extension() == ".nms" || (e.path().extension() == ".expect" && fs::exists(source)))
        << e.path();
  }
}

TEST(GoldenLang, formatting_keeps_the_tree_and_is_idempotent) {
  for (const fs::path& path : cases()) {
    SCOPED_TRACE(path.filename().string());
    const Parsed first = parsed(path);
    const std::string text = format(*first.tree);
    if (first.diagnostics.error_count() > 0) {
      EXPECT_EQ(text, read(path)) << "a text with errors is left alone";
      continue;
    }
    const Parsed second = parsed("formatted.nms", text);
    EXPECT_EQ(dump(*second.tree), dump(*first.tree));
    EXPECT_EQ(second.tree->comments().size(), first.tree->comments().size());
    EXPECT_EQ(format(*second.tree), text);
  }
}

TEST(GoldenLang, every_node_kind_occurs) {
  std::set<NodeKind> seen;
  for (const fs::path& path : cases()) {
    const Parsed p = parsed(path);
    for (std::uint32_t i = 0; i < p.tree->nodes().size(); ++i) seen.insert(p.tree->nodes().kind(i));
  }
#define NMS_X(kind, text) EXPECT_TRUE(seen.count(NodeKind::kind)) << #kind;
  NMS_NODE_KINDS(NMS_X)
#undef NMS_X
}

TEST(GoldenLang, every_diagnostic_kind_occurs) {
  std::set<std::string> seen;
  for (const fs::path& path : cases()) {
    const Parsed p = parsed(path);
    for (const Diagnostic& d : p.diagnostics.all()) seen.insert(std::string(d.kind));
  }
  // A file of 256 MB is too much for a fixture; the parser's own tests have it.
  seen.insert("file_too_large");
#define NMS_X(type, name)        \
  EXPECT_EQ(type::kKind, #name); \
  EXPECT_TRUE(seen.count(#name)) << #name;
  NMS_LANG_DIAGNOSTICS(NMS_X)
#undef NMS_X
}

}  // namespace
