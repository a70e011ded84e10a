#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <glm/vec3.hpp>

#include <nms/runtime/face.h>

namespace nms::runtime {

/// A row of teeth with its gums, as a solid that soft parts keep out of: everything behind the front of the arch, on
/// the gums' side of the teeth's edge. In the face's coordinates with its frame at rest.
///
/// The front is a table of distances from a vertical axis behind the arch, by direction and height.
struct TeethWall {
  static constexpr int kColumns = 64;
  static constexpr int kRows = 24;

  bool exists = false;
  bool upper = false;  ///< solid above its edge; a lower row below it
  Frame frame = Frame::head;
  double back_z = 0.0;                  ///< the axis stands at x = 0 and this z      [m]
  double bottom_y = 0.0;                ///< of the first row                         [m]
  double row_height = 0.0;              ///<                                          [m]
  double rounding = 0.0006;             ///< of the teeth's edges, so that a lip slides over them [m]
  double largest = 0.0;                 ///< of all radii                             [m]
  std::vector<float> radius;            ///< kRows x kColumns              [m]
  std::array<double, kColumns> edge{};  ///< y of the teeth's edge         [m]

  /// A way out of the solid, grown by `room`; none outside it. Continuous; the shortest but for what is about as deep
  /// behind the front as behind the edge. Of room that is above none a share is taken: what was deeper stays deeper.
  [[nodiscard]] glm::dvec3 push(glm::dvec3 p, double room) const;

  /// Whether push() of a point there may be other than none: it is no further out than the furthest tooth.
  [[nodiscard]] bool reaches(double x, double z, double room) const {
    const double ahead = z - back_z;
    const double reach = largest + room;
    return exists && ahead > 0.0 && x * x + ahead * ahead < reach * reach;
  }

  /// Along is -1 at the far right, 0 in front, 1 at the far left.
  [[nodiscard]] double radius_at(double along, double y) const;
  [[nodiscard]] double edge_at(double along) const;
};

/// The wall of every mesh of that frame whose name begins with "teeth" or "gums".
[[nodiscard]] TeethWall make_teeth_wall(const Face& face, Frame frame);

/// Where the lips stand, column by column along x: the upper one's lowest vertex, the lower one's highest, and the line
/// between them.
struct LipLine {
  static constexpr int kSide = 20;  ///< columns of one side

  double width = 0.00175;                  ///< of a column, on the reference face [m]
  std::array<double, 2 * kSide> low{};     ///< y                            [m]
  std::array<double, 2 * kSide> high{};    ///< y                            [m]
  std::array<double, 2 * kSide> middle{};  ///< y, level beyond the corners  [m]

  /// The line at x, straight between the columns' middles. [m]
  [[nodiscard]] double height_at(double x) const;
};

}  // namespace nms::runtime
