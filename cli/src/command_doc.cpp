// `nmsc doc`: a lexicon as pages to look at.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <sstream>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <nms/compiler/test.h>
#include <nms/picture/image.h>
#include <nms/picture/render.h>
#include <nms/program/play.h>
#include <nms/runtime/gltf_export.h>
#include <nms/runtime/rig.h>

#include "commands.h"
#include "face_meshes.h"
#include "loaded_lexicon.h"
#include "loading.h"
#include "output_file.h"
#include "plot_svg.h"
#include "progress.h"
#include "report.h"
#include "site_pages.h"

namespace nms::cli {
namespace {

namespace fs = std::filesystem;

constexpr int kPictureWidth = 150;   // [px]
constexpr int kPictureHeight = 180;  // [px]
constexpr int kPlotWidth = 1000;     // [px]
constexpr int kSkyRays = 8;          // for each vertex: enough for so small a picture
constexpr int kKeyRays = 4;
constexpr const char* kViewer = "viewer.js";
constexpr const char* kViewerLicence = "viewer.LICENSE.txt";

/// Beside the index: what the command wrote there, a path a line.
constexpr const char* kWritten = "written.txt";

/// Whether a line of that list can be a file of ours: in the folder or in one folder of it.
bool can_be_ours(const fs::path& file) {
  static const std::set<fs::path> kOurs{".css", ".html", ".js", ".png", ".svg", ".txt"};
  if (!file.is_relative() || file.lexically_normal() != file || !kOurs.contains(file.extension())) return false;
  const auto parts = std::distance(file.begin(), file.end());
  return (parts == 1 || parts == 2) && *file.begin() != "..";
}

/// Files into one folder; after the first that cannot be written the others are left alone.
class Writer {
 public:
  Writer(fs::path folder, lang::Diagnostics& diagnostics) : folder_(std::move(folder)), diagnostics_(diagnostics) {}

  void write(const fs::path& name, std::span<const std::byte> bytes) {
    if (failed_) return;
    const fs::path path = folder_ / name;
    std::error_code error;
    fs::create_directories(path.parent_path(), error);
    const auto failure = error ? std::optional(program::Failure{"cannot_write", path.parent_path().string(),
                                                                error.message(), "give another folder"})
                               : write_file(path.string(), bytes);
    if (!failure) {
      written_.insert(name.generic_string());
      return;
    }
    add_failure(diagnostics_, *failure);
    failed_ = true;
  }
  void write(const fs::path& name, std::string_view text) {
    write(name, std::as_bytes(std::span(text.data(), text.size())));
  }
  [[nodiscard]] bool failed() const { return failed_; }

  /// Removes what the list of before names and was not written again: pages of entries that are gone. Whatever else
  /// lies in the folder stays, as does what is no plain file or lies behind a link. Then writes the list of now.
  std::size_t remove_the_rest() {
    const auto before = read_file((folder_ / kWritten).string());
    std::string now;
    for (const std::string& file : written_) now += file + '\n';
    write(kWritten, now);
    if (failed_ || !before) return 0;
    std::size_t removed = 0;
    std::istringstream lines(*before);
    for (std::string line; std::getline(lines, line);) {
      const fs::path file = line;
      if (!can_be_ours(file) || written_.contains(line)) continue;
      std::error_code ignored;
      const fs::path above = folder_ / file.parent_path();
      if (file.has_parent_path() && fs::is_symlink(fs::symlink_status(above, ignored))) continue;
      if (!fs::is_regular_file(fs::symlink_status(folder_ / file, ignored))) continue;
      removed += fs::remove(folder_ / file, ignored) ? 1U : 0U;
      // Only an empty folder goes.
      if (file.has_parent_path()) fs::remove(above, ignored);
    }
    return removed;
  }

