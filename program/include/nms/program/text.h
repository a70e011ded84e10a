#pragma once

#include <string>
#include <string_view>

#include <tl/expected.hpp>

#include <nms/program/program.h>

namespace nms::program {

/// The program as text, complete: `nmsc dump` prints it and the golden tests compare it. Deterministic.
[[nodiscard]] std::string to_text(const Program& program);

/// Reads what `to_text` writes. text -> draft -> image -> text is the identity.
/// Failures: invalid_program_text with place "name:line".
[[nodiscard]] tl::expected<Draft, Failure> from_text(std::string_view text, std::string_view name);

}  // namespace nms::program
