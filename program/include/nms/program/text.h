#pragma once

#include <string>
#include <string_view>

#include <tl/expected.hpp>

#include <nms/program/program.h>

namespace nms::program {

/// What of a program to print. Without its channels a text is for reading only: `from_text` needs them.
struct TextOptions {
  bool rig = true;       ///< muscles, actuations, landmarks and the face
  bool channels = true;  ///< tracks and channels
};

/// The program as text, complete: `nmsc dump` prints it and the golden tests compare it. Deterministic.
///
/// One thing a line: a section's head stands at the margin, what belongs to it is indented. Times are seconds, exact to
/// the nanosecond; numbers are the shortest that read back to the same bits; a name that is not made of letters,
/// digits, `_`, `.`, `/`, `+` and `-` is quoted. After a knot's `;` stands the source that made its segment.
[[nodiscard]] std::string to_text(const Program& program, const TextOptions& options = {});

/// Reads what `to_text` writes. text -> draft -> image -> text is the identity.
/// The draft is as unchecked as any other: `Image::from` says whether it is a program.
/// Failures: invalid_program_text with place "name:line".
[[nodiscard]] tl::expected<Draft, Failure> from_text(std::string_view text, std::string_view name);

}  // namespace nms::program
