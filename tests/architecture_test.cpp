#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

// The permitted arrows between rooms. This table is the architecture; docs/architecture.md draws it.
namespace {

namespace fs = std::filesystem;

const std::map<std::string, std::set<std::string>> kArrows = {
    {"program", {}},
    {"lang", {}},
    {"compiler", {"lang", "program"}},
    {"runtime", {"program"}},
    {"picture", {}},
    {"stdlib", {}},
    {"cli", {"lang", "compiler", "runtime", "program", "picture", "stdlib"}},
    {"tools/face_program", {"lang", "compiler", "program", "stdlib"}},
    {"tools/fit_face", {"face_program", "lang", "runtime", "program", "stdlib"}},
    {"tools/fit_muscles", {"face_program", "lang", "runtime", "program", "stdlib"}},
};

/// A room's own headers go by its last name: tools/fit_face has <nms/fit_face/...>.
std::string header_name(const std::string& room) { return room.substr(room.rfind('/') + 1); }

bool permitted(const std::string& room, const std::string& target) {
  return target == header_name(room) || kArrows.at(room).contains(target);
}

std::string read(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

/// The file that a line includes, or nothing.
std::string included(const std::string& line, bool& quoted) {
  std::size_t at = 0;
  const auto skip_blanks = [&] { at = std::min(line.find_first_not_of(" \t", at), line.size()); };
  const auto skip = [&](std::string_view word) {
    skip_blanks();
    if (line.compare(at, word.size(), word) != 0) return false;
    at += word.size();
    return true;
  };
  if (!skip("#") || !skip("include")) return {};
  skip_blanks();
  if (at == line.size() || (line[at] != '<' && line[at] != '"')) return {};
  quoted = line[at] == '"';
  const std::size_t end = line.find(quoted ? '"' : '>', at + 1);
  return end == std::string::npos ? std::string() : line.substr(at + 1, end - at - 1);
}

/// What `text`, a C++ file of `room`, includes and must not. `resolves` says whether a quoted name is a file of the
/// room.
template <typename Resolves>
std::vector<std::string> wrong_includes(const std::string& room, const std::string& text, Resolves resolves) {
  std::vector<std::string> wrong;
  std::istringstream lines(text);
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    bool quoted = false;
    const std::string name = included(line, quoted);
    if (name.empty()) continue;
    const std::string where = "line " + std::to_string(number) + ": ";
    if (name.starts_with("nms/")) {
      const std::string target = name.substr(4, name.find('/', 4) - 4);
      if (!permitted(room, target)) wrong.push_back(where + room + " must not include " + name);
    } else if (quoted && !resolves(name)) {
      wrong.push_back(where + "\"" + name + "\" is not a file of " + room);
    }
  }
  return wrong;
}

/// Libraries that a CMakeLists.txt of `room` names and must not.
std::vector<std::string> wrong_links(const std::string& room, const std::string& text) {
  std::vector<std::string> wrong;
  for (std::size_t at = text.find("nms::"); at != std::string::npos; at = text.find("nms::", at + 1)) {
    const std::size_t end = text.find_first_not_of("abcdefghijklmnopqrstuvwxyz_", at + 5);
    const std::string target = text.substr(at + 5, end == std::string::npos ? end : end - at - 5);
    if (!permitted(room, target)) wrong.push_back(room + " must not link nms::" + target);
  }
  return wrong;
}

const fs::path kRoot = NMS_SOURCE_DIR;

TEST(Architecture, EveryIncludeFollowsAPermittedArrow) {
  int files = 0;
  for (const auto& [room, targets] : kArrows) {
    const fs::path dir = kRoot / room;
    if (!fs::exists(dir)) continue;
    for (const auto& item : fs::recursive_directory_iterator(dir)) {
      const std::string extension = item.path().extension().string();
      if (extension != ".h" && extension != ".cpp") continue;
      ++files;
      const fs::path here = item.path().parent_path();
      const auto resolves = [&](const std::string& name) {
        for (const fs::path& base : {here, dir / "src"}) {
          const fs::path file = base / name;
          if (!fs::exists(file)) continue;
          const std::string inside = fs::relative(fs::weakly_canonical(file), fs::weakly_canonical(dir)).string();
          if (!inside.starts_with("..")) return true;
        }
        return false;
      };
      for (const std::string& wrong : wrong_includes(room, read(item.path()), resolves))
        ADD_FAILURE() << fs::relative(item.path(), kRoot).string() << ": " << wrong;
    }
  }
  EXPECT_GT(files, 20) << "the rooms were not found under " << kRoot;
}

TEST(Architecture, EveryLinkFollowsAPermittedArrow) {
  for (const auto& [room, targets] : kArrows) {
    const fs::path file = kRoot / room / "CMakeLists.txt";
    if (!fs::exists(file)) continue;
    for (const std::string& wrong : wrong_links(room, read(file)))
      ADD_FAILURE() << room << "/CMakeLists.txt: " << wrong;
  }
}

TEST(Architecture, TheTableHasNoCycle) {
  // Peel off rooms whose targets are all peeled; what is left is on a cycle.
  std::set<std::string> peeled;
  for (bool more = true; more;) {
    more = false;
    for (const auto& [room, targets] : kArrows) {
      if (peeled.contains(header_name(room))) continue;
      bool free = true;
      for (const std::string& target : targets) free = free && peeled.contains(target);
      if (free) more = peeled.insert(header_name(room)).second;
    }
  }
  EXPECT_EQ(peeled.size(), kArrows.size());
}

TEST(Architecture, ASeededViolationIsFound) {
  const auto none = [](const std::string&) { return false; };
  EXPECT_EQ(wrong_includes("runtime", "#include <nms/lang/tree.h>\n", none).size(), 1U);
  EXPECT_EQ(wrong_includes("program", "  #  include \"nms/runtime/face.h\"\n", none).size(), 1U);
  EXPECT_EQ(wrong_includes("lang", "#include \"../../compiler/src/lower.h\"\n", none).size(), 1U);
  EXPECT_EQ(wrong_includes("tools/fit_face", "#include <nms/picture/render.h>\n", none).size(), 1U);
  EXPECT_TRUE(wrong_includes("compiler", "#include <nms/lang/tree.h>\n#include <vector>\n", none).empty());
  EXPECT_EQ(wrong_links("runtime", "nms_room(runtime LINK nms::program nms::compiler)").size(), 1U);
  EXPECT_TRUE(wrong_links("cli", "LINK nms::lang nms::compiler nms::runtime").empty());
}

}  // namespace
