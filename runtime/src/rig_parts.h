#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <glm/vec3.hpp>
#include <tl/expected.hpp>

#include <nms/program/failure.h>
#include <nms/program/program.h>
#include <nms/runtime/face.h>
#include <nms/runtime/face_file.h>
#include <nms/runtime/face_scale.h>
#include <nms/runtime/rig.h>

namespace nms::runtime {

/// Binding a program's actuation to a face, step by step: fills the rig's tables.
struct RigParts {
  RigParts(const Face& of_face, const program::Program& of_program, std::vector<RigGap>* into)
      : face(of_face),
        program(of_program),
        gaps(into),
        landmarks(landmarks_of(of_face, of_program)),
        scale(face_scale(landmarks)) {}

  const Face& face;
  const program::Program& program;
  std::vector<RigGap>* gaps;
  Landmarks landmarks;
  FaceScale scale;
  std::vector<program::Muscle> muscles;  ///< the program's, their lengths those of this face
  RigTables rig;

  /// A vertex of the skin that can be seen, and the triangles about it: twice their area along their normals.
  struct SkinNormal {
    glm::dvec3 place{0.0};  ///< at rest [m]
    glm::dvec3 area{0.0};   ///< [m2]
    bool hidden = false;    ///< the mouth's lining
  };

  std::optional<program::Failure> check_face() const;
  std::optional<program::Failure> check_place() const;
  void scale_muscles();
  std::optional<program::Failure> read_muscle(std::uint32_t index, std::span<const glm::dvec3> normals,
                                              std::span<const SkinNormal> skin);
  /// Whether it is a gap that may stand: the caller goes on without the muscle or axis.
  bool may_lack(const program::Failure& failure, RigGap gap);
  std::optional<program::Failure> make_eye_lids(std::size_t index);
  tl::expected<glm::dvec3, program::Failure> landmark(const program::Muscle& muscle, program::StringId name);
  tl::expected<const std::vector<float>*, program::Failure> region(const program::Muscle& muscle,
                                                                   program::StringId name);
  tl::expected<std::vector<float>, program::Failure> weights(const program::Muscle& muscle);
  std::vector<glm::dvec3> point_normals() const;
  std::vector<SkinNormal> outer_skin() const;
  /// `normals` of the points, those that the bulge reaches replaced by the direction in which it pushes them.
  std::vector<glm::dvec3> bulge_directions(const program::Muscle& muscle, const MusclePlaces& places,
                                           std::span<const glm::dvec3> normals,
                                           std::span<const SkinNormal> skin_normals) const;
  std::optional<program::Failure> read_muscles();
  std::optional<program::Failure> read_eyelid(std::uint32_t index, const glm::dvec3& centre, const glm::dvec3& margin);
  std::optional<program::Failure> read_hinge(std::uint32_t index, const glm::dvec3& axis);
  std::string face_region(const program::Muscle& muscle) const;
  std::optional<std::uint32_t> part_named(std::string_view name) const;
  void bend_part(std::uint32_t index, std::uint32_t mesh);
  bool make_spine(std::uint32_t mesh);
  std::optional<program::Failure> make_lids();
  void make_lips();
  void make_contacts();
  double lip_column_width(std::span<const glm::dvec3> places) const;
  void make_eyeballs(std::span<const glm::dvec3> places);
  std::optional<program::Failure> read_axes();
  void make_pivots();
  void make_head_share();
  void mark_actuated();
  void make_moving_surface();

  std::string name_of(const program::Muscle& muscle) const {
    return fmt::format("muscle {}", program.string(muscle.name));
  }
  bool lower_lid(const program::Muscle& muscle) const {
    return program.string(muscle.region).find("lower") != std::string_view::npos;
  }
  std::string missing;  ///< the place or region that was looked for last and is not there
  std::array<bool, kEyeCount> has_eye{};
  std::array<double, kEyeCount> margin_x{};
  std::vector<std::pair<std::uint32_t, std::size_t>> eyelids;  // muscle, eye
};

/// A point whose share of a lid or lip is at least this belongs to its edge.
inline constexpr float kMarginShare = 0.99F;

inline double dot(glm::dvec3 a, glm::dvec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline std::size_t index_of(Frame frame) { return static_cast<std::size_t>(frame); }

/// x away from the midline on the muscle's side.
inline glm::dvec3 sided(const float (&offset)[3], program::Side side) {
  const double sign = side == program::Side::right ? -1.0 : 1.0;
  return {sign * static_cast<double>(offset[0]), offset[1], offset[2]};
}

/// The frame an axis or a hinge moves; of the eyes, the left one.
std::optional<Frame> moved_frame(program::Frame frame);

/// Where the lower lip stands above the upper one, each gives way by half.
void part_lips(const Rig& rig, Pose& pose);

/// The line between the lips where these vertices stand.
void find_lip_line(std::span<const RigTables::LipVertex> lips, std::span<const glm::vec3> positions, LipLine& line);

/// Positions and normals of every vertex, those that no muscle moves too.
void make_whole_surface(const Face& face, const Rig& rig, Pose& pose);

/// Holds independent points out of the teeth, with room to spare. Needs motions.
void hold_points_off_teeth(const Rig& rig, Pose& pose);

glm::dvec3 transform(const Placement& placement, glm::dvec3 p);

/// The jaw's movement in the head's coordinates.
Placement jaw_in_head(const Rig& rig, const Pose& pose);

/// Pulls at the lids given up to the lids' own turn; points kept outside the eyeball. Needs `pose.lids`.
void move_lids(const Face& face, const Rig& rig, Pose& pose);

}  // namespace nms::runtime
