#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include <nms/program/failure.h>
#include <nms/program/program.h>

namespace nms::runtime {

/// An avatar with clips in it, and what it could not take.
struct AnimatedAvatar {
  std::vector<std::byte> glb;
  std::vector<std::string> targets;  ///< names of morph targets that the clips move, each once, in the file's order
  std::vector<std::string> bones;    ///< names of nodes that they turn or shift, in the file's order
  std::vector<std::string> unshown;  ///< action units of the clips that nothing in the avatar shows, in program order
};

/// Writes clips into a binary glTF avatar that others made; not a byte of the rest of the file changes, but for its
/// lengths, and for the matrix of a bone that moves, which becomes translation, rotation and scale.
///
/// Morph targets are found by their names (mesh.extras.targetNames), without case and punctuation, sides being the
/// subject's: ARKit's (all but mouthClose, mouthLeft and mouthRight, which no action unit stands for), FACS names
/// (AU12, AU12_L), and the expressions of VRM 1.0 by name, through their binds. Where a mesh has several names for one
/// movement (AU12 and AU12L, blink and blinkLeft), the one that says it most exactly is used alone. Each node whose
/// mesh has such targets gets its weights; targets that no clip speaks of keep the file's own weights. Bones are found
/// by VRM's humanoid map, else by name (Head, LeftEye, RightEye, Spine2 or UpperChest, with or without `mixamorig:`; a
/// joint whose name ends so, as CC_Base_Head, if there is none), joints of a skin before other nodes. Head and torso
/// axes turn and shift those, on top of their pose at rest and about the world's axes; the gaze turns eye bones unless
/// targets turn the eyeballs already (VRM: as its lookAt says).
///
/// Keys are set as in gltf_export.h. Times start at 0; `extras.start_s` says where the clip's own clock stands there.
///
/// Failures: bad_avatar (not a GLB; broken JSON or hierarchy), no_targets (nothing in it that we know),
/// clip_exists (the avatar has an animation of that name), too_large.
/// @param place  what messages call the file
[[nodiscard]] tl::expected<AnimatedAvatar, program::Failure> animate_avatar(
    std::span<const std::byte> glb, const std::string& place, const program::Program& program,
    std::span<const program::Clip* const> clips);

}  // namespace nms::runtime
