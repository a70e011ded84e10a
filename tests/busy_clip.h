#pragma once

namespace nms {

/// Fifty targets: most units at once, each with a course of its own; mouth, lids, brows, cheeks, jaw and tongue move.
inline constexpr const char* kBusyClip = R"(
timeline much 2s {
  AU1 at 0.1s for 600ms;  AU2 at 0.2s for 500ms;  AU4 at 0.9s for 800ms;  AU5 at 0.3s for 400ms
  AU6 at 0.5s for 900ms;  AU7 at 1.2s for 500ms;  AU9 at 0.8s for 300ms;  AU10 at 1.1s for 500ms
  AU11 at 0.2s for 700ms;  AU12 at 0.4s for 900ms;  AU14 at 1.5s for 400ms;  AU15 at 1.4s for 500ms
  AU16 at 0.6s for 300ms;  AU17 at 1.0s for 500ms;  AU20 at 0.2s for 400ms;  AU22 at 1.2s for 400ms
  AU23 at 0.7s for 300ms;  AU26 at 0.3s for 900ms;  AU27 at 1.3s for 300ms
  AU34 at 1.6s for 300ms;  AU38 at 0.5s for 500ms;  AU39 at 1.3s for 300ms;  AU43 at 1.0s for 200ms
  AU13 at 0.9s for 300ms;  AU30L at 0.6s for 300ms;  AU29 at 1.4s for 400ms;  AU32 at 1.7s for 200ms
  AU61 at 0.2s for 300ms;  AU63 at 0.7s for 400ms;  AU64 at 1.2s for 300ms;  AU51 at 0.4s for 900ms
}
)";

}  // namespace nms
