#pragma once

#include <optional>

#include <nms/lang/diagnostic.h>
#include <nms/runtime/gltf_export.h>

#include "commands.h"

namespace nms::cli {

/// What the command was asked for, without the clips. Nothing: a length could not be read, and that has been said.
[[nodiscard]] std::optional<runtime::GltfOptions> gltf_options(const BuildOptions& options,
                                                               lang::Diagnostics& diagnostics);

}  // namespace nms::cli
