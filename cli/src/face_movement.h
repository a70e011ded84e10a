#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include <nms/program/program.h>
#include <nms/runtime/face.h>
#include <nms/runtime/face_scale.h>
#include <nms/runtime/rig.h>

namespace nms::cli {

/// What a channel does to a face at its full value.
struct ChannelMovement {
  std::string unit;   ///< "AU12L"; of an axis one of its two units
  std::string title;  ///< "Lip Corner Puller"
  double largest_m = 0.0;
  glm::dvec3 direction{0.0};  ///< of the largest, unit length
  std::string place;          ///< the landmark nearest to where it is
  double share = 0.0;         ///< of all vertices that move by more than a fifth of the largest [0, 1]
};

/// Every vertex of a face, skin and rigid parts, all in place, one after the other.
class FaceVertices {
 public:
  FaceVertices(const runtime::Face& face, const runtime::Rig& rig);

  [[nodiscard]] std::size_t size() const { return size_; }
  /// @param values  by channel
  /// @param out     size() of them, in the face's coordinates  [m]
  void at(std::span<const float> values, std::span<glm::vec3> out);

 private:
  const runtime::Face& face_;
  const runtime::Rig& rig_;
  runtime::Pose pose_;
  std::vector<glm::vec3> normals_;
  std::size_t size_ = 0;
};

/// A line for each unit that the face can show, axes' units one by one, in the program's order.
/// @param titles  of axes' units (unit_titles.h)
[[nodiscard]] std::vector<ChannelMovement> channel_movements(const program::Program& program, const runtime::Rig& rig,
                                                             FaceVertices& vertices,
                                                             const runtime::Landmarks& landmarks,
                                                             const std::map<std::string, std::string>& titles);

/// Two clips that look the same.
struct Lookalikes {
  std::string first;
  std::string second;
  double largest_m = 0.0;  ///< between any vertex of the one and the same of the other, at any time  [m]
};

/// Pairs of clips no vertex of which is ever further apart than `threshold_m`. Both begin together; the shorter one is
/// at its end for the rest of the longer one. Looked at 25 times a second.
[[nodiscard]] std::vector<Lookalikes> lookalikes(const program::Program& program,
                                                 std::span<const program::Clip* const> clips, FaceVertices& vertices,
                                                 double threshold_m);

}  // namespace nms::cli
