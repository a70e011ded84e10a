#pragma once

#include <vector>

#include "schedule.h"

namespace nms::compiler {

/// What a face does by itself: puts the ambient that `ambient NAME` in one of the blocks asks for into a clip in which
/// everything else has been placed, within the times that it has, on the ambient layer. Which times are drawn depends
/// on the seed, the clip's name and the ambient alone, so that an edit elsewhere moves no blink; one that comes too
/// near to language is left out. Without `ambient` nothing happens. Reports what is wrong.
void place_ambient(ClipDraft& clip, const std::vector<lang::NodeRef>& blocks, const Scope& scope, Evaluator& evaluator);

/// Reports what is wrong with an ambient that may never be used.
void check_ambient(const Declaration& ambient, Evaluator& evaluator);

}  // namespace nms::compiler
