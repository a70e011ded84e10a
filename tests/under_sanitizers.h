#pragma once

/// What the sanitizers make too slow: they see each instruction once, the release build each number.
/// cmake/NmsRoom.cmake tells each test whether it is built with them (NMS_UNDER_SANITIZERS).
#include <cstddef>
#include <cstdio>

/// Skips a test that takes a minute and more under the sanitizers, where another goes the same ways.
#ifdef NMS_UNDER_SANITIZERS
#define NMS_TOO_SLOW_HERE() GTEST_SKIP() << "a minute and more under the sanitizers"
#else
#define NMS_TOO_SLOW_HERE() static_cast<void>(0)
#endif

namespace nms {

/// Of the many alike cases of a sweep: all, or under the sanitizers one of `n`, which is said.
inline std::size_t one_case_of(std::size_t n) {
#ifdef NMS_UNDER_SANITIZERS
  std::printf("under the sanitizers one case of %zu is tried\n", n);
  return n;
#else
  static_cast<void>(n);
  return 1;
#endif
}

}  // namespace nms
