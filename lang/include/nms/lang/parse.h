#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include <nms/lang/diagnostic.h>
#include <nms/lang/tree.h>

namespace nms::lang {

/// Deepest nesting of brackets and blocks; beyond it `nesting_too_deep` is reported and the rest of the block skipped.
inline constexpr int kMaxNesting = 200;

/// The tree of a file. Total: any bytes give a tree and diagnostics, never a crash. Linear in the file's size.
[[nodiscard]] std::shared_ptr<const Tree> parse(std::shared_ptr<const Source> source, Diagnostics& diagnostics);

/// The tree as indented text, one node a line; the parser's golden tests compare it.
[[nodiscard]] std::string dump(const Tree& tree);

/// Canonical text. Idempotent; keeps comments, the tree and every order. A tree with errors is not formatted: its own
/// text comes back unchanged.
[[nodiscard]] std::string format(const Tree& tree);

/// Canonical text for the smallest statements that lie on the lines [first_line, last_line], from 1; every other byte
/// of the file is as it was. Idempotent; keeps comments and the tree. A tree with errors is not formatted.
[[nodiscard]] std::string format_range(const Tree& tree, std::uint32_t first_line, std::uint32_t last_line);

}  // namespace nms::lang
