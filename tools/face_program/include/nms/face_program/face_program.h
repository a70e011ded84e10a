#pragma once

#include <optional>
#include <span>
#include <string>
#include <utility>

#include <nms/program/program.h>

namespace nms::face_program {

/// What the fitting tools begin from: the face's muscles and landmarks, and the named units, as a program: sources
/// first, then the library.
/// @param sources  paths and texts
/// @param units    "AU12", "AU12L+AU6"
/// @param said     out: what the compiler had to say
[[nodiscard]] std::optional<program::Image> compile_face(std::span<const std::pair<std::string, std::string>> sources,
                                                         const std::string& face, std::span<const std::string> units,
                                                         std::string& said);

}  // namespace nms::face_program
