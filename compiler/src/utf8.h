#pragma once

#include <cstddef>
#include <string_view>

namespace nms::compiler {

/// Where the first byte stands that is not part of well-formed UTF-8; the size, if all are (Unicode 15, table 3-7).
[[nodiscard]] std::size_t first_not_utf8(std::string_view bytes);

}  // namespace nms::compiler
