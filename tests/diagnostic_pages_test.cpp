// docs/diagnostics/: every kind that a source or a command line can bring about has a page, and its examples do what
// it says. The wrong one brings about that kind and no other, the right one none at all.
#include <algorithm>
#include <regex>
#include <set>
#include <vector>

#include <nlohmann/json.hpp>

#include <nms/compiler/diagnostic_kinds.h>
#include <nms/lang/diagnostic_kinds.h>

#include "command_run.h"
#include "under_sanitizers.h"

namespace {

using namespace nms::command_run;
using Json = nlohmann::json;

const fs::path kPages = kRoot / "docs/diagnostics";

/// A fenced block: what stands behind its fence, and what is in it.
struct Block {
  std::string info;
  std::string text;
};

struct Page {
  std::string kind;
  std::string text;
  std::vector<Block> blocks;

  [[nodiscard]] const Block* find(const std::string& info) const {
    for (const Block& b : blocks)
      if (b.info == info) return &b;
    return nullptr;
  }
};

std::vector<Page> pages() {
  std::vector<fs::path> paths;
  for (const fs::directory_entry& e : fs::directory_iterator(kPages)) paths.push_back(e.path());
  std::sort(paths.begin(), paths.end());
  std::vector<Page> out;
  for (const fs::path& path : paths) {
    Page page{path.stem().string(), read(path), {}};
    std::stringstream lines(page.text);
    bool inside = false;
    for (std::string line; std::getline(lines, line);) {
      if (line.rfind("```", 0) == 0) {
        if (!inside) page.blocks.push_back({line.substr(3), {}});
        inside = !inside;
      } else if (inside) {
        page.blocks.back().text += line + '\n';
      }
    }
    EXPECT_FALSE(inside) << path;
    out.push_back(std::move(page));
  }
  return out;
}

/// `\xC9` as the byte that it stands for.
std::string with_bytes(const std::string& text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '\\' && i + 3 < text.size() && text[i + 1] == 'x') {
      out += static_cast<char>(std::stoi(text.substr(i + 2, 2), nullptr, 16));
      i += 3;
    } else {
      out += text[i];
    }
  }
  return out;
}

/// Runs the lines of a block in the folder; returns the kinds that nmsc reported.
std::multiset<std::string> kinds_of(const Folder& folder, const std::string& script) {
  std::multiset<std::string> kinds;
  std::stringstream lines(script);
  for (std::string line; std::getline(lines, line);) {
    const fs::path err = folder.path / "stderr";
    const bool ours = line.rfind("nmsc ", 0) == 0;
    const std::string command = ours ? fmt::format("\"{}\" --error-format=json {}", NMSC, line.substr(5)) : line;
    const int status = std::system(fmt::format("cd \"{}\" && {{ {}; }} >{}stdout 2>\"{}\" </dev/null",
                                               folder.path.string(), command, ours ? "" : "no_", err.string())
                                       .c_str());
    if (!ours) {
      EXPECT_EQ(status, 0) << line;
      continue;
    }
    const std::string said = read(err);
    const Json report = Json::parse(said, nullptr, false);
    EXPECT_TRUE(report.is_object() && report.contains("diagnostics")) << line << "\n" << said;
    if (!report.is_object() || !report.contains("diagnostics")) continue;
    for (const Json& d : report["diagnostics"]) kinds.insert(d["kind"].get<std::string>());
  }
  return kinds;
}

TEST(DiagnosticPages, examples_do_what_the_page_says) {
  const std::size_t every = nms::one_case_of(4);
  const auto all = pages();
  for (std::size_t i = 0; i < all.size(); i += every) {
    const Page& page = all[i];
    SCOPED_TRACE(page.kind);
    const Folder folder;
    for (const Block& b : page.blocks) {
      const std::size_t space = b.info.find(' ');
      const std::string type = b.info.substr(0, space);
      const std::string name = space == std::string::npos ? std::string() : b.info.substr(space + 1);
      if (type == "nms" && (name == "wrong" || name == "right" || name == "wrong bytes"))
        std::ofstream(folder.path / (name == "right" ? "right.nms" : "wrong.nms"), std::ios::binary)
            << (name == "wrong bytes" ? with_bytes(b.text) : b.text);
      else if (type == "csv")
        std::ofstream(folder.path / name, std::ios::binary) << b.text;
      else
        EXPECT_TRUE(type == "sh" && (name == "wrong" || name == "right")) << b.info;
    }
    const Block* wrong = page.find("sh wrong");
    const Block* right = page.find("sh right");
    const auto seen = kinds_of(folder, wrong != nullptr ? wrong->text : "nmsc check wrong.nms\n");
    EXPECT_FALSE(seen.empty()) << "the wrong example is right";
    for (const std::string& kind : seen) EXPECT_EQ(kind, page.kind) << "the wrong example";
    for (const std::string& kind : kinds_of(folder, right != nullptr ? right->text : "nmsc check right.nms\n"))
      ADD_FAILURE() << "the right example brings about " << kind;
  }
}

