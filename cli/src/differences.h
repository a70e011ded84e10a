#pragma once

#include <string>
#include <vector>

#include <nms/program/compare.h>

namespace nms::cli {

/// A change of what an entry is called in notation, which programs do not hold.
struct LabelChange {
  std::string entry;
  std::string label;
  bool added = false;  ///< else removed
};

struct AllDifferences {
  std::vector<program::Difference> programs;
  std::vector<LabelChange> labels;

  [[nodiscard]] bool empty() const { return programs.empty() && labels.empty(); }
};

/// A line for each clip and channel that changed: `wh: brows AU4 peak 80% -> 70%, onset +50ms`.
[[nodiscard]] std::string differences_text(const AllDifferences& all);
[[nodiscard]] std::string differences_json(const AllDifferences& all);

}  // namespace nms::cli
