#include <cstdio>
#include <new>

#include <fmt/format.h>

#include "command_line.h"

int main(int argc, char** argv) try {
  nms::cli::CommandLine line;
  if (const auto code = line.parse(argc, argv)) return *code;
  const int code = line.run();
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) {
    fmt::print(stderr,
               "nmsc: error cannot_write: standard output cannot take more: it is closed, or its disk is full\n");
    return nms::cli::kErrors;
  }
  return code;
} catch (const std::bad_alloc&) {
  std::fputs("nmsc: error out_of_memory: there is not enough memory for this input\n", stderr);
  return nms::cli::kErrors;
}
