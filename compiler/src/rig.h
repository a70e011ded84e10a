#pragma once

#include <string>

#include "emit.h"
#include "movement.h"

namespace nms::compiler {

/// Checks muscles, the muscles that AUs drive, and one face, and puts them into the draft.
/// @param face_name  of the face; empty: the first one declared
void build_rig(const std::string& face_name, Evaluator& evaluator, Emitter& emitter);

/// The face's geometry, parts and landmarks.
void build_face(const Declaration& face, Evaluator& evaluator, Emitter& emitter);

/// Three lengths, in metres. False: they are none, and that has been said.
bool read_place(lang::NodeRef node, const Scope& scope, Evaluator& evaluator, float (&out)[3]);

}  // namespace nms::compiler
