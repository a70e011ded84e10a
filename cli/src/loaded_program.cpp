#include "loaded_program.h"

namespace nms::cli {

tl::expected<LoadedProgram, program::Failure> LoadedProgram::map(const std::string& path) {
  auto file = MappedFile::open(path);
  if (!file) return tl::unexpected(std::move(file.error()));
  const auto program = program::check(file->bytes(), path);
  if (!program) return tl::unexpected(program.error());
  return LoadedProgram(std::move(*file), *program);
}

std::span<const std::byte> LoadedProgram::bytes() const {
  return std::visit([](const auto& owner) { return std::span<const std::byte>(owner.bytes()); }, owner_);
}

}  // namespace nms::cli
