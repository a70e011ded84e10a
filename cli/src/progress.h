#pragma once

#include <unistd.h>

#include <cstddef>
#include <cstdio>
#include <mutex>
#include <string>

#include <fmt/format.h>

namespace nms::cli {

/// What stands on a terminal's last line while many things are made, by several threads if need be. Nothing where
/// stderr is no terminal.
class Progress {
 public:
  explicit Progress(std::size_t count) : count_(count), shown_(::isatty(STDERR_FILENO) != 0) {}
  void done(const std::string& what) {
    const std::lock_guard lock(mutex_);
    ++done_;
    if (shown_) fmt::print(stderr, "\r\x1b[K{}/{} {}", done_, count_, what);
  }
  void end() const {
    if (shown_ && done_ != 0) fmt::print(stderr, "\r\x1b[K");
  }

 private:
  std::mutex mutex_;
  std::size_t count_;
  std::size_t done_ = 0;
  bool shown_;
};

}  // namespace nms::cli
