#include "error_not_held.h"

#include <algorithm>

#include <fmt/format.h>

namespace nms::cli {
namespace {

constexpr double kDegrees = 57.29577951308232;

}  // namespace

std::optional<program::Failure> error_not_held(const runtime::GltfReport& report, const runtime::GltfOptions& options,
                                               const std::string& file) {
  if (options.max_error_m <= 0.0) return std::nullopt;
  const auto excess = [&](const runtime::GltfClipError& e) { return runtime::error_excess(e, options.max_error_m); };
  const auto worst = std::max_element(report.clips.begin(), report.clips.end(),
                                      [&](const auto& a, const auto& b) { return excess(a) < excess(b); });
  if (worst == report.clips.end() || excess(*worst) <= 1.0) return std::nullopt;
  const bool far = worst->largest_m / options.max_error_m >= excess(*worst);
  std::string what =
      far ? fmt::format("a vertex is {:.2f} mm off where {:.2f} mm were asked for, at {:.2f} s, {} near {}",
                        worst->largest_m * 1000.0, options.max_error_m * 1000.0, worst->time_s, worst->mesh,
                        worst->place)
          : fmt::format("a normal is {:.1f} degrees off where {:.0f} are the most, at {:.2f} s, {} near {}",
                        worst->normal_rad * kDegrees, runtime::kAskew_rad * kDegrees, worst->normal_time_s,
                        worst->normal_mesh, worst->normal_place);
  return program::Failure{"error_not_held", file, fmt::format("{}: {}", worst->clip, what),
                          "ask for less, put fewer clips in one file, or raise --max-corrections"};
}

}  // namespace nms::cli
