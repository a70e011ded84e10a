#pragma once

#include <string_view>

namespace nms::program {

/// Whether the bytes are UTF-8 as Unicode's table 3-7 has it: no overlong forms, no surrogates, nothing past U+10FFFF.
[[nodiscard]] bool is_utf8(std::string_view bytes);

}  // namespace nms::program
