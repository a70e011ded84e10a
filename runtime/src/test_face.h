#pragma once

#include <nms/program/program.h>
#include <nms/runtime/face.h>

/// A small polygon face for the tests of this room, mirrored bit by bit, with every region and frame, and a program
/// with every kind of muscle and axis on it.
namespace nms::runtime {

inline constexpr double kTestEyeRadius = 0.0155;  ///< lids rest on this sphere or farther out [m]

[[nodiscard]] Face test_face();

/// @param clips text of clips, in the program's text form; may be empty
[[nodiscard]] program::Image test_program(const char* clips = "");

/// Index of the point at the mirrored place, for each point of the skin.
[[nodiscard]] std::vector<std::uint32_t> mirrored_points(const Face& face);

}  // namespace nms::runtime
