#pragma once

#include <string>

#include <nms/program/program.h>

namespace nms::cli {

/// A clip as a picture for a paper: time axis, uses of entries as bars, signs, phases, then the curves by track.
/// Curves are the program's own cubics, not samples. The same program gives the same bytes.
/// @param width  of the picture [px], at least 400
[[nodiscard]] std::string plot_svg(const program::Program& program, const program::Clip& clip, int width);

}  // namespace nms::cli
