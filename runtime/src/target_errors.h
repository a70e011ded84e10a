#pragma once

#include <nms/program/program.h>
#include <nms/runtime/gltf_export.h>

#include "animation_keys.h"
#include "morph_targets.h"

namespace nms::runtime {

/// The file's keys against the runtime, at every moment: raises `error` to what is found.
void measure_clip(ClipStage& stage, const program::Clip& clip, const MorphedMesh& m, const Keys& keys,
                  GltfClipError& error);

/// Every target of an action unit alone, at its full weight, against the runtime.
void measure_targets(ClipStage& stage, const MorphedMesh& m, std::vector<GltfTargetError>& errors);

}  // namespace nms::runtime
