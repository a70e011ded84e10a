#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include <nms/program/program.h>

namespace nms::program {

inline constexpr std::string_view kReport = "compile it again; if it is refused again, report it as a defect of nmsc";

/// Longest name, path or title [bytes]: bounds what the text form of a small hostile file can grow to.
inline constexpr std::uint32_t kStringLimit = 4096;

/// The first thing wrong with the contents of a program's tables, whose spans are known to lie in the file.
[[nodiscard]] std::optional<Failure> check_tables(const Program& program, std::string_view place);

/// 4096 as "4,096".
[[nodiscard]] std::string grouped(std::uint64_t number);

}  // namespace nms::program
