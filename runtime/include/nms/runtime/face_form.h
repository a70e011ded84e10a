#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include <nms/program/program.h>

namespace nms::runtime {

/// What a face's declaration says of the file of its geometry: how the file counts, which of it is what part of the
/// face, and where the named places are.
struct FaceForm {
  struct Part {
    program::FacePartKind kind = program::FacePartKind::skin;
    std::string name;         ///< of a group, object, mesh, material or surface; * stands for any text; empty: any
    std::uint32_t first = 0;  ///< vertices of the file, in its order, from 0
    std::uint32_t last = 0xFFFFFFFFU;
  };
  struct Place {
    std::string name;                       ///< "nose_tip", "brow_inner_L"
    std::uint32_t vertex = program::kNone;  ///< of the file; kNone: `position` says where
    std::string surface;                    ///< not empty: `position` is (u, v, 0) on it, shares of its domain
    glm::dvec3 position{0.0};               ///< in the face's coordinates                                       [m]
  };

  double unit_m = 1.0;
  program::Axis up = program::Axis::y;
  program::Axis forward = program::Axis::z;
  glm::dvec3 origin{0.0};  ///< what is at the face's origin: taken off, once turned and in metres                 [m]
  bool bounded = false;    ///< the skin is what lies between `low` and `high`
  glm::dvec3 low{0.0};     ///< in the face's coordinates                                                         [m]
  glm::dvec3 high{0.0};
  std::vector<Part> parts;  ///< the first that fits counts; none at all: everything is skin
  std::vector<Place> landmarks;
};

/// The form of the face that a program was compiled for; of none, the form of a file that needs no words.
[[nodiscard]] FaceForm face_form(const program::Program& program);

/// The file's coordinates to the face's: metres, +x the subject's left, +y up, +z forward.
[[nodiscard]] glm::dmat4 file_to_face(const FaceForm& form);

/// Whether the text fits the pattern, in which * stands for any text.
[[nodiscard]] bool fits(std::string_view pattern, std::string_view text);

}  // namespace nms::runtime
