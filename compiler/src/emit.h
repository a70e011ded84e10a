#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include <nms/compiler/diagnostic_kinds.h>
#include <nms/program/curve_shapes.h>
#include <nms/program/program.h>

#include "merge.h"
#include "schedule.h"

namespace nms::compiler {

/// Fills a program draft: strings once each, clips in the order they come.
class Emitter {
 public:
  [[nodiscard]] program::StringId string(std::string_view text);
  /// A path; bytes that are no text are shown as `?`.
  [[nodiscard]] program::StringId path(std::string_view text);
  void channels(const Channels& channels);
  /// A clip with its merged curves. Markers and sources are the draft clip's.
  /// What a program has no room for, if so.
  [[nodiscard]] std::optional<TooLarge> clip(const ClipDraft& clip, const std::vector<MergedCurve>& curves,
                                             const Channels& channels);

  program::Draft draft;

 private:
  std::unordered_map<std::string, std::uint32_t> strings_;
  program::CurveShapes shapes_;  ///< of the curve being written
};

}  // namespace nms::compiler
