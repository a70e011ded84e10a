#pragma once

#include <span>

#include <nms/program/program.h>

#include "morph_targets.h"

namespace nms::runtime {

/// Adds targets to a mesh until, in every clip, what the others lack is below a share of `error_m`; the rest is for
/// keys. Named after the landmark where the most was lacking.
/// @param most  so many are added, if it takes them
void add_residual_targets(MorphTargets& morphs, ClipStage& stage, MorphedMesh& m,
                          std::span<const program::Clip* const> clips, double error_m, std::size_t most);

/// How far a key's weight may be off, one for each target of the mesh.
/// @param error_m  what the export was asked to hold, or 0
[[nodiscard]] std::vector<double> key_tolerances(const MorphedMesh& m, double error_m);

}  // namespace nms::runtime
