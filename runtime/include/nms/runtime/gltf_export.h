#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include <nms/program/failure.h>
#include <nms/program/program.h>
#include <nms/runtime/face.h>
#include <nms/runtime/rig.h>

namespace nms::runtime {

/// A normal that is off by more counts as askew: 3 degrees.
inline constexpr double kAskew_rad = 3.0 * 3.14159265358979 / 180.0;

struct GltfOptions {
  std::vector<std::string> clips;  ///< names, in the order they are written; empty: every clip of the program
  /// Write targets of every actuated AU, not only of those the clips use. A file that has no clips is driven from
  /// outside, by its targets alone: there what the jaw carries has targets of the jaw's AUs too.
  bool all_targets = false;
  bool dense = false;  ///< plain accessors for morph targets: larger, for importers without sparse ones
  /// Corrective targets are added until, in every clip, no vertex of a mesh with targets is further than this from
  /// where the runtime has it, and no normal turned by more than 3 degrees. 0: only those named below.  [m]
  double max_error_m = 0.0;
  /// Of those, one mesh has so many at most: a file that is smaller, and misses more.
  std::size_t max_corrections = 96;
  /// Vertices in whole numbers: KHR_mesh_quantization, which a reader must know. Less than half of the size.
  bool quantize = false;
};

/// How far a clip of the file is from the runtime's own surface: the targets as a viewer adds them up, at the file's
/// own keys and between them, rounded as the file rounds, against pose_face() at the same moment. Movements of whole
/// nodes are not looked at.
struct GltfClipError {
  std::string clip;
  double largest_m = 0.0;  ///< [m]
  double time_s = 0.0;     ///< on the file's clock
  std::string mesh;
  std::string place;        ///< the nearest landmark at rest
  double normal_rad = 0.0;  ///< largest angle between normals
  double normal_time_s = 0.0;
  std::string normal_mesh;
  std::string normal_place;
  /// Of a mesh's area, what has normals that are off by more than kAskew_rad: the most at one moment, and the mean over
  /// all.  [0, 1]
  double askew_share = 0.0;
  double askew_time_s = 0.0;
  std::string askew_mesh;
  double askew_mean = 0.0;
  std::size_t samples = 0;  ///< moments looked at
};

/// How far a target alone at full weight, as the file rounds it, is from the runtime's surface.
struct GltfTargetError {
  std::string name;
  std::string mesh;
  double largest_m = 0.0;    ///< [m]
  double normal_rad = 0.0;   ///< largest angle between normals
  double askew_share = 0.0;  ///< as above
};

/// How many times as large as was asked for, or as kAskew_rad: above 1 it does not hold.
[[nodiscard]] double error_excess(const GltfClipError& e, double max_error_m);

struct GltfReport {
  std::vector<GltfClipError> clips;      ///< as they are written
  std::vector<GltfTargetError> targets;  ///< of action units
  std::vector<std::string> corrections;  ///< names of the targets that belong to no action unit
};

/// The face as binary glTF 2.0, core only, one animation for each clip.
///
/// Skin: one mesh, one vertex buffer, primitives by material; joints `head` and `torso`; one morph target for each AU
/// and side that moves it (`mesh.extras.targetNames`), an axis giving one for each of its two AUs (`AU63`, `AU64`).
/// Lids and jaw turn, targets go straight: corrective targets (`fix.lid_upper_L.50`, `fix.lid_upper_L.contact`,
/// `fix.lid_upper_L.shut`, `fix.jaw.50`, `fix.jaw.limit`) follow them in the list where a clip needs them, with weights
/// of their own in every clip. Nodes: root -> torso -> head -> {jaw, eye_left, eye_right}, rigid meshes below their
/// frame; metres, +y up, face to +z. Animations: every target's weight and every moving node's rotation and
/// translation, LINEAR keys set where the curve bends: at most 0.2 % of an AU and 0.02 degrees off. Times start at 0;
/// `extras.start_s` says where the clip's own clock stands there. Names are of letters, digits, `_` and `-`, each once;
/// `extras.clip` is the clip's own. A jump becomes a ramp of 1 ms. What a clip does not speak of is at rest.
///
/// With `max_error_m`, `fix.<landmark>.<number>` follow: what the others lack at the worst moments of the clips,
/// weighed so that the sum of squares is least (matching pursuit).
///
/// Parts that bend (the tongue) get such targets without being asked, for 0.5 mm: they are small, and what goes out
/// over the teeth goes by no straight way.
///
/// Weights of corrective targets of the first kind stay within 1: the targets are as large as the clips need them.
///
/// Quantized, positions are 16-bit steps of a grid about the mesh, 5 um wide for a head with shoulders; normals, what
/// targets add to them, and shares of joints are 8-bit ones; weights of targets 16-bit ones where all are within 0
/// and 1. A target leaves vertices out that it moves by 10 um and turns by 0.5 degrees at most. The grid's place and
/// size stand in the skin's inverse bind matrices and the nodes of rigid meshes.
///
/// The same input gives the same bytes on every machine.
///
/// @param report  filled in if not null; costs a frame of the runtime for every 120th of a second of the clips
/// Failures: unknown_clip, too_many_vertices, gltf_writer (the library refused; a defect of ours).
[[nodiscard]] tl::expected<std::vector<std::byte>, program::Failure> export_glb(const Face& face, const Rig& rig,
                                                                                const program::Program& program,
                                                                                const GltfOptions& options,
                                                                                GltfReport* report = nullptr);

}  // namespace nms::runtime
