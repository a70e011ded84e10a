#pragma once

#include "schedule.h"

/// What causes must not do at the same time. Which units exclude one another, and which entries compete, is declared in
/// the library: `antagonists`, `contrary` and `longest` of an `au`, `competes` and `before` of an `entry`.
namespace nms::compiler {

/// A pose gives way to one that comes after it, over a later span and in the same layer, with units that exclude its
/// own: it goes where the other begins to come and is at rest where the other is at its apex. A topic's raised brows
/// are gone when the question's are down (NCSLGR: raised to lowered directly in 37 of 37 cases). Contrary units give
/// way between entries only. Depends on times alone.
void give_way(ClipDraft& clip, const Channels& channels);

/// Reports what is still held against one another once all has given way, and entries that compete.
void check_competition(const ClipDraft& clip, const Scope& scope, Evaluator& evaluator);

}  // namespace nms::compiler
