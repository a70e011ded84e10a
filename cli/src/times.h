#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nms/lang/diagnostic.h>

namespace nms::cli {

/// What stands between the commas of an option, without the blanks about it.
[[nodiscard]] std::vector<std::string_view> split_at_commas(std::string_view text);

/// The times of `--at 0.234,2106ms` in nanoseconds; a plain number is seconds. Nothing: `diagnostics` says why.
[[nodiscard]] std::optional<std::vector<std::int64_t>> read_times(const std::string& text,
                                                                  lang::Diagnostics& diagnostics);

}  // namespace nms::cli