TEST(DiagnosticPages, begin_alike) {
  for (const Page& page : pages()) {
    SCOPED_TRACE(page.kind);
    const std::regex head("# " + page.kind +
                          "\n\n(An error\\.|A warning, of the group `[a-z]+`\\.)\n\n[A-Z`][^\n]+\n[^]*");
    EXPECT_TRUE(std::regex_match(page.text, head));
    EXPECT_EQ(page.text.find("\n\n\n"), std::string::npos);
  }
}

TEST(DiagnosticPages, every_kind_has_one_and_its_severity_is_right) {
  std::set<std::string> there;
  std::set<std::string> warnings;
  for (const Page& page : pages()) {
    there.insert(page.kind);
    if (page.text.find("\n\nA warning,") != std::string::npos) warnings.insert(page.kind);
  }
  struct Kind {
    const char* name;
    bool warning;
  };
  const Kind kinds[] = {
#define NMS_X(type, name) {#name, false},
      NMS_LANG_DIAGNOSTICS(NMS_X)
#undef NMS_X
#define NMS_X(type, name, severity) {#name, nms::compiler::type::kSeverity == nms::lang::Severity::warning},
          NMS_COMPILER_DIAGNOSTICS(NMS_X)
#undef NMS_X
  };
  std::set<std::string> known;
  for (const Kind& kind : kinds) {
    known.insert(kind.name);
    EXPECT_TRUE(there.count(kind.name)) << "docs/diagnostics/" << kind.name << ".md is missing";
    EXPECT_EQ(warnings.count(kind.name) != 0, kind.warning) << kind.name;
  }
  // The command's own kinds stand where they are reported. No source leads to a picture that cannot be drawn.
  const std::set<std::string> of_options{"no_picture"};
  const std::regex reported("(?:(?:add_failure\\(\\s*\\w+,\\s*|Failure)\\{|kKind = )\"([a-z_]+)\"[,;]");
  for (const fs::directory_entry& e : fs::directory_iterator(kRoot / "cli/src")) {
    const std::string text = read(e.path());
    for (std::sregex_iterator it(text.begin(), text.end(), reported), end; it != end; ++it) {
      const std::string kind = (*it)[1];
      if (of_options.count(kind) != 0) continue;
      known.insert(kind);
      EXPECT_TRUE(there.count(kind)) << "docs/diagnostics/" << kind << ".md is missing; see " << e.path();
    }
  }
  for (const char* kind : {"expectation_failed", "removal_unnoticed"}) known.insert(kind);
  // Programs, avatars and faces are refused by the rooms that read them. What no small file brings about has no page:
  // what a checked program may not hold, seams of ada's own kind of file, and the writer's own defects.
  const std::set<std::string> without{
      "bad_face",       "curve_cycle",   "empty_face",       "face_bad_reference",   "face_seam_apart",
      "face_too_large", "gltf_writer",   "invalid_program",  "invalid_program_text", "knots_not_nested",
      "missing_curve",  "missing_frame", "missing_landmark", "missing_region",       "open_border"};
  const std::regex refused(
      "(?:Failure\\{|return fail\\(|return \\{(?=\"face_))\\s*\"([a-z_0-9]+)\"|refuse\\(\"([a-z_]+)\", place");
  for (const char* room : {"program/src", "runtime/src"})
    for (const fs::directory_entry& e : fs::directory_iterator(kRoot / room)) {
      const std::string text = read(e.path());
      for (std::sregex_iterator it(text.begin(), text.end(), refused), end; it != end; ++it) {
        const std::string kind = (*it)[1].matched ? (*it)[1] : (*it)[2];
        if (without.count(kind) != 0) continue;
        known.insert(kind);
        EXPECT_TRUE(there.count(kind)) << "docs/diagnostics/" << kind << ".md is missing; see " << e.path();
      }
    }
  for (const std::string& kind : there) EXPECT_TRUE(known.count(kind)) << kind << " is no kind any more";
}

TEST(DiagnosticPages, the_command_prints_them) {
  const Folder folder;
  const std::string list = run(folder, "explain");
  for (const Page& page : pages()) {
    EXPECT_NE(list.find("\n  " + page.kind + " "), std::string::npos) << page.kind;
    const std::string told = run(folder, "explain " + page.kind);
    for (const Block& b : page.blocks)
      EXPECT_NE(told.find("    " + b.text.substr(0, b.text.find('\n')) + "\n"), std::string::npos) << page.kind;
  }
}

}  // namespace
