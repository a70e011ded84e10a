#pragma once

#include <span>
#include <string>
#include <utility>
#include <variant>

#include <tl/expected.hpp>

#include <nms/program/program.h>

#include "mapped_file.h"

namespace nms::cli {

/// A checked program and what its bytes lie in: memory, if it was compiled just now, or a mapped file.
class LoadedProgram {
 public:
  explicit LoadedProgram(program::Image image) : program_(image.program()), owner_(std::move(image)) {}

  /// Maps an `.auc` file and checks it; nothing is copied or parsed.
  /// Failures: cannot_read, and those of program::check.
  [[nodiscard]] static tl::expected<LoadedProgram, program::Failure> map(const std::string& path);

  /// Valid as long as this is, wherever it is moved to.
  [[nodiscard]] const program::Program& program() const { return program_; }
  [[nodiscard]] std::span<const std::byte> bytes() const;

 private:
  LoadedProgram(MappedFile file, const program::Program& program) : program_(program), owner_(std::move(file)) {}
  program::Program program_;
  std::variant<program::Image, MappedFile> owner_;
};

}  // namespace nms::cli
