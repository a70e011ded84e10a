#pragma once

#include <string>

#include "emit.h"
#include "movement.h"

namespace nms::compiler {

/// Checks muscles, the muscles that AUs drive, and the landmarks of one face, and puts them into the draft.
/// @param face_name  of the face; empty: the first one declared
void build_rig(const std::string& face_name, Evaluator& evaluator, Emitter& emitter);

}  // namespace nms::compiler
