#pragma once

#include <functional>

#include <nms/program/program.h>
#include <nms/runtime/face.h>

#include "model.h"

namespace nms::fit_face {

/// Moves control points, as little as it takes, until no triangle of the skin turns over: at rest, under any unit, any
/// pair, and mixtures. What a face does under its muscles depends on where its control points rest, and beside a crease
/// (corners of mouth and eyes, the fold beside the nose) a tenth of a millimetre decides.
///
/// @param program  the muscles
/// @param face_of  the face that a model makes; its first vertices are the model's own, in their order
void unfold(Model& model, const program::Program& program, const std::function<runtime::Face(const Model&)>& face_of);

}  // namespace nms::fit_face
