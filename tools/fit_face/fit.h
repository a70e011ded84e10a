#pragma once

#include "model.h"

namespace nms::fit_face {

/// Least squares of all surfaces at once to the half x >= 0 of the scan: the README's steps 1 to 5. Prints what it
/// reaches. Surfaces of the part lid_back get no samples: they are built by rule (lids.h).
Model fit(const Scan& scan, const Layout& layout);

}  // namespace nms::fit_face
