#include "eyeball.h"

#include <nms/runtime/rig.h>
#include <nms/runtime/trigonometry.h>

namespace nms::runtime {

namespace {

constexpr int kAround = 32;
constexpr int kRings = 24;
// Seen from the ball's centre, from straight ahead: an iris 11.7 mm wide on a ball of 24 mm, a pupil of 4 mm.
constexpr double kPupil = 0.17;  // [rad]
constexpr double kIris = 0.50;   // [rad]

std::uint32_t material_named(const char* name, glm::vec4 color, std::vector<Material>& materials) {
  for (std::uint32_t i = 0; i < materials.size(); ++i)
    if (materials[i].name == name) return i;
  materials.push_back({name, color, 0.25F, 0.0F, false});
  return static_cast<std::uint32_t>(materials.size() - 1);
}

}  // namespace

RigidMesh make_eyeball(const Sphere& sphere, const std::string& name, Frame frame, std::vector<Material>& materials) {
  RigidMesh mesh;
  mesh.name = name;
  mesh.frame = frame;
  const std::uint32_t looks[] = {material_named("pupil", {0.004F, 0.004F, 0.004F, 1.0F}, materials),
                                 material_named("iris", {0.085F, 0.05F, 0.023F, 1.0F}, materials),
                                 material_named("sclera", {0.78F, 0.76F, 0.73F, 1.0F}, materials)};
  for (const std::uint32_t m : looks) mesh.primitives.push_back({m, {}});
  // Rings from the front pole; those of pupil and iris lie on their borders.
  const auto angle = [](int ring) {
    if (ring <= 2) return kPupil * ring / 2.0;
    if (ring <= 6) return kPupil + (kIris - kPupil) * (ring - 2) / 4.0;
    return kIris + (kPi - kIris) * (ring - 6) / (kRings - 6.0);
  };
  for (int ring = 0; ring <= kRings; ++ring) {
    const double a = angle(ring);
    for (int k = 0; k < kAround; ++k) {
      const double b = 2.0 * kPi * k / kAround;
      const glm::dvec3 n(sine(a) * cosine(b), sine(a) * sine(b), cosine(a));
      mesh.positions.emplace_back(sphere.centre + sphere.radius * n);
      mesh.normals.emplace_back(n);
    }
  }
  for (int ring = 0; ring < kRings; ++ring) {
    std::vector<std::uint32_t>& out = mesh.primitives[ring < 2 ? 0 : ring < 6 ? 1 : 2].triangles;
    for (int k = 0; k < kAround; ++k) {
      const auto at = [&](int r, int i) { return static_cast<std::uint32_t>(r * kAround + i % kAround); };
      if (ring > 0) out.insert(out.end(), {at(ring, k), at(ring + 1, k), at(ring, k + 1)});
      if (ring + 1 < kRings) out.insert(out.end(), {at(ring, k + 1), at(ring + 1, k), at(ring + 1, k + 1)});
    }
  }
  return mesh;
}

}  // namespace nms::runtime