 private:
  fs::path folder_;
  lang::Diagnostics& diagnostics_;
  std::set<std::string> written_;
  bool failed_ = false;
};

/// Where the viewer lies: where the user says, else beside the command as it is installed, or as it is built.
std::optional<fs::path> find_viewer(const std::string& given, lang::Diagnostics& diagnostics) {
  std::vector<fs::path> places;
  if (!given.empty()) {
    places.emplace_back(given);
  } else {
    std::error_code error;
    const fs::path command = fs::read_symlink("/proc/self/exe", error);
    if (!error) {
      const fs::path folder = command.parent_path();
      places = {folder.parent_path() / "share" / "nms" / "viewer", folder.parent_path().parent_path() / "viewer"};
    }
  }
  for (const fs::path& place : places)
    if (fs::is_regular_file(place / kViewer) && fs::is_regular_file(place / kViewerLicence)) return place;
  add_failure(diagnostics, {"no_viewer", given.empty() ? std::string("nmsc doc") : given,
                            fmt::format("there is no {} with its {}", kViewer, kViewerLicence),
                            "make them with scripts/viewer of nmsc's sources, and give their folder with --viewer"});
  return std::nullopt;
}

std::string base64(std::span<const std::byte> bytes) {
  static constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8U | (k < count ? std::to_integer<std::uint32_t>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k) out += k <= count ? kDigits[group >> (18 - 6 * k) & 63U] : '=';
  }
  return out;
}

/// The tests of some files, and which entries they play: by the file and the byte where an entry is written.
using TestsByEntry = std::map<std::pair<std::string, std::uint32_t>, std::vector<SiteTest>>;

std::optional<TestsByEntry> tests_by_entry(const GlobalOptions& global,
                                           const std::vector<std::shared_ptr<const lang::Source>>& files,
                                           SourceFiles& sources, lang::Diagnostics& diagnostics) {
  const auto tables = load_time_tables(global, sources, diagnostics);
  if (!tables) return std::nullopt;
  TestsByEntry out;
  for (const auto& file : files) {
    lang::Diagnostics own;
    for (const compiler::TestResult& t : compiler::run_tests({file}, sources, own, {{}, *tables})) {
      const std::string place =
          fmt::format("{}:{}", fs::path(t.source->path()).filename().string(), t.source->position(t.range.begin).line);
      for (const compiler::PlayedEntry& e : t.plays)
        out[{e.file, e.begin}].push_back({t.name, place, std::string(t.source->slice(t.whole))});
    }
    if (own.error_count() == 0) continue;
    for (const lang::Diagnostic& d : own.all()) diagnostics.add(d);
    return std::nullopt;
  }
  return out;
}

SiteLexicon site_lexicon(const LoadedLexicon& loaded, const TestsByEntry& tests) {
  SiteLexicon out{&loaded.lexicon, &loaded.image.program(), {}};
  for (const compiler::EntryRecord& e : loaded.lexicon.entries) {
    const program::Clip* clip = out.program->find_clip(e.name);
    if (clip == nullptr) continue;
    const auto played = tests.find({e.file, e.range.begin});
    out.entries.push_back({&e, clip, played == tests.end() ? std::vector<SiteTest>() : played->second});
  }
  return out;
}

/// A picture of the moment at which an entry shows most.
class Photographer {
 public:
  Photographer(const runtime::Face& face, const runtime::Rig& rig)
      : face_(face), rig_(rig), pose_(make_pose(face, rig)) {
    runtime::pose_face(face_, rig_, std::vector<float>(rig_.channel_count(), 0.0F), pose_);
    camera_ = head_camera(face_, rig_, pose_, static_cast<double>(kPictureWidth) / kPictureHeight);
  }

  [[nodiscard]] tl::expected<std::vector<std::byte>, program::Failure> take(const program::Program& program,
                                                                            const program::Clip& clip) {
    std::vector<float> values(program.channels.size());
    program::Player player(program, clip);
    player.advance(telling_time(program, clip), values);
    runtime::pose_face(face_, rig_, values, pose_);
    const int threads = static_cast<int>(std::clamp(std::thread::hardware_concurrency(), 1U, 64U));
    const auto images = picture::render(face_meshes(face_, rig_, pose_), {camera_},
                                        {kPictureWidth, kPictureHeight, threads, kSkyRays, kKeyRays});
    if (!images)
      return tl::unexpected(program::Failure{"no_picture", std::string(program.string(clip.name)), images.error().cause,
                                             "give another face"});
    return picture::encode_png(images->front());
  }

