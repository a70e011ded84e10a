#pragma once

#include <string>

#include <nms/program/program.h>

namespace nms::cli {

/// A clip in overbar notation: bars of `_` over the glosses they spread over, the label at the right end, outer uses
/// higher. A use that begins or ends inside a sign snaps to it; one over no sign at all stands over a `-`.
[[nodiscard]] std::string overbar_text(const program::Program& program, const program::Clip& clip);

}  // namespace nms::cli
