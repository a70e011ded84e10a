// A face with a target for every action unit that it can show, and no clip.
#include <cstdio>

#include <fmt/format.h>

#include <nms/runtime/gltf_export.h>

#include "commands.h"
#include "loading.h"
#include "output_file.h"
#include "report.h"

namespace nms::cli {
namespace {

void run(const GlobalOptions& global, const std::string& name, const std::string& output, SourceFiles& sources,
         lang::Diagnostics& diagnostics) {
  const auto image = load_program(global, {}, name, sources, diagnostics);
  if (!image) return;
  const program::Program& program = image->program();
  const auto face = load_face(program, name, sources, diagnostics);
  if (!face) return;
  const auto rig = bind_face(*face, program, diagnostics);
  if (!rig) return;
  runtime::GltfOptions options;
  options.all_targets = true;
  const auto glb = runtime::export_glb(*face, *rig, program, options);
  if (!glb) {
    add_failure(diagnostics, glb.error());
    return;
  }
  if (const auto failure = write_file(output, *glb)) {
    add_failure(diagnostics, *failure);
    return;
  }
  std::size_t shown = 0;
  for (std::uint32_t c = 0; c < program.channels.size(); ++c) shown += rig->actuated(program::ChannelId{c}) ? 1U : 0U;
  fmt::print(told(global), "{}: {}, {} vertices, {} of {} channels, {:.1f} MB\n", output,
             program.string(program.faces[0].name), face->skin.surface.rows, shown, program.channels.size(),
             static_cast<double>(glb->size()) / 1e6);
}

}  // namespace

int face_export(const GlobalOptions& global, const std::string& name, const std::string& output) {
  SourceFiles sources(global.stdlib);
  lang::Diagnostics diagnostics;
  run(global, name, output, sources, diagnostics);
  return finish(global, diagnostics);
}

}  // namespace nms::cli