 private:
  const runtime::Face& face_;
  const runtime::Rig& rig_;
  runtime::Pose pose_;
  picture::Camera camera_;
};

/// The pages, plots and pictures of one lexicon, and its face.
void write_lexicon(const SiteLexicon& lexicon, const std::string& face_name, SourceFiles& sources, Writer& writer,
                   lang::Diagnostics& diagnostics) {
  const program::Program& program = *lexicon.program;
  const auto face = load_face(program, face_name, sources, diagnostics);
  if (!face) return;
  const auto rig = bind_face(*face, program, diagnostics);
  if (!rig) return;
  const fs::path folder = lexicon.record->name;
  runtime::GltfOptions gltf;
  for (const SiteEntry& e : lexicon.entries) gltf.clips.emplace_back(program.string(e.clip->name));
  const auto glb = runtime::export_glb(*face, *rig, program, gltf);
  if (!glb) {
    add_failure(diagnostics, glb.error());
    return;
  }
  writer.write(folder / "face.js", "window.nmsFace = \"" + base64(*glb) + "\";\n");
  Photographer photographer(*face, *rig);
  Progress progress(lexicon.entries.size());
  for (std::size_t i = 0; i < lexicon.entries.size() && !writer.failed(); ++i) {
    const SiteEntry& e = lexicon.entries[i];
    const auto picture = photographer.take(program, *e.clip);
    if (!picture) {
      add_failure(diagnostics, picture.error());
      break;
    }
    writer.write(folder / (e.record->name + ".png"), *picture);
    writer.write(folder / (e.record->name + ".svg"), plot_svg(program, *e.clip, kPlotWidth));
    writer.write(folder / (e.record->name + ".html"), entry_page(lexicon, i, face_name));
    progress.done(e.record->name);
  }
  progress.end();
}

void run(const GlobalOptions& global, const DocOptions& options, SourceFiles& sources, lang::Diagnostics& diagnostics) {
  const auto viewer = find_viewer(options.viewer, diagnostics);
  if (!viewer) return;
  std::vector<LoadedLexicon> loaded;
  for (const std::string& name : options.lexicons) {
    auto one = load_lexicon(global, name, options.face, sources, diagnostics);
    if (!one) return;
    const bool known = std::any_of(loaded.begin(), loaded.end(),
                                   [&](const LoadedLexicon& l) { return l.lexicon.name == one->lexicon.name; });
    if (!known) loaded.push_back(std::move(*one));
  }
  // Tests may stand in the lexicon's own file.
  std::vector<std::shared_ptr<const lang::Source>> files = load_roots(options.tests, sources, diagnostics);
  for (const LoadedLexicon& l : loaded)
    if (std::find(files.begin(), files.end(), l.root) == files.end()) files.push_back(l.root);
  const auto tests = tests_by_entry(global, files, sources, diagnostics);
  if (!tests || diagnostics.error_count() != 0) return;
  std::vector<SiteLexicon> lexicons;
  for (const LoadedLexicon& l : loaded) lexicons.push_back(site_lexicon(l, *tests));

  Writer writer(options.output, diagnostics);
  const fs::path assets = "assets";
  for (const char* name : {kViewer, kViewerLicence}) {
    const auto text = read_file((*viewer / name).string());
    if (!text) {
      add_failure(diagnostics, text.error());
      return;
    }
    writer.write(assets / name, *text);
  }
  writer.write(assets / "site.css", site_css());
  writer.write(assets / "site.js", site_js());
  std::size_t count = 0;
  for (const SiteLexicon& l : lexicons) {
    write_lexicon(l, options.face, sources, writer, diagnostics);
    count += l.entries.size();
  }
  // What leads to all of it comes last.
  if (diagnostics.error_count() != 0) return;
  writer.write("index.html", index_page(lexicons, options.face));
  const std::size_t removed = writer.remove_the_rest();
  if (writer.failed()) return;
  fmt::print(told(global), "{}: {} entries on {}; open index.html{}\n", options.output, count, options.face,
             removed == 0 ? std::string() : fmt::format("; {} files of entries that are gone removed", removed));
}

}  // namespace

int doc(const GlobalOptions& global, const DocOptions& options) {
  SourceFiles sources(global.stdlib);
  lang::Diagnostics diagnostics;
  run(global, options, sources, diagnostics);
  return finish(global, diagnostics);
}

}  // namespace nms::cli
