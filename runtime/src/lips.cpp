#include <algorithm>
#include <array>
#include <cmath>

#include "rig_parts.h"

namespace nms::runtime {

namespace {

// Lips: columns along the mouth, how close upper and lower lip may come, how deep into the lip an overlap is spread,
// and how far apart in depth they may be and still touch (a jaw thrust forward passes in front).
constexpr int kLipColumns = 24;
constexpr double kLipGap = 0.0002;   // [m]
constexpr double kLipDepth = 0.010;  // [m]
constexpr double kLipTouch = 0.006;  // [m]

}  // namespace

// Faces without lips are left alone.
void RigParts::make_lips() {
  const auto upper_region = face.regions.find("lip_upper");
  const auto lower_region = face.regions.find("lip_lower");
  if (upper_region == face.regions.end() || lower_region == face.regions.end()) return;
  const std::vector<glm::dvec3>& points = face.skin.points;
  const std::vector<float>& upper = upper_region->second;
  const std::vector<float>& lower = lower_region->second;

  double widest = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (upper[i] >= kMarginShare || lower[i] >= kMarginShare) widest = std::max(widest, std::abs(points[i].x));
  }
  if (widest <= 0.0) return;
  constexpr std::uint32_t kNoPoint = 0xFFFFFFFFU;
  std::array<std::uint32_t, kLipColumns> lowest{};
  std::array<std::uint32_t, kLipColumns> highest{};
  lowest.fill(kNoPoint);
  highest.fill(kNoPoint);
  const double width = 2.0 * widest / kLipColumns;
  const auto offer = [&](std::uint32_t i, int column) {
    std::uint32_t& low = lowest[static_cast<std::size_t>(column)];
    std::uint32_t& high = highest[static_cast<std::size_t>(column)];
    // Of two that are level the one nearer to the middle, so that columns mirror.
    const auto nearer = [&](std::uint32_t other) { return std::abs(points[i].x) < std::abs(points[other].x); };
    const auto level = [&](std::uint32_t other) { return points[i].y == points[other].y; };
    if (upper[i] >= kMarginShare && (low == kNoPoint || points[i].y < points[low].y || (level(low) && nearer(low))))
      low = i;
    if (lower[i] >= kMarginShare && (high == kNoPoint || points[i].y > points[high].y || (level(high) && nearer(high))))
      high = i;
  };
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const double x = points[i].x;
    // By |x|, so that columns mirror; a point of the midline stands in the innermost column of both sides.
    const int step = std::min(static_cast<int>(std::abs(x) / width), kLipColumns / 2 - 1);
    if (x >= 0.0) offer(i, kLipColumns / 2 + step);
    if (x <= 0.0) offer(i, kLipColumns / 2 - 1 - step);
  }
  for (std::size_t c = 0; c < kLipColumns; ++c) {
    if (lowest[c] == kNoPoint || highest[c] == kNoPoint) continue;
    const glm::dvec3 u = points[lowest[c]];
    const glm::dvec3 l = points[highest[c]];
    rig.lip_columns.push_back({0.5 * (u.x + l.x), lowest[c], highest[c], std::min(u.y - l.y, kLipGap * rig.scale)});
  }
  if (rig.lip_columns.size() < 2) {
    rig.lip_columns.clear();
    return;
  }
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const bool is_upper = upper[i] >= lower[i];
    const double weight = static_cast<double>(std::max(upper[i], lower[i]) - std::min(upper[i], lower[i]));
    const double x = points[i].x;
    if (weight <= 0.0 || x < rig.lip_columns.front().x || x > rig.lip_columns.back().x) continue;
    std::uint32_t c = 0;
    while (c + 2 < rig.lip_columns.size() && rig.lip_columns[c + 1].x <= x) ++c;
    const RigTables::LipColumn& a = rig.lip_columns[c];
    const RigTables::LipColumn& b = rig.lip_columns[c + 1];
    const double along = b.x > a.x ? (x - a.x) / (b.x - a.x) : 0.0;
    const double ya = points[is_upper ? a.upper : a.lower].y;
    const double yb = points[is_upper ? b.upper : b.lower].y;
    const double deep = std::abs(points[i].y - (ya + along * (yb - ya)));
    const double share = weight * smooth_fall(deep / (kLipDepth * rig.scale));
    if (share > 0.0) rig.lip_points.push_back({i, c, along, is_upper ? share : -share});
  }
}

void part_lips(const Rig& rig, Pose& pose) {
  const RigTables& t = rig.tables();
  bool touch = false;
  for (std::size_t c = 0; c < t.lip_columns.size(); ++c) {
    const RigTables::LipColumn& column = t.lip_columns[c];
    const glm::dvec3 u = pose.points[column.upper];
    const glm::dvec3 l = pose.points[column.lower];
    const double overlap = column.gap - (u.y - l.y);
    pose.lip_overlaps[c] = overlap > 0.0 ? overlap * smooth_fall(std::abs(u.z - l.z) / (kLipTouch * t.scale)) : 0.0;
    // Rounding is no overlap: rest must stay rest.
    if (pose.lip_overlaps[c] < 1e-9) pose.lip_overlaps[c] = 0.0;
    touch = touch || pose.lip_overlaps[c] > 0.0;
  }
  if (!touch) return;
  for (const RigTables::LipPoint& p : t.lip_points) {
    const double a = pose.lip_overlaps[p.column];
    const double b = pose.lip_overlaps[p.column + 1];
    pose.points[p.point].y += 0.5 * p.share * (a + p.along * (b - a));
  }
}

}  // namespace nms::runtime
