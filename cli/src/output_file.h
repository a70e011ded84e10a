#pragma once

#include <optional>
#include <span>
#include <string>

#include <nms/program/failure.h>

namespace nms::cli {

/// Writes a file whole or not at all: beside its place, then renamed into it. Failure: cannot_write.
[[nodiscard]] std::optional<program::Failure> write_file(const std::string& path, std::span<const std::byte> bytes);

}  // namespace nms::cli
