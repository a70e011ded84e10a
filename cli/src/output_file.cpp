#include "output_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include <fmt/format.h>

namespace nms::cli {

std::optional<program::Failure> write_file(const std::string& named, std::span<const std::byte> bytes) {
  const auto fail = [&named](int error) {
    return program::Failure{"cannot_write", named, std::strerror(error), "check that the folder exists and has room"};
  };
  if (named.empty())
    return program::Failure{"cannot_write", "output", "no file is named", "give -o a path"};
  if (named == "-")  // elsewhere it is standard output, and here would be a file that a shell cannot name
    return program::Failure{"cannot_write", named, "what is no text is not written to standard output",
                            "name a file; /dev/stdout is one"};
  struct stat status {};
  const bool exists = ::stat(named.c_str(), &status) == 0;
  // A link stays a link: what it leads to is written.
  std::error_code no_target;
  std::string path = exists ? std::filesystem::canonical(named, no_target).string() : named;
  if (path.empty()) path = named;
  if (exists && !S_ISREG(status.st_mode)) {
    // A device or a pipe cannot be renamed over: it is written to.
    if (S_ISDIR(status.st_mode)) return fail(EISDIR);
    std::FILE* out = std::fopen(path.c_str(), "wb");
    if (out == nullptr) return fail(errno);
    const bool written = std::fwrite(bytes.data(), 1, bytes.size(), out) == bytes.size();
    const int error = errno;
    if (std::fclose(out) != 0) return fail(errno);
    if (!written) return fail(error);
    return std::nullopt;
  }
  const std::string beside = fmt::format("{}.{}.part", path, ::getpid());
  const int fd = ::open(beside.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (fd < 0) return fail(errno);
  std::size_t done = 0;
  int error = 0;
  // Whoever could read the old file can read the new one, and nobody else.
  if (exists && ::fchmod(fd, status.st_mode & 07777U) != 0) error = errno;
  while (done < bytes.size() && error == 0) {
    const ::ssize_t n = ::write(fd, bytes.data() + done, bytes.size() - done);
    if (n < 0) {
      if (errno != EINTR) error = errno;
    } else {
      done += static_cast<std::size_t>(n);
    }
  }
  if (::close(fd) != 0 && error == 0) error = errno;
  if (error == 0 && ::rename(beside.c_str(), path.c_str()) != 0) error = errno;
  if (error == 0) return std::nullopt;
  ::unlink(beside.c_str());
  return fail(error);
}

}  // namespace nms::cli
