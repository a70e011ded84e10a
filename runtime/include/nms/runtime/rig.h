#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include <tl/expected.hpp>

#include <nms/program/failure.h>
#include <nms/program/program.h>
#include <nms/runtime/contact.h>
#include <nms/runtime/face.h>
#include <nms/runtime/mesh_normals.h>
#include <nms/runtime/muscle.h>
#include <nms/runtime/sparse_matrix.h>

namespace nms::runtime {

/// A rig is a program's actuation bound to one face: all that does not depend on time, computed once.
///
/// A frame's way: channel values -> contractions -> displacements of the independent points -> lids (one final angle
/// each, stopped at contact) -> jaw -> surface T x + offsets -> normals -> rigid frames (head, torso) on top.

inline constexpr std::size_t kFrameCount = 5;  ///< runtime::Frame's values
inline constexpr std::size_t kEyeCount = 2;    ///< left, right

/// Steps along a mesh that bends.
inline constexpr int kSpineSteps = 24;

/// A frame's movement in its parent: turns about its pivot, then shifts. Rest is the identity.
struct FrameMotion {
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0};  ///< unit, w >= 0 for turns up to 180 deg
  glm::dvec3 translation{0.0};              ///< [m]
};

/// A rigid movement in the face's coordinates: x -> rotation x + translation.
struct Placement {
  glm::dmat3 rotation{1.0};
  glm::dvec3 translation{0.0};  ///< [m]
};

/// How far one eye's lids are turned, as shares of the turn that shuts the eye: 0 rest, upper + lower = 1 shut,
/// negative is wider open. `upper` counts down, `lower` up.
struct LidState {
  double upper = 0.0;
  double lower = 0.0;
  double sideways = 0.0;  ///< skin drawn along by the eyeball, about the vertical, + to the left  [rad]
};

/// What a face cannot do, because it lacks a place or a region: one muscle, or one axis.
struct RigGap {
  std::uint32_t muscle = program::kNone;   ///< index into the program's muscles, or kNone
  std::uint32_t channel = program::kNone;  ///< the axis, where it is no muscle
  bool is_region = false;                  ///< a region is missing, else a landmark
  std::string name;                        ///< as the muscle says it, "_L" or "_R" added where it has a side
};

/// What binding computes, as tables: what the functions below run over.
struct RigTables {
  /// One eye's lid point: turned about the eyeball's centre by upper x upper_angle + lower x lower_angle.
  struct LidPoint {
    std::uint32_t point = 0;
    double upper_angle = 0.0;  ///< turn at upper = 1; + down                                          [rad]
    double lower_angle = 0.0;  ///< turn at lower = 1; - is up                                         [rad]
    double hold = 0.0;         ///< share of other muscles' pull that the point does not take          [0, 1]
    double drawn = 0.0;        ///< share of the sideways turn                                         [0, 1]
  };
  /// A vertex of the skin near an eyeball, and how near to the eyeball's centre it may come.
  struct EyeVertex {
    std::uint32_t vertex = 0;
    double least = 0.0;  ///< [m]
  };
  struct Eye {
    glm::dvec3 centre{0.0};
    std::vector<LidPoint> points;
    double closing_angle = 0.0;  ///< turn that shuts the eye in its middle                            [rad]
    double radius = 0.0;         ///< of the eyeball, cornea included; 0: the face has none            [m]
    std::vector<EyeVertex> vertices;
  };
  /// A muscle that turns a lid.
  struct LidDrive {
    std::uint32_t muscle = 0;
    std::uint8_t eye = 0;  ///< 0 left, 1 right
    bool upper = true;
    double fraction = 0.0;  ///< of the closing turn at full activation
  };
  /// A muscle that moves a frame.
  struct HingeDrive {
    std::uint32_t muscle = 0;
    Frame frame = Frame::jaw;
    double angle = 0.0;     ///< about x, + opens                                                     [rad]
    double yaw = 0.0;       ///< about y, + to the left                                               [rad]
    glm::dvec3 slide{0.0};  ///< [m]
  };
  /// An axis that moves a frame: value * full_scale, by the right-hand rule about +x, +y, +z.
  struct AxisDrive {
    std::uint32_t channel = 0;
    program::Motion motion = program::Motion::none;
    program::Frame frame = program::Frame::none;
    double full_scale = 0.0;  ///< [rad] or [m]
  };
  /// What a hinge does to a rigid mesh that its `region` names: the tongue. Its root stays, its tip goes all the way.
  struct PartDrive {
    std::uint32_t muscle = 0;
    std::uint32_t mesh = 0;  ///< index into Face::rigid
    double pitch = 0.0;      ///< + down                                                               [rad]
    double yaw = 0.0;        ///< + to the left                                                        [rad]
    glm::dvec3 slide{0.0};   ///< of the tip                                                           [m]
    double reach = 0.0;      ///< the turn takes place over so much of the length, from the tip; 0: all [m]
  };
  /// A mesh that bends along its length, z at rest.
  struct Spine {
    std::uint32_t mesh = 0;
    double back_z = 0.0;                           ///< of the rearmost vertex                        [m]
    double length = 0.0;                           ///< [m]
    std::array<double, kSpineSteps + 1> height{};  ///< y of the middle, from back to front           [m]
    std::array<double, kSpineSteps + 1> half{};    ///< half the height of what stands across it      [m]
    std::array<double, kSpineSteps + 1> wide{};    ///< half its width                                [m]
  };
  /// A point's share of the jaw's movement.
  struct JawPoint {
    std::uint32_t point = 0;
    double weight = 0.0;
  };

