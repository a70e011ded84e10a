#pragma once

#include <span>
#include <string_view>

namespace nms::stdlib {

/// One file of the standard library, as it stands in the source tree.
struct EmbeddedFile {
  std::string_view path;  ///< relative to `stdlib/`, with `/`: "lexicons/asl.nms"
  std::string_view text;  ///< its bytes; static storage
};

/// Every `.nms` and `.x3d` file of the standard library, ordered by path (bytewise). Always the same span.
[[nodiscard]] std::span<const EmbeddedFile> embedded_files();

}  // namespace nms::stdlib
