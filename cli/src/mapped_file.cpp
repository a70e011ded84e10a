#include "mapped_file.h"

#include <cerrno>
#include <cstring>
#include <utility>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

namespace nms::cli {

tl::expected<MappedFile, program::Failure> MappedFile::open(const std::string& path) {
  const auto fail = [&path](std::string cause, std::string remedy) {
    return tl::unexpected(program::Failure{"cannot_read", path, std::move(cause), std::move(remedy)});
  };
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return fail(std::strerror(errno), "check the path and its permissions");
  struct stat status {};
  if (::fstat(file, &status) != 0 || !S_ISREG(status.st_mode)) {
    ::close(file);
    return fail("it is not a file that can be mapped", "name a file");
  }
  const auto size = static_cast<std::size_t>(status.st_size);
  void* first = size == 0 ? nullptr : ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file, 0);
  const int error = errno;
  ::close(file);  // the mapping stays
  if (first == MAP_FAILED) return fail(std::strerror(error), "check the disk");
  return MappedFile({static_cast<const std::byte*>(first), size});
}

MappedFile::MappedFile(MappedFile&& other) noexcept : bytes_(std::exchange(other.bytes_, {})) {}

MappedFile& MappedFile::operator=(MappedFile&& other) noexcept {
  std::swap(bytes_, other.bytes_);
  return *this;
}

MappedFile::~MappedFile() {
  if (!bytes_.empty()) ::munmap(const_cast<std::byte*>(bytes_.data()), bytes_.size());
}

}  // namespace nms::cli
