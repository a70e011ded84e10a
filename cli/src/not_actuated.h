#pragma once

#include <nms/lang/diagnostic.h>
#include <nms/program/program.h>
#include <nms/runtime/rig.h>

namespace nms::cli {

/// Warns of every action unit that the clips use and the face cannot show: never silently dead.
void warn_not_actuated(const program::Program& program, const runtime::Rig& rig,
                       const std::vector<const program::Clip*>& clips, const std::string& face,
                       lang::Diagnostics& diagnostics);

}  // namespace nms::cli
