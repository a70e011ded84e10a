#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
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
    {"stdlib", {}},
    {"cli", {"lang", "compiler", "runtime", "program", "stdlib"}},
    {"tools/fit_face", {"runtime", "program"}},
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

/// What `text`, a C++ file of `room`, includes and must not. `resolves` says whether a quoted name is a file of the room.
template <typename Resolves>
std::vector<std::string> wrong_includes(const std::string& room, const std::string& text, Resolves resolves) {
  static const std::regex kInclude(R"re(^[ \t]*#[ \t]*include[ \t]*([<"])([^>"]+)[>"])re");
  std::vector<std::string> wrong;
  std::istringstream lines(text);
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    std::smatch m;
    if (!std::regex_search(line, m, kInclude)) continue;
    const std::string name = m[2];
    const std::string where = "line " + std::to_string(number) + ": ";
    if (name.starts_with("nms/")) {
      const std::string target = name.substr(4, name.find('/', 4) - 4);
      if (!permitted(room, target)) wrong.push_back(where + room + " must not include " + name);
    } else if (m[1] == "\"" && !resolves(name)) {
      wrong.push_back(where + "\"" + name + "\" is not a file of " + room);
    }
  }
  return wrong;
}

/// Libraries that a CMakeLists.txt of `room` names and must not.
std::vector<std::string> wrong_links(const std::string& room, const std::string& text) {
  static const std::regex kLibrary(R"(\bnms::([a-z_]+))");
  std::vector<std::string> wrong;
  for (std::sregex_iterator i(text.begin(), text.end(), kLibrary), end; i != end; ++i) {
    if (!permitted(room, (*i)[1])) wrong.push_back(room + " must not link nms::" + std::string((*i)[1]));
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
    for (const std::string& wrong : wrong_links(room, read(file))) ADD_FAILURE() << room << "/CMakeLists.txt: " << wrong;
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
  EXPECT_EQ(wrong_includes("tools/fit_face", "#include <nms/compiler/compile.h>\n", none).size(), 1U);
  EXPECT_TRUE(wrong_includes("compiler", "#include <nms/lang/tree.h>\n#include <vector>\n", none).empty());
  EXPECT_EQ(wrong_links("runtime", "nms_room(runtime LINK nms::program nms::compiler)").size(), 1U);
  EXPECT_TRUE(wrong_links("cli", "LINK nms::lang nms::compiler nms::runtime").empty());
}

}  // namespace
