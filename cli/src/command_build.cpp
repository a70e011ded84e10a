#include <cstdio>

#include <fmt/format.h>

#include <nms/runtime/gltf_export.h>
#include <nms/runtime/rig.h>

#include "commands.h"
#include "loading.h"
#include "not_actuated.h"
#include "output_file.h"
#include "report.h"

namespace nms::cli {
namespace {

/// sources -> program -> face -> rig -> GLB, on disk.
void run(const GlobalOptions& global, const BuildOptions& options, SourceFiles& sources,
         lang::Diagnostics& diagnostics) {
  const auto image = load_program(global, options.files, options.face, sources, diagnostics);
  if (!image) return;
  const program::Program& program = image->program();

  std::vector<const program::Clip*> clips;
  for (const std::string& name : options.clips) {
    const program::Clip* clip = find_clip(program, name, options.files.front(), diagnostics);
    if (clip != nullptr) clips.push_back(clip);
  }
  if (clips.size() != options.clips.size()) return;
  if (options.clips.empty())
    for (const program::Clip& c : program.clips) clips.push_back(&c);
  if (clips.empty() && !options.all_targets) {
    add_failure(diagnostics, {"no_clips", options.files.front(), "it has nothing to play",
                              "declare an expression, a timeline, an entry or an utterance; or ask for --all-targets"});
    return;
  }

  const auto face = load_face(program, options.face, sources, diagnostics);
  if (!face) return;
  const auto rig = runtime::bind(*face, program);
  if (!rig) {
    add_failure(diagnostics, rig.error());
    return;
  }
  warn_not_actuated(program, *rig, clips, options.face, diagnostics);
  const auto glb = runtime::export_glb(*face, *rig, program, {options.clips, options.all_targets, options.dense});
  if (!glb) {
    add_failure(diagnostics, glb.error());
    return;
  }
  if (const auto failure = write_file(options.output, *glb)) {
    add_failure(diagnostics, *failure);
    return;
  }
  fmt::print(stderr, "{}: {} clip{} on {}, {} vertices, {:.1f} MB\n", options.output, clips.size(),
             clips.size() == 1 ? "" : "s", options.face, face->skin.surface.rows,
             static_cast<double>(glb->size()) / 1e6);
}

}  // namespace

int build(const GlobalOptions& global, const BuildOptions& options) {
  SourceFiles sources(global.stdlib);
  lang::Diagnostics diagnostics;
  run(global, options, sources, diagnostics);
  return finish(global, diagnostics);
}

}  // namespace nms::cli
