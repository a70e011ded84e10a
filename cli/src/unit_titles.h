#pragma once

#include <map>
#include <string>

#include "source_files.h"

namespace nms::cli {

/// Titles of action units as their declarations give them: "AU51" -> "Head Turn Left". A program keeps them for
/// channels, and an axis is one channel of two units. Of several declarations the first counts, by the names of their
/// files.
/// @param sources  all .nms files that were read so far are looked at
[[nodiscard]] std::map<std::string, std::string> unit_titles(const SourceFiles& sources);

}  // namespace nms::cli
