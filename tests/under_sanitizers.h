#pragma once

/// NMS_TOO_SLOW_HERE: skips a test that takes a minute and more under the sanitizers, where another goes the same ways.
#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#define NMS_UNDER_SANITIZERS 1
#endif
#elif defined(__SANITIZE_ADDRESS__)
#define NMS_UNDER_SANITIZERS 1
#endif

#ifdef NMS_UNDER_SANITIZERS
#define NMS_TOO_SLOW_HERE() GTEST_SKIP() << "a minute and more under the sanitizers"
#else
#define NMS_TOO_SLOW_HERE() static_cast<void>(0)
#endif
