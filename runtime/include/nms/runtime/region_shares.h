#pragma once

#include <string_view>
#include <vector>

#include <nms/runtime/face.h>

namespace nms::runtime {

/// How much of each of the skin's vertices belongs to a region: V shares in [0, 1], summed along the rows of T; 0
/// throughout where the face has no region of that name.
[[nodiscard]] std::vector<float> region_shares(const Face& face, std::string_view region);

}  // namespace nms::runtime
