#pragma once

#include <cstddef>
#include <span>
#include <string>

#include <tl/expected.hpp>

#include <nms/program/failure.h>

namespace nms::cli {

/// A regular file's bytes where the system maps them: read-only, at a page's beginning, read as they are touched.
///
/// Our own files are replaced by renaming, so a mapping keeps what it had. Who cuts a mapped file in place from another
/// process ends this one, as with any mapping.
class MappedFile {
 public:
  /// Failure: cannot_read.
  [[nodiscard]] static tl::expected<MappedFile, program::Failure> open(const std::string& path);

  MappedFile(MappedFile&& other) noexcept;
  MappedFile& operator=(MappedFile&& other) noexcept;
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;
  ~MappedFile();

  [[nodiscard]] std::span<const std::byte> bytes() const { return bytes_; }

 private:
  explicit MappedFile(std::span<const std::byte> bytes) : bytes_(bytes) {}
  std::span<const std::byte> bytes_;
};

}  // namespace nms::cli
