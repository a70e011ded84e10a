#include <nms/runtime/face_scale.h>

#include <cmath>
#include <string_view>

namespace nms::runtime {

namespace {

// The reference face's measures, by the landmarks of stdlib/faces/ada.nms. [m]
constexpr double kEyesApart = 0.06232;
constexpr double kEyesToMenton = 0.11402;
constexpr double kHingeToLips = 0.09447;
// Rounding of a file's numbers is no other size.
constexpr double kSame = 1e-5;

double ratio(double length, double reference) {
  const double r = length / reference;
  return std::abs(r - 1.0) < kSame ? 1.0 : r;
}

// Newton's, from above: no machine's library decides the last bit.
double cube_root(double x) {
  double r = x > 1.0 ? x : 1.0;
  for (int i = 0; i < 100; ++i) r -= (r * r * r - x) / (3.0 * r * r);
  return r;
}

}  // namespace

FaceScale face_scale(const Landmarks& landmarks) {
  FaceScale scale;
  const auto find = [&](std::string_view name) {
    const auto at = landmarks.find(name);
    return at == landmarks.end() ? nullptr : &at->second;
  };
  const glm::dvec3* left = find("eye_centre_L");
  const glm::dvec3* right = find("eye_centre_R");
  const glm::dvec3* menton = find("menton");
  if (left == nullptr || right == nullptr || menton == nullptr) return scale;
  const glm::dvec3 d = *left - *right;
  const double apart = std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z);
  if (!(apart > 1e-6)) return scale;
  const double width = ratio(apart, kEyesApart);
  scale.axes = glm::dvec3(width);
  const double eyes_y = 0.5 * (left->y + right->y);
  if (eyes_y > menton->y) scale.axes.y = ratio(eyes_y - menton->y, kEyesToMenton);
  const glm::dvec3* hinge = find("jaw_hinge_L");
  const glm::dvec3* lips = find("stomion");
  if (hinge != nullptr && lips != nullptr && lips->z > hinge->z) scale.axes.z = ratio(lips->z - hinge->z, kHingeToLips);
  const bool same = scale.axes == glm::dvec3(1.0);
  scale.length = same ? 1.0 : cube_root(scale.axes.x * scale.axes.y * scale.axes.z);
  return scale;
}

}  // namespace nms::runtime
