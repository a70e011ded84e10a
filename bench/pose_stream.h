#pragma once

#include <cstddef>
#include <string>

namespace nms::bench {

/// A stream of definitions, and the same data as Lua.
struct PoseStream {
  std::string nms;
  std::string lua;
  std::size_t definitions = 0;
};

/// At least `bytes` of NMS: 60 % poses of 2 to 6 action units, 40 % expressions of 2 to 4 poses, some 60 bytes a
/// definition. Nothing in it is wrong. The same bytes each time.
///
/// The Lua says the same by what luac reads fastest: a pose is a table of percentages, an expression a table of its
/// length and its steps.
[[nodiscard]] PoseStream make_pose_stream(std::size_t bytes);

}  // namespace nms::bench
