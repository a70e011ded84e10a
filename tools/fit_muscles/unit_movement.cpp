#include "unit_movement.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include <glm/geometric.hpp>

#include <nms/runtime/places_at_rest.h>
#include <nms/runtime/region_shares.h>

namespace nms::fit_muscles {
namespace {

constexpr double kMoving = 0.2;     // of the largest displacement: what counts for the area
constexpr double kStep = 0.03;      // width of the smooth step about it
constexpr double kPeak = 32.0;      // power of the weights about the largest displacement
constexpr float kInside = 0.3F;     // share of a region inside the head from which on a vertex is not seen
constexpr double kEyeball = 0.021;  // [m]: what looks at the eyeball's centre from nearer is a lid's back
constexpr int kLidColumns = 16;

/// What the shares of surface are counted on: the face as seen from the front, from the hair to below the chin and
/// forward of the ears. [m]
bool of_the_face(const glm::dvec3& p) { return p.z > 0.020 && p.y > -0.085 && p.y < 0.115; }

}  // namespace

double degrees_between(const glm::dvec3& a, const glm::dvec3& b) {
  const double lengths = glm::length(a) * glm::length(b);
  return lengths > 0.0 ? std::acos(std::clamp(glm::dot(a, b) / lengths, -1.0, 1.0)) * 57.29577951308232 : 180.0;
}

MovementGauge::MovementGauge(const runtime::Face& face, const runtime::Landmarks& landmarks)
    : rest_(runtime::places_at_rest(face.skin)) {
  for (const runtime::Primitive& p : face.skin.primitives) {
    const std::string& material = face.materials[p.material].name;
    if (material == "brow" || material == "hair") continue;  // shells that ride on the skin
    for (std::size_t i = 0; i + 2 < p.triangles.size(); i += 3) {
      triangles_.push_back({p.triangles[i], p.triangles[i + 1], p.triangles[i + 2]});
    }
  }
  find_visible(face, landmarks);
  find_edges(face, landmarks);
  rest_gap_mm_ = lip_gap_mm(rest_);
  rest_lids_ = lid_area(rest_);
}

// Neither shells nor what lies inside mouth and nostrils or behind the lids.
void MovementGauge::find_visible(const runtime::Face& face, const runtime::Landmarks& landmarks) {
  std::vector<char> seen(rest_.size(), 0);
  std::vector<glm::dvec3> normals(rest_.size(), glm::dvec3(0.0));
  std::vector<double> areas(rest_.size(), 0.0);
  for (const Triangle& t : triangles_) {
    const glm::dvec3 n = glm::cross(rest_[t[1]] - rest_[t[0]], rest_[t[2]] - rest_[t[0]]);
    for (const std::uint32_t v : t) {
      seen[v] = 1;
      normals[v] += n;
      areas[v] += glm::length(n) / 6.0;
    }
  }
  const auto lining = runtime::region_shares(face, "lining");
  const auto nostril = runtime::region_shares(face, "nostril");
  const auto eye = landmarks.find("eye_centre_L");
  for (std::uint32_t v = 0; v < seen.size(); ++v) {
    if (lining[v] > kInside || nostril[v] > kInside) seen[v] = 0;
    if (eye != landmarks.end()) {
      const glm::dvec3 centre(std::copysign(eye->second.x, rest_[v].x), eye->second.y, eye->second.z);
      const glm::dvec3 from_eye = rest_[v] - centre;
      if (glm::length(from_eye) < kEyeball && glm::dot(from_eye, normals[v]) < 0.0) seen[v] = 0;
    }
    if (!seen[v] || rest_[v].x < -1e-6) continue;
    left_.push_back(v);
    left_area_.push_back(areas[v]);
  }
  for (std::uint32_t i = 0; i < triangles_.size(); ++i) {
    const Triangle& t = triangles_[i];
    if (!seen[t[0]] || !of_the_face((rest_[t[0]] + rest_[t[1]] + rest_[t[2]]) / 3.0)) continue;
    face_.push_back(i);
    face_area_.push_back(0.5 * glm::length(glm::cross(rest_[t[1]] - rest_[t[0]], rest_[t[2]] - rest_[t[0]])));
    whole_ += face_area_.back();
  }
}

// The lips' edges in the middle, and the lids' along the left eye.
void MovementGauge::find_edges(const runtime::Face& face, const runtime::Landmarks& landmarks) {
  const auto upper = runtime::region_shares(face, "lip_upper");
  const auto lower = runtime::region_shares(face, "lip_lower");
  const auto lining = runtime::region_shares(face, "lining");
  for (std::uint32_t v = 0; v < rest_.size(); ++v) {
    if (std::abs(rest_[v].x) > 0.0002 || lining[v] > 0.5F) continue;
    if (upper[v] > 0.95F) upper_lip_.push_back(v);
    if (lower[v] > 0.95F) lower_lip_.push_back(v);
  }
  if (const auto corner = landmarks.find("mouth_corner_L"); corner != landmarks.end())
    corner_ = nearest(corner->second);
  const auto inner_at = landmarks.find("eye_inner_L");
  const auto outer_at = landmarks.find("eye_outer_L");
  if (inner_at == landmarks.end() || outer_at == landmarks.end()) return;
  const double inner = inner_at->second.x;
  const double width = (outer_at->second.x - inner) / kLidColumns;
  const auto upper_lid = runtime::region_shares(face, "lid_upper_left");
  const auto lower_lid = runtime::region_shares(face, "lid_lower_left");
  for (int c = 0; c < kLidColumns; ++c) {
    std::uint32_t low = 0;
    std::uint32_t high = 0;
    double y_low = 1.0;
    double y_high = -1.0;
    for (std::uint32_t v = 0; v < rest_.size(); ++v) {
      const glm::dvec3& p = rest_[v];
      if (p.x < inner + width * c || p.x >= inner + width * (c + 1)) continue;
      if (upper_lid[v] > 0.99F && p.y < y_low) y_low = p.y, low = v;
      if (lower_lid[v] > 0.99F && p.y > y_high) y_high = p.y, high = v;
    }
    if (y_low < 1.0 && y_high > -1.0) lids_.emplace_back(low, high);
  }
}

template <typename Points>
double MovementGauge::lip_gap_mm(const Points& p) const {
  if (upper_lip_.empty() || lower_lip_.empty()) return 0.0;
  double up = 1.0;
  double low = -1.0;
  for (const std::uint32_t v : upper_lip_) up = std::min(up, static_cast<double>(p[v].y));
  for (const std::uint32_t v : lower_lip_) low = std::max(low, static_cast<double>(p[v].y));
  return (up - low) * 1000.0;
}

template <typename Points>
double MovementGauge::lid_area(const Points& p) const {
  double sum = 0.0;
  for (const auto& [up, low] : lids_) sum += std::max(0.0, static_cast<double>(p[up].y - p[low].y));
  return sum;
}

void MovementGauge::measure_edges(std::span<const glm::vec3> positions, UnitMovement& m) const {
  m.gap_mm = lip_gap_mm(positions) - rest_gap_mm_;
  if (corner_ != 0) m.width = static_cast<double>(positions[corner_].x) / rest_[corner_].x - 1.0;
  m.opening = rest_lids_ > 0.0 ? lid_area(positions) / rest_lids_ : 0.0;
}

std::uint32_t MovementGauge::nearest(const glm::dvec3& place) const {
  std::uint32_t best = left_.empty() ? 0 : left_.front();
  for (const std::uint32_t v : left_) {
    if (glm::length(rest_[v] - place) < glm::length(rest_[best] - place)) best = v;
  }
  return best;
}

UnitMovement MovementGauge::measure(std::span<const glm::vec3> positions) const {
  UnitMovement m;
  for (const std::uint32_t v : left_) {
    const glm::dvec3 moved = glm::dvec3(positions[v]) - rest_[v];
    const double mm = glm::length(moved) * 1000.0;
    if (mm <= m.largest_mm) continue;
    m.largest_mm = mm;
    m.direction = moved / (mm / 1000.0);
    m.place = rest_[v];
  }
  double moving = 0.0;
  for (std::size_t i = 0; i < face_.size(); ++i) {
    double mm = 0.0;
    for (const std::uint32_t v : triangles_[face_[i]]) mm += glm::length(glm::dvec3(positions[v]) - rest_[v]) / 0.003;
    if (mm > kMoving * m.largest_mm) moving += face_area_[i];
  }
  m.area = whole_ > 0.0 ? moving / whole_ : 0.0;
  measure_edges(positions, m);
  return m;
}

UnitMovement MovementGauge::measure_smoothly(std::span<const glm::vec3> positions) const {
  UnitMovement m;
  double largest = 0.0;
  for (const std::uint32_t v : left_) largest = std::max(largest, glm::length(glm::dvec3(positions[v]) - rest_[v]));
  measure_edges(positions, m);
  if (largest <= 0.0) return m;
  double sum = 0.0;
  double size = 0.0;
  for (std::size_t i = 0; i < left_.size(); ++i) {
    const glm::dvec3 moved = glm::dvec3(positions[left_[i]]) - rest_[left_[i]];
    const double length = glm::length(moved);
    if (length < 0.5 * largest) continue;  // 2^-32: nothing
    const double weight = left_area_[i] * std::pow(length / largest, kPeak);
    sum += weight;
    size += weight * length;
    m.direction += weight * moved;
    m.place += weight * rest_[left_[i]];
  }
  if (!(sum > 0.0)) return m;
  m.largest_mm = 1000.0 * size / sum;
  m.place /= sum;
  m.direction /= std::max(glm::length(m.direction), 1e-12);
  double moving = 0.0;
  for (std::size_t i = 0; i < face_.size(); ++i) {
    double share = 0.0;
    for (const std::uint32_t v : triangles_[face_[i]]) {
      share += glm::length(glm::dvec3(positions[v]) - rest_[v]) / (3.0 * largest);
    }
    const double t = std::clamp(0.5 + (share - kMoving) / (2.0 * kStep), 0.0, 1.0);
    moving += face_area_[i] * t * t * (3.0 - 2.0 * t);
  }
  m.area = whole_ > 0.0 ? moving / whole_ : 0.0;
  return m;
}

}  // namespace nms::fit_muscles
