#include <algorithm>
#include <cstdio>
#include <span>
#include <vector>

#include <fmt/format.h>

#include <nms/runtime/gltf_avatar.h>
#include <nms/runtime/gltf_export.h>
#include <nms/runtime/rig.h>

#include "commands.h"
#include "error_not_held.h"
#include "gltf_options.h"
#include "loading.h"
#include "not_actuated.h"
#include "output_file.h"
#include "report.h"

namespace nms::cli {
namespace {

/// The clips asked for, or all. Nothing: there are none such, and that has been said.
std::vector<const program::Clip*> chosen_clips(const BuildOptions& options, const program::Program& program,
                                               lang::Diagnostics& diagnostics) {
  std::vector<const program::Clip*> clips;
  for (const std::string& name : options.clips) {
    const program::Clip* clip = find_clip(program, name, options.files.front(), diagnostics);
    if (clip != nullptr) clips.push_back(clip);
  }
  if (clips.size() != options.clips.size()) return {};
  if (options.clips.empty())
    for (const program::Clip& c : program.clips) clips.push_back(&c);
  if (clips.empty() && !options.all_targets)
    add_failure(diagnostics, {"no_clips", options.files.front(), "it has nothing to play",
                              "declare an expression, a timeline, an entry or an utterance; or ask for --all-targets"});
  return clips;
}

/// sources -> program -> an avatar that others made, on disk.
void run_on_avatar(const GlobalOptions& global, const BuildOptions& options, SourceFiles& sources,
                   lang::Diagnostics& diagnostics) {
  const auto image = load_program(global, options.files, "", sources, diagnostics, Reuse::program_beside);
  if (!image) return;
  const auto clips = chosen_clips(options, image->program(), diagnostics);
  if (clips.empty()) return;
  const auto avatar = read_file(options.avatar);
  if (!avatar) {
    add_failure(diagnostics, avatar.error());
    return;
  }
  const auto made = runtime::animate_avatar(std::as_bytes(std::span(avatar->data(), avatar->size())), options.avatar,
                                            image->program(), clips);
  if (!made) {
    add_failure(diagnostics, made.error());
    return;
  }
  if (!made->unshown.empty())
    add_failure(
        diagnostics,
        {"not_on_avatar", options.avatar, fmt::format("it has nothing that shows {}", fmt::join(made->unshown, ", ")),
         "add morph targets of those names, or of ARKit's, to the avatar; head, eyes and torso turn by bones "
         "named Head, LeftEye, RightEye and Spine2"},
        lang::Severity::warning);
  if (const auto failure = write_file(options.output, made->glb)) {
    add_failure(diagnostics, *failure);
    return;
  }
  fmt::print(told(global), "{}: {} clip{} on {}: {} targets, {} bones, {:.1f} MB\n", options.output, clips.size(),
             clips.size() == 1 ? "" : "s", options.avatar, made->targets.size(), made->bones.size(),
             static_cast<double>(made->glb.size()) / 1e6);
}

/// One line a clip: how far the file's targets are from the runtime's surface.
void print_errors(const GlobalOptions& global, const runtime::GltfReport& report) {
  for (const runtime::GltfClipError& e : report.clips) {
    fmt::print(told(global), "  {}: max {:.2f} mm", e.clip, e.largest_m * 1000.0);
    if (!e.mesh.empty()) fmt::print(told(global), " at {:.2f} s, {} near {}", e.time_s, e.mesh, e.place);
    fmt::print(told(global), "; normals {:.1f} deg", e.normal_rad * 57.29577951308232);
    if (!e.normal_mesh.empty()) {
      fmt::print(told(global), " at {:.2f} s, {} near {}", e.normal_time_s, e.normal_mesh, e.normal_place);
    }
    fmt::print(told(global), "; above 3 deg {:.2f} % of the area", 100.0 * e.askew_share);
    if (!e.askew_mesh.empty()) fmt::print(told(global), " at {:.2f} s, {}", e.askew_time_s, e.askew_mesh);
    fmt::print(told(global), ", {:.2f} % as a mean", 100.0 * e.askew_mean);
    fmt::print(told(global), "\n");
  }
  const auto worst = std::max_element(report.targets.begin(), report.targets.end(),
                                      [](const auto& a, const auto& b) { return a.askew_share < b.askew_share; });
  if (worst != report.targets.end())
    fmt::print(told(global), "  targets alone: above 3 deg at most {:.2f} % of the area, {} of {}\n",
               100.0 * worst->askew_share, worst->name, worst->mesh);
  if (!report.corrections.empty()) {
    fmt::print(told(global), "  {} corrective target{}\n", report.corrections.size(),
               report.corrections.size() == 1 ? "" : "s");
  }
}

/// sources -> program -> face -> rig -> GLB, on disk.
void run(const GlobalOptions& global, const BuildOptions& options, SourceFiles& sources,
         lang::Diagnostics& diagnostics) {
  const auto image = load_program(global, options.files, options.face, sources, diagnostics, Reuse::program_beside);
  if (!image) return;
  const program::Program& program = image->program();

  const auto clips = chosen_clips(options, program, diagnostics);
  if (clips.empty() && (!options.all_targets || diagnostics.error_count() != 0)) return;

  const auto face = load_face(program, options.face, sources, diagnostics);
  if (!face) return;
  const auto rig = bind_face(*face, program, diagnostics);
  if (!rig) return;
  warn_not_actuated(program, *rig, clips, options.face, diagnostics);
  auto wanted = gltf_options(options, diagnostics);
  if (!wanted) return;
  wanted->clips = options.clips;
  runtime::GltfReport report;
  const bool measured = options.report || wanted->max_error_m > 0.0;
  const auto glb = runtime::export_glb(*face, *rig, program, *wanted, measured ? &report : nullptr);
  if (!glb) {
    add_failure(diagnostics, glb.error());
    return;
  }
  if (const auto failure = write_file(options.output, *glb)) {
    add_failure(diagnostics, *failure);
    return;
  }
  fmt::print(told(global), "{}: {} clip{} on {}, {} vertices, {:.1f} MB\n", options.output, clips.size(),
             clips.size() == 1 ? "" : "s", options.face, face->skin.surface.rows,
             static_cast<double>(glb->size()) / 1e6);
  if (measured) print_errors(global, report);
  if (const auto missed = error_not_held(report, *wanted, options.output))
    add_failure(diagnostics, *missed, lang::Severity::warning);
}

}  // namespace

int build(const GlobalOptions& global, const BuildOptions& options) {
  SourceFiles sources(global.stdlib);
  lang::Diagnostics diagnostics;
  if (options.avatar.empty())
    run(global, options, sources, diagnostics);
  else
    run_on_avatar(global, options, sources, diagnostics);
  return finish(global, diagnostics);
}

}  // namespace nms::cli
