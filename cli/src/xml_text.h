#pragma once

#include <string>
#include <string_view>

namespace nms::cli {

/// Text as XML may hold it: the five special characters escaped; what XML 1.0 has no way to say is `?`.
[[nodiscard]] std::string xml_escaped(std::string_view text);

}  // namespace nms::cli
