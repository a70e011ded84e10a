// write_stream FOLDER [BYTES]: writes stream.nms and stream.lua there, and prints how many definitions they hold.
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

#include <fmt/format.h>

#include "pose_stream.h"

int main(int argc, char** argv) {
  if (argc < 2) {
    fmt::print(stderr, "write_stream FOLDER [BYTES]\n");
    return 2;
  }
  const std::string folder = argv[1];
  const auto stream = nms::bench::make_pose_stream(argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 10'000'000);
  const bool good = (std::ofstream(folder + "/stream.nms", std::ios::binary) << stream.nms).flush().good() &&
                    (std::ofstream(folder + "/stream.lua", std::ios::binary) << stream.lua).flush().good();
  fmt::print("{}\n", stream.definitions);
  return good ? 0 : 1;
}
