#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <glm/vec3.hpp>

#include <nms/runtime/face.h>
#include <nms/runtime/face_scale.h>

namespace nms::fit_muscles {

/// What a pose does to a face at rest, in the same figures as UnitFigures.
struct UnitMovement {
  double largest_mm = 0.0;    ///< of the visible skin's left half
  glm::dvec3 direction{0.0};  ///< unit length; 0 where nothing moves
  glm::dvec3 place{0.0};      ///< where, at rest                                                       [m]
  double area = 0.0;          ///< share of the face's surface that moves by more than a fifth of that  [0, 1]
  double gap_mm = 0.0;        ///< change of the distance between the lips, in the middle
  double width = 0.0;         ///< change of the mouth's width, from corner to middle, as a share of that at rest
  double opening = 0.0;       ///< of the left eye, seen from the front, of that at rest
};

/// Measures a face: what of it can be seen, where lips and lids have their edges, is found once.
class MovementGauge {
 public:
  /// @param face  kept by reference; has the regions lip_upper, lip_lower, lining, lid_upper_left, lid_lower_left for
  ///              what they measure; without them gap and opening are 0
  MovementGauge(const runtime::Face& face, const runtime::Landmarks& landmarks);

  /// @param positions  V, of a pose [m]
  [[nodiscard]] UnitMovement measure(std::span<const glm::vec3> positions) const;

  /// The same, changing smoothly with the positions, as a fit needs it: size, direction and place are means over the
  /// vertices weighted by |d|^p (which is below the largest by a few percent), the area counts a triangle by a smooth
  /// step about the threshold.
  [[nodiscard]] UnitMovement measure_smoothly(std::span<const glm::vec3> positions) const;

  /// The visible vertex of the left half, or of the midline, that is nearest to a place at rest.
  [[nodiscard]] std::uint32_t nearest(const glm::dvec3& place) const;

  [[nodiscard]] const std::vector<glm::dvec3>& rest() const { return rest_; }

 private:
  using Triangle = std::array<std::uint32_t, 3>;

  void find_visible(const runtime::Face& face, const runtime::Landmarks& landmarks);
  void find_edges(const runtime::Face& face, const runtime::Landmarks& landmarks);
  void measure_edges(std::span<const glm::vec3> positions, UnitMovement& m) const;
  template <typename Points>
  double lip_gap_mm(const Points& p) const;
  template <typename Points>
  double lid_area(const Points& p) const;

  std::vector<glm::dvec3> rest_;     // V
  std::vector<Triangle> triangles_;  // of the skin, without shells
  std::vector<std::uint32_t> left_;  // visible vertices of the left half
  std::vector<double> left_area_;    // that each stands for                                  [m^2]
  std::vector<std::uint32_t> face_;  // triangles that count for the area
  std::vector<double> face_area_;    // of each                                               [m^2]
  double whole_ = 0.0;               // their sum                                             [m^2]
  std::vector<std::uint32_t> upper_lip_, lower_lip_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> lids_;  // upper, lower
  std::uint32_t corner_ = 0;                                   // of the mouth; 0 where the face tells no landmark
  double rest_gap_mm_ = 0.0;
  double rest_lids_ = 0.0;
};

/// Between two directions. [deg]
[[nodiscard]] double degrees_between(const glm::dvec3& a, const glm::dvec3& b);

}  // namespace nms::fit_muscles
