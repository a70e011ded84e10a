#pragma once

#include <string>
#include <vector>

namespace nms::cli {

/// A rule in Make's syntax that Ninja reads too: `target: dependencies`, blanks and other special characters escaped.
[[nodiscard]] std::string dependency_rule(const std::string& target, const std::vector<std::string>& dependencies);

}  // namespace nms::cli
