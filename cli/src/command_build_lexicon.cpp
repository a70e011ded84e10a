#include <algorithm>
#include <atomic>
#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <fmt/format.h>
#define XXH_INLINE_ALL
#include <xxhash.h>

#include <nms/compiler/lexicon_index.h>
#include <nms/program/text.h>
#include <nms/runtime/gltf_export.h>
#include <nms/runtime/rig.h>

#include "commands.h"
#include "dependency_file.h"
#include "error_not_held.h"
#include "gltf_options.h"
#include "loaded_lexicon.h"
#include "loading.h"
#include "manifest.h"
#include "not_actuated.h"
#include "output_file.h"
#include "progress.h"
#include "report.h"

namespace nms::cli {
namespace {

constexpr const char* kManifest = "manifest.json";
constexpr const char* kBesideOneFile = ".manifest.json";  ///< added to the name of a single file

/// Of all that every asset depends on beside its own clip: the rig, the face's surface, the options, this program.
std::uint64_t common_hash(const program::Program& program, std::string_view surface, const BuildOptions& options) {
  // The text form is complete, and its clips are what each asset adds by itself.
  const std::string text = program::to_text(program);
  std::string rig;
  bool clip = false;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size() - 1) + 1;
    const std::string_view line = std::string_view(text).substr(at, end - at);
    if (line.front() != ' ' && line.front() != '\n') clip = line.starts_with("clip ");
    if (!clip) rig += line;
    at = end;
  }
  rig += fmt::format("{} {} {} {} {} {}", NMS_VERSION, options.all_targets, options.dense, options.quantize,
                     options.max_error, options.max_corrections);
  return XXH3_64bits(rig.data(), rig.size()) ^ XXH3_64bits_withSeed(surface.data(), surface.size(), 1);
}

std::uint64_t asset_hash(std::uint64_t common, std::span<const Asset> assets) {
  std::vector<std::uint64_t> parts{common};
  for (const Asset& a : assets) parts.push_back(a.clip->content_hash);
  return XXH3_64bits(parts.data(), parts.size() * sizeof parts.front());
}

/// Entries and their clips, in the lexicon's order.
std::vector<Asset> assets_of(const LoadedLexicon& loaded, bool one_file, const std::string& output) {
  std::vector<Asset> assets;
  const program::Program& program = loaded.image.program();
  for (const compiler::EntryRecord& e : loaded.lexicon.entries)
    if (const program::Clip* clip = program.find_clip(e.name))
      assets.push_back({&e, clip, one_file ? std::filesystem::path(output).filename().string() : e.name + ".glb", 0});
  return assets;
}

/// One file to make: the assets that stand in it.
struct Job {
  std::string path;
  std::vector<const Asset*> assets;
};

/// What kept a file from being made, or where it misses what was asked for.
struct Finding {
  program::Failure failure;
  lang::Severity severity = lang::Severity::error;
};

/// Makes the files, side by side; findings in the order of the jobs.
std::vector<Finding> make_files(const std::vector<Job>& jobs, const runtime::Face& face, const runtime::Rig& rig,
                                const program::Program& program, const runtime::GltfOptions& options) {
  std::vector<std::optional<Finding>> findings(jobs.size());
  Progress progress(jobs.size());
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < jobs.size(); i = next++) {
      runtime::GltfOptions gltf = options;
      for (const Asset* a : jobs[i].assets) gltf.clips.emplace_back(program.string(a->clip->name));
      runtime::GltfReport report;
      const auto glb = runtime::export_glb(face, rig, program, gltf, gltf.max_error_m > 0.0 ? &report : nullptr);
      if (!glb)
        findings[i] = Finding{glb.error()};
      else if (auto failure = write_file(jobs[i].path, *glb))
        findings[i] = Finding{std::move(*failure)};
      else if (auto missed = error_not_held(report, gltf, jobs[i].path))
        findings[i] = Finding{std::move(*missed), lang::Severity::warning};
      progress.done(jobs[i].path);
    }
  };
  std::vector<std::thread> others;
  const std::size_t threads = std::min<std::size_t>(std::max(1U, std::thread::hardware_concurrency()), jobs.size());
  for (std::size_t t = 1; t < threads; ++t) others.emplace_back(work);
  work();
  for (std::thread& t : others) t.join();
  progress.end();
  std::vector<Finding> out;
  for (auto& f : findings)
    if (f) out.push_back(std::move(*f));
  return out;
}

bool write_text(const std::string& path, const std::string& text, lang::Diagnostics& diagnostics) {
  const auto failure = write_file(path, std::as_bytes(std::span(text.data(), text.size())));
  if (failure) add_failure(diagnostics, *failure);
  return !failure;
}

/// What a manifest of before says, and how it reads: the same text is not written again.
struct Before {
  std::string text;
  std::map<std::string, std::uint64_t> hashes;
};

