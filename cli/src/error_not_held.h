#pragma once

#include <optional>
#include <string>

#include <nms/program/failure.h>
#include <nms/runtime/gltf_export.h>

namespace nms::cli {

/// Where a file of clips is further from the runtime's own surface than --max-error asked for: the worst clip.
[[nodiscard]] std::optional<program::Failure> error_not_held(const runtime::GltfReport& report,
                                                             const runtime::GltfOptions& options,
                                                             const std::string& file);

}  // namespace nms::cli
