#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <nms/program/program.h>

#include "clip_stage.h"
#include "linear_mesh.h"
#include "vertex_grid.h"

namespace nms::runtime {

/// One morph target: a channel at +1, or at -1 for the second AU of an axis.
struct MorphTarget {
  std::uint32_t channel = 0;
  float sign = 1.0F;
  std::string name;
};

/// Targets move points along chords, but lids and jaw turn. With a and b the first and second derivative (halved) of a
/// vertex by the share U of the whole turn, a target of share u moves it by u a + u^2 b. The turn U = sum w u wants
/// U a + U^2 b. What lacks is (U^2 - sum w u^2) b; and the surface half-way less half of the surface at the end is
/// -b/4. So a target with that shape and the weight 4 (sum w u^2 - U^2) mends it to second order, whatever AUs are
/// mixed. Where the runtime stops the lid at contact or the jaw at its limit, targets go on; a second one takes the
/// excess back. Where lids that are shut hold against the gaze, targets fall short, and a third goes the rest of the
/// way.
struct TurnCorrection {
  enum class Kind : std::uint8_t { lid_bend, lid_contact, lid_shut, jaw_bend, jaw_limit };
  Kind kind = Kind::lid_bend;
  std::size_t eye = 0;
  std::string name;
  /// The target holds so much of the shape above that no clip asks for more than a weight of 1: what shows a face may
  /// stop there.
  double whole = 1.0;
};

/// The unit of what normals may lack, as a length: 3 degrees of the shortest that counts, and some room for keys.
inline constexpr float kNormalLack = 0.021F;

/// A node whose mesh has targets.
struct MorphedMesh {
  std::string name;
  int node = -1;
  std::optional<std::size_t> part;  ///< index into Face::rigid; none: the skin
  std::vector<MorphTarget> targets;
  std::vector<TurnCorrection> corrections;  ///< after the targets
  std::vector<std::string> residuals;       ///< after the corrections
  LinearMesh linear;                        ///< all of them
  std::optional<ResidualBasis> basis;       ///< of the residuals, in units of what may be lacking
  std::optional<VertexGrid> grid;           ///< what the file rounds to
  double lack_m = 0.0;                      ///< that unit of positions                              [m]
  float lack_turn = kNormalLack;            ///< and of normals, as a length

  [[nodiscard]] std::size_t count() const { return targets.size() + corrections.size() + residuals.size(); }
  /// Where the pose keeps it.
  [[nodiscard]] const std::vector<glm::vec3>& posed(const Pose& pose) const {
    return part ? pose.parts[*part] : pose.positions;
  }
  [[nodiscard]] const std::vector<glm::vec3>& posed_normals(const Pose& pose) const {
    return part ? pose.part_normals[*part] : pose.normals;
  }
};

/// What targets a file of these clips has, and their weights at any moment.
class MorphTargets {
 public:
  /// @param all  targets of every actuated AU, not only of those the clips use
  MorphTargets(ClipStage& stage, std::span<const program::Clip* const> clips, bool all);

  std::vector<MorphedMesh>& meshes() { return meshes_; }
  /// None: the mesh has no targets.
  MorphedMesh* mesh_of(std::optional<std::size_t> part);

  /// Weights of targets and corrections for the values last evaluated; residuals 0.
  void straight_weights(const MorphedMesh& m, std::span<float> weights);
  /// Whether no target has any weight for the values last evaluated: the mesh stands as the file has it.
  [[nodiscard]] bool at_rest(const MorphedMesh& m) const;
  /// Weights of everything at a moment. The mesh may get no more targets after the first call.
  void weights_at(const MorphedMesh& m, const program::Clip& clip, std::int64_t time_ns, std::span<float> weights);
  /// Poses the surface of the values last evaluated, and says what is lacking there with these weights: V positions,
  /// then V normals, in units of what may be lacking.
  ///
  /// Of a normal that is summed up only the direction counts. It is compared with the true one at about its own
  /// length; so what is lacking is, to first order, a turn.
  void find_lacking(const MorphedMesh& m, std::span<const float> weights);
  [[nodiscard]] const std::vector<glm::vec3>& lacking() const { return lacking_; }

 private:
  /// Where the pose's lids and jaw stand, as shares of their whole turn.
  struct Turns {
    std::array<double, kEyeCount> lid{};
    double jaw = 0.0;
  };

  bool used(std::uint32_t channel, float sign) const;
  template <typename Moves>
  std::vector<MorphTarget> choose_targets(Moves moves) const;
  void choose_corrections();
  void make_meshes();
  Turns turns_of_values();
  double jaw_angle() const;
  float target_weight(const MorphTarget& target) const;
  double correction_weight(const TurnCorrection& correction, const Turns& now) const;
  void pose_correction(const TurnCorrection& correction, double u);
  [[nodiscard]] bool rides_by_targets(std::uint32_t part) const;
  bool turns_jaw(std::uint32_t channel);
  /// From rest to the pose as it stands.
  LinearMesh::Target straight_target(const MorphedMesh& m);
  LinearMesh::Target straight_correction(const MorphedMesh& m, const TurnCorrection& correction);

  ClipStage& stage_;
  std::span<const program::Clip* const> clips_;
  bool all_;
  std::vector<MorphTarget> skin_targets_;
  std::vector<Turns> target_turns_;  // one for each skin target, at full weight
  std::vector<TurnCorrection> corrections_;
  double jaw_turn_ = 0.0;  // the widest hinge of the jaw [rad]
  std::vector<MorphedMesh> meshes_;
  std::vector<glm::vec3> lacking_;
  struct {
    const MorphedMesh* mesh = nullptr;
    std::vector<float> values;
    std::vector<float> weights;
  } last_;  // of weights_at()
};

/// A target that moves nothing.
[[nodiscard]] LinearMesh::Target still_target(const MorphedMesh& m);
/// What is shorter than rounding is written as none: it decides how many vertices a target stores.
[[nodiscard]] LinearMesh::Target without_dust(LinearMesh::Target target);

}  // namespace nms::runtime