Before read_before(const std::string& path) {
  if (!std::filesystem::is_regular_file(path)) return {};
  auto text = read_file(path);
  if (!text) return {};
  Before before{std::move(*text), {}};
  before.hashes = read_manifest_hashes(before.text);
  return before;
}

/// Files of entries that are gone: ours, since the manifest of before names them.
std::size_t remove_old(const std::string& folder, const Before& before, const std::vector<Asset>& assets) {
  std::set<std::string> wanted;
  for (const Asset& a : assets) wanted.insert(a.file);
  std::size_t removed = 0;
  for (const auto& [file, hash] : before.hashes) {
    const bool plain = std::filesystem::path(file).filename() == file && file.ends_with(".glb");
    if (!plain || wanted.contains(file)) continue;
    std::error_code ignored;
    removed += std::filesystem::remove(std::filesystem::path(folder) / file, ignored) ? 1U : 0U;
  }
  return removed;
}

void run(const GlobalOptions& global, const BuildOptions& options, SourceFiles& sources,
         lang::Diagnostics& diagnostics) {
  const auto loaded = load_lexicon(global, options.lexicon, options.face, sources, diagnostics);
  if (!loaded) return;
  const program::Program& program = loaded->image.program();
  const auto surface = face_surface(program, options.face, sources, diagnostics);
  if (!surface) return;

  const bool one_file = options.output.ends_with(".glb");
  std::vector<Asset> assets = assets_of(*loaded, one_file, options.output);
  if (assets.empty()) {
    add_failure(diagnostics, {"no_clips", options.lexicon, "the lexicon has no entries", "give it some"});
    return;
  }
  const auto gltf = gltf_options(options, diagnostics);
  if (!gltf) return;
  const std::uint64_t common = common_hash(program, surface->text(), options);
  for (Asset& a : assets) a.hash = asset_hash(common, {&a, 1});
  if (one_file) {
    const std::uint64_t all = asset_hash(common, assets);
    for (Asset& a : assets) a.hash = all;
  }

  const std::filesystem::path folder =
      one_file ? std::filesystem::path(options.output).parent_path() : std::filesystem::path(options.output);
  std::error_code error;
  if (!folder.empty()) std::filesystem::create_directories(folder, error);
  if (error) {
    add_failure(diagnostics, {"cannot_write", folder.string(), error.message(), "give another folder"});
    return;
  }
  const std::string manifest = one_file ? options.output + kBesideOneFile : (folder / kManifest).string();
  const Before before = read_before(manifest);
  std::vector<Job> jobs;
  for (const Asset& a : assets) {
    const std::string path = (folder / a.file).string();
    const auto known = before.hashes.find(a.file);
    if (known != before.hashes.end() && known->second == a.hash && std::filesystem::is_regular_file(path)) continue;
    if (jobs.empty() || !one_file) jobs.push_back({path, {}});
    jobs.back().assets.push_back(&a);
  }
  if (!jobs.empty()) {
    const auto face = read_face(program, *surface, diagnostics);
    if (!face) return;
    const auto rig = bind_face(*face, program, diagnostics);
    if (!rig) return;
    std::vector<const program::Clip*> clips;
    for (const Asset& a : assets) clips.push_back(a.clip);
    warn_not_actuated(program, *rig, clips, options.face, diagnostics);
    for (const Finding& f : make_files(jobs, *face, *rig, program, *gltf))
      add_failure(diagnostics, f.failure, f.severity);
    if (diagnostics.error_count() != 0) return;
  }
  const std::size_t removed = one_file ? 0 : remove_old(folder.string(), before, assets);
  const std::string text = write_manifest(loaded->lexicon, loaded->face, options.face, program, assets);
  if (text != before.text && !write_text(manifest, text, diagnostics)) return;
  if (!options.depfile.empty()) {
    const std::string& target = !options.depfile_target.empty() ? options.depfile_target
                                : one_file                      ? options.output
                                                                : manifest;
    if (!write_text(options.depfile, dependency_rule(target, sources.files_read()), diagnostics)) return;
  }
  if (jobs.empty() && removed == 0)
    fmt::print(told(global), "{}: nothing changed: {} entries are up to date\n", options.output, assets.size());
  else
    fmt::print(told(global), "{}: {} of {} entries made anew{} on {}\n", options.output,
               one_file ? assets.size() : jobs.size(), assets.size(),
               removed != 0 ? fmt::format(", {} removed", removed) : "", options.face);
}

}  // namespace

int build_lexicon(const GlobalOptions& global, const BuildOptions& options) {
  SourceFiles sources(global.stdlib);
  lang::Diagnostics diagnostics;
  run(global, options, sources, diagnostics);
  return finish(global, diagnostics);
}

}  // namespace nms::cli
