// The same source gives the same bytes: twice in one process, from any provider, and in every build. The hashes of a
// few programs stand in tests/golden/program_hashes.txt; debug, release and other compilers are held to the same table.
// They see the golden library only, and so change with the compiler and with nothing else.
// NMS_REFRESH=1 rewrites the table.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <gtest/gtest.h>
#include <nms/compiler/compile.h>
#include <nms/lang/render.h>
#include <nms/program/program.h>
#include <nms/stdlib/embedded.h>

namespace {

using namespace nms;
namespace fs = std::filesystem;

const fs::path kRoot = NMS_SOURCE_DIR;

std::string read(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

/// The library, from a folder or from the embedded files; always under the same paths.
class Library : public lang::SourceProvider {
 public:
  explicit Library(fs::path folder) : folder_(std::move(folder)) {}
  Library() = default;

  std::shared_ptr<const lang::Source> find(std::string_view name, std::string_view from) override {
    const std::string library = "stdlib/";
    const fs::path beside = from.substr(0, library.size()) == library
                                ? fs::path(from.substr(library.size())).parent_path() / name
                                : fs::path(name);
    // As the command does it: beside the using file, then in the library.
    auto found = at(beside.lexically_normal().generic_string());
    return found ? found : at(std::string(name));
  }

 private:
  std::shared_ptr<const lang::Source> at(const std::string& key) {
    if (const auto it = known_.find(key); it != known_.end()) return it->second;
    std::optional<std::string> text;
    if (!folder_.empty()) {
      if (fs::is_regular_file(folder_ / key)) text = read(folder_ / key);
    } else {
      for (const stdlib::EmbeddedFile& f : stdlib::embedded_files())
        if (f.path == key) text = std::string(f.text);
    }
    if (!text) return nullptr;
    return known_[key] = std::make_shared<const lang::Source>("stdlib/" + key, std::move(*text));
  }

  fs::path folder_;  ///< empty: the embedded files
  std::map<std::string, std::shared_ptr<const lang::Source>> known_;
};

std::vector<std::byte> compiled(const std::string& name, const std::string& text, Library library) {
  lang::Diagnostics diagnostics;
  const auto draft = compiler::compile({std::make_shared<const lang::Source>(name, text)}, library, diagnostics);
  EXPECT_TRUE(draft) << lang::render_text(diagnostics, false);
  return draft ? program::encode(*draft) : std::vector<std::byte>();
}

std::vector<fs::path> sources(const fs::path& folder) {
  std::vector<fs::path> paths;
  for (const fs::directory_entry& e : fs::recursive_directory_iterator(folder))
    if (e.path().extension() == ".nms") paths.push_back(e.path());
  std::sort(paths.begin(), paths.end());
  return paths;
}

TEST(Determinism, examples_and_lexicons_compile_to_the_same_bytes_twice_and_from_any_provider) {
  std::vector<fs::path> all;  // of the examples, those that stand alone: the library here finds nothing beside a file
  for (const fs::path& path : sources(kRoot / "examples"))
    if (path.parent_path() == kRoot / "examples") all.push_back(path);
  ASSERT_GT(all.size(), 5U);
  const std::vector<fs::path> library = sources(kRoot / "stdlib");
  all.insert(all.end(), library.begin(), library.end());
  for (const fs::path& path : all) {
    SCOPED_TRACE(path.string());
    const std::string name = fs::relative(path, kRoot).generic_string(), text = read(path);
    const auto once = compiled(name, text, Library());
    EXPECT_EQ(once, compiled(name, text, Library())) << "twice";
    EXPECT_EQ(once, compiled(name, text, Library(kRoot / "stdlib"))) << "from the folder";
  }
}

TEST(Determinism, trees_kept_from_one_compilation_to_the_next_change_no_byte_and_no_word) {
  Library library;
  compiler::TreeCache trees;
  std::vector<fs::path> all = sources(kRoot / "examples");
  std::erase_if(all, [](const fs::path& p) { return p.parent_path() != kRoot / "examples"; });
  // A source with errors, and one that warns: what is said is the same too.
  std::vector<std::pair<std::string, std::string>> texts{
      {"wrong.nms", "use \"emotions\"\nutterance u in asl { signs { wh[ A ] neg[ B } }\npose p = nothing\n"},
      {"warns.nms", "pose p = 60% AU12 + 60% AU12\nutterance u in asl { signs { wh[ A ] } }\n"}};
  for (const fs::path& path : all) texts.emplace_back(path.filename().string(), read(path));
  for (int round = 0; round < 2; ++round)
    for (const auto& [name, text] : texts) {
      SCOPED_TRACE(name);
      const auto source = std::make_shared<const lang::Source>(name, text);
      lang::Diagnostics plain_says, kept_says;
      compiler::CompileOptions with_trees;
      with_trees.trees = &trees;
      const auto plain = compiler::compile({source}, library, plain_says);
      const auto kept = compiler::compile({source}, library, kept_says, with_trees);
      EXPECT_EQ(lang::render_text(plain_says, false), lang::render_text(kept_says, false));
      ASSERT_EQ(plain.has_value(), kept.has_value());
      if (plain) {
        EXPECT_EQ(program::encode(*plain), program::encode(*kept));
      }
    }
}

TEST(Determinism, every_build_makes_the_same_programs) {
  const fs::path table = kRoot / "tests/golden/program_hashes.txt";
  std::string got =
      "# XXH3-64 of compiled programs: one table for every compiler and every build. NMS_REFRESH=1 rewrites it.\n";
  for (const char* name : {"brackets_nested", "explicit_wins", "layers", "oscillation", "phases_easing", "saturated",
                           "sequence_fill", "steps_easing", "steps_mixed", "thesis_smile", "timeline_latest",
                           "timeline_overlapping", "timeline_sum_of_axis"}) {
    const std::string file = std::string(name) + ".nms";
    const auto bytes =
        compiled(file, read(kRoot / "tests/golden/program" / file), Library(kRoot / "tests/golden/stdlib"));
    char line[128];
    std::snprintf(line, sizeof line, "%016llx %s\n",
                  static_cast<unsigned long long>(XXH3_64bits(bytes.data(), bytes.size())), name);
    got += line;
  }
  if (std::getenv("NMS_REFRESH") != nullptr) std::ofstream(table, std::ios::binary) << got;
  EXPECT_EQ(got, read(table));
}

}  // namespace