  /// A place along the mouth where upper and lower lip meet: the lowest point of the one, the highest of the other.
  struct LipColumn {
    double x = 0.0;           ///< at rest, ascending                                                  [m]
    std::uint32_t upper = 0;  ///< point
    std::uint32_t lower = 0;  ///< point
    double gap = 0.0;         ///< least distance in y that they may have                              [m]
  };
  /// A lip's point: moves with its column, between two of them.
  struct LipPoint {
    std::uint32_t point = 0;
    std::uint32_t column = 0;  ///< the one before it
    double along = 0.0;        ///< share of the way to the next
    double share = 0.0;        ///< of half of the overlap: + up (upper lip), - down (lower lip)
  };

  /// A vertex of a lip, and how far past the line between the lips it may be.
  struct LipVertex {
    std::uint32_t vertex = 0;
    bool upper = true;
    double slack = 0.0;  ///< [m]
  };
  /// What rests near the teeth, and the room that it keeps to them: less than usual where it rests nearer.
  struct MouthPoint {
    std::uint32_t index = 0;  ///< of a point, or of a vertex
    double room = 0.0;        ///< [m]
  };

  double scale = 1.0;                          ///< of lengths, against the reference face
  double lip_column = 0.00175;                 ///< width of the columns that hold lips apart            [m]
  std::vector<bool> actuated;                  ///< one for each channel
  std::vector<bool> skin;                      ///< one for each channel
  std::vector<program::Actuation> actuations;  ///< ordered by channel, then muscle
  std::vector<float> top;                      ///< one for each muscle: where its contraction saturates
  std::vector<std::uint32_t> pull_begin;       ///< one more than there are muscles
  std::vector<Pull> pulls;                     ///< muscle by muscle, points ascending
  std::array<Eye, kEyeCount> eyes;
  std::vector<LidDrive> lid_drives;
  std::vector<HingeDrive> hinge_drives;
  std::vector<AxisDrive> axis_drives;
  std::vector<PartDrive> part_drives;
  std::vector<Spine> spines;
  std::vector<JawPoint> jaw_points;
  std::vector<LipColumn> lip_columns;
  std::vector<LipPoint> lip_points;
  std::array<TeethWall, 2> walls;  ///< the head's, the jaw's
  std::vector<MouthPoint> mouth_points;
  std::vector<MouthPoint> mouth_vertices;
  std::vector<LipVertex> lip_vertices;
  std::array<glm::dvec3, kFrameCount> pivots{};  ///< by runtime::Frame                               [m]
  std::vector<float> head_share;                 ///< V in [0, 1]
  RowBlocks moving_rows;                         ///< of T: vertices that the rig can move
  NormalSums moving_normals;                     ///< and the normals about them
};

class Rig {
 public:
  explicit Rig(RigTables tables) : tables_(std::move(tables)) {}

  [[nodiscard]] std::size_t channel_count() const { return tables_.actuated.size(); }
  [[nodiscard]] std::size_t muscle_count() const { return tables_.top.size(); }
  /// Whether the channel drives a muscle that moves something, or a frame. What is not actuated is to be reported.
  [[nodiscard]] bool actuated(program::ChannelId channel) const {
    return tables_.actuated[static_cast<std::size_t>(channel)];
  }
  /// Whether it moves the skin itself: these are the channels that need morph targets.
  [[nodiscard]] bool moves_skin(program::ChannelId channel) const {
    return tables_.skin[static_cast<std::size_t>(channel)];
  }
  /// Whether it bends a rigid mesh of the face (the tongue).
  [[nodiscard]] bool moves_part(program::ChannelId channel, std::uint32_t mesh) const;
  /// Where a frame turns. [m]
  [[nodiscard]] glm::dvec3 pivot(Frame frame) const { return tables_.pivots[static_cast<std::size_t>(frame)]; }
  /// V shares in [0, 1]: 1 moves with the head, 0 stays with the torso.
  [[nodiscard]] std::span<const float> head_share() const { return tables_.head_share; }
  /// A muscle's activation set; empty for eyelids and hinges.
  [[nodiscard]] std::span<const Pull> activation(program::MuscleId muscle) const;
  [[nodiscard]] const RigTables& tables() const { return tables_; }

