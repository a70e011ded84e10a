#pragma once

#include <string>

namespace nms::bench {

/// How many entries the lexicon has.
inline constexpr int kEntries = 150;

/// A lexicon called `bench`: all of asl with what it inherits, and as many of SiGML's codes as make up kEntries.
[[nodiscard]] std::string lexicon_text();

}  // namespace nms::bench
