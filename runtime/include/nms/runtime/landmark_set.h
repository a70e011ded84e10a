#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace nms::runtime {

/// One of the places that the standard library's muscles are placed by. docs/for-faces.md shows the same list.
struct LandmarkInfo {
  std::string_view name;
  bool sided = false;      ///< on a face: "NAME_L" and "NAME_R"
  std::string_view where;  ///< how to find it
};

/// All of them, from the forehead down. A face need not have all: what a missing one costs, `nmsc face check` says.
[[nodiscard]] std::span<const LandmarkInfo> landmark_set();

/// What add_regions() needs to make a region.
struct RegionNeeds {
  std::string_view region;                  ///< without "_left" or "_right"
  std::vector<std::string_view> landmarks;  ///< without "_L" or "_R"
};

[[nodiscard]] std::span<const RegionNeeds> region_needs();

}  // namespace nms::runtime