 private:
  RigTables tables_;
};

/// Everything one frame computes; made once for a rig, so that a frame allocates nothing. One for each thread.
struct Pose {
  std::vector<float> contractions;                   ///< M, in [0, top]                                    [-]
  std::array<LidState, kEyeCount> lids;              ///< final, after gaze and contact
  std::array<FrameMotion, kFrameCount> motions;      ///< by runtime::Frame
  std::array<Placement, kFrameCount> placements;     ///< the same, parents included
  std::vector<glm::dvec3> points;                    ///< P, in the head at rest                            [m]
  std::vector<glm::vec3> x;                          ///< P, the same in single precision                   [m]
  std::vector<glm::vec3> positions;                  ///< V, T x + offsets, in the head at rest             [m]
  std::vector<glm::vec3> normals;                    ///< V, unit
  std::vector<double> lip_overlaps;                  ///< one for each lip column                           [m]
  LipLine lip_line;                                  ///< of the vertices, before they are held apart
  std::vector<std::vector<glm::vec3>> parts;         ///< by rigid mesh: its vertices where it bends, else empty [m]
  std::vector<std::vector<glm::vec3>> part_normals;  ///< the same, unit
  NormalScratch scratch;
};

/// Looks up landmarks and regions, computes activation sets, margins, pivots.
///
/// Muscles' lengths count on a face of the reference's size (face_scale.h), and scale with this one.
///
/// @param gaps  not null: what the face cannot do is added there, and the rest is bound
/// Failures: missing_landmark, missing_region (place names the muscle or axis; not with `gaps`), bad_face (a table of
/// the face has the wrong length, or the face stands far from its origin).
[[nodiscard]] tl::expected<Rig, program::Failure> bind(const Face& face, const program::Program& program,
                                                       std::vector<RigGap>* gaps = nullptr);

[[nodiscard]] Pose make_pose(const Face& face, const Rig& rig);

/// Contractions of every muscle for one set of channel values.
///
/// One AU may drive several muscles and one muscle may serve several AUs; shares add, and saturate at full contraction
/// (Barker 2005, 6.3), or at the largest share where that is above 1.
///
/// @param values  C, ordered by ChannelId: AUs in [0, 1], axes in [-1, 1]    [-]
/// @param out     M, ordered by MuscleId                                     [-]
void contractions(const Rig& rig, std::span<const float> values, std::span<float> out);

/// The lids' final turns: muscles and gaze summed, the upper lid stopped where it meets the lower.
void turn_lids(const Rig& rig, std::span<const float> values, std::span<const float> contractions,
               std::span<LidState, kEyeCount> out);

/// Turns and shifts of every frame. Several axes on one frame compose as R = R_y R_x R_z (yaw, pitch, roll), shifts
/// add.
void move_frames(const Rig& rig, std::span<const float> values, std::span<const float> contractions, Pose& pose);

/// Independent points: rest + pulls, lids, jaw, lips kept from passing through one another. Needs contractions, lids
/// and motions of `pose`.
void move_points(const Face& face, const Rig& rig, Pose& pose);

/// Rigid meshes that bend, at rest in their frame. Needs contractions, motions and `lip_line`.
void bend_parts(const Face& face, const Rig& rig, Pose& pose);

/// Holds vertices out of the eyeballs and the teeth, and the lips apart. Needs `pose.positions` and motions.
void hold_vertices_apart(const Rig& rig, Pose& pose);

/// positions and normals from `pose.points`, vertices held apart. Vertices that nothing of the rig can move stay as
/// make_pose() left them.
void make_surface(const Face& face, const Rig& rig, Pose& pose);

/// All of the above in order. Cost O(activated points + non-zeros of T + triangles). No allocation. Safe from many
/// threads, each with a pose of its own.
void pose_face(const Face& face, const Rig& rig, std::span<const float> values, Pose& pose);

/// Skin positions and normals in the face's coordinates: the head's and the torso's movement, shared out by head_share.
/// @param positions, normals  out, V each
void place_skin(const Rig& rig, const Pose& pose, std::span<glm::vec3> positions, std::span<glm::vec3> normals);

}  // namespace nms::runtime
