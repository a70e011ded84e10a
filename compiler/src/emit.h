#pragma once

#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

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
  void clip(const ClipDraft& clip, const std::vector<MergedCurve>& curves, const Channels& channels);

  program::Draft draft;

 private:
  [[nodiscard]] std::uint32_t handles(float b1, float b2);
  std::unordered_map<std::string, std::uint32_t> strings_;
  std::unordered_map<std::uint64_t, std::uint32_t> handles_;
};

}  // namespace nms::compiler
