#include "face_meshes.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <string_view>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace nms::cli {
namespace {

constexpr float kMargin = 1.16F;     ///< of a picture about a head at rest
constexpr float kLeastRoom = 0.02F;  ///< of a picture's height, beside a head that has moved
constexpr float kHeadShare = 0.6F;   ///< what moves with the head by more than this is the head

/// Light goes some way into skin, lips and tongue; not into hair and enamel.
float translucence(std::string_view material) {
  for (const std::string_view soft : {"skin", "lips", "tongue", "gums", "mouth_lining"})
    if (material == soft) return 1.0F;
  return 0.0F;
}

/// The vertices that a primitive uses, and no others.
picture::Mesh mesh_of(const runtime::Primitive& primitive, const runtime::Material& material,
                      std::span<const glm::vec3> positions, std::span<const glm::vec3> normals,
                      std::span<const glm::vec3> colors) {
  picture::Mesh mesh;
  mesh.color = glm::vec3(material.base_color);
  mesh.roughness = material.roughness;
  mesh.two_sided = material.double_sided;
  mesh.translucence = translucence(material.name);
  constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> index(positions.size(), kUnused);
  mesh.triangles.reserve(primitive.triangles.size());
  for (const std::uint32_t v : primitive.triangles) {
    if (index[v] == kUnused) {
      index[v] = static_cast<std::uint32_t>(mesh.positions.size());
      mesh.positions.push_back(positions[v]);
      mesh.normals.push_back(normals[v]);
      if (!colors.empty()) mesh.colors.push_back(colors[v]);
    }
    mesh.triangles.push_back(index[v]);
  }
  return mesh;
}

}  // namespace

std::vector<picture::Mesh> face_meshes(const runtime::Face& face, const runtime::Rig& rig, const runtime::Pose& pose) {
  std::vector<picture::Mesh> meshes;
  std::vector<glm::vec3> positions(pose.positions.size());
  std::vector<glm::vec3> normals(pose.normals.size());
  runtime::place_skin(rig, pose, positions, normals);
  for (const runtime::Primitive& p : face.skin.primitives)
    meshes.push_back(mesh_of(p, face.materials[p.material], positions, normals, face.skin.colors));
  for (std::size_t i = 0; i < face.rigid.size(); ++i) {
    const runtime::RigidMesh& part = face.rigid[i];
    const bool bent = !pose.parts[i].empty();
    positions = bent ? pose.parts[i] : part.positions;
    normals = bent ? pose.part_normals[i] : part.normals;
    const runtime::Placement& placement = pose.placements[static_cast<std::size_t>(part.frame)];
    for (glm::vec3& p : positions) p = glm::vec3(placement.rotation * glm::dvec3(p) + placement.translation);
    for (glm::vec3& n : normals) n = glm::vec3(placement.rotation * glm::dvec3(n));
    for (const runtime::Primitive& p : part.primitives)
      meshes.push_back(mesh_of(p, face.materials[p.material], positions, normals, part.colors));
  }
  return meshes;
}

picture::Camera head_camera(const runtime::Face& face, const runtime::Rig& rig, const runtime::Pose& rest,
                            double aspect) {
  glm::vec3 low(std::numeric_limits<float>::max());
  glm::vec3 high(-std::numeric_limits<float>::max());
  const auto take = [&](const glm::vec3& p) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  };
  const std::span<const float> share = rig.head_share();
  for (std::size_t v = 0; v < rest.positions.size(); ++v)
    if (share[v] > kHeadShare) take(rest.positions[v]);
  for (const runtime::RigidMesh& part : face.rigid)
    if (part.frame != runtime::Frame::torso)
      for (const glm::vec3& p : part.positions) take(p);
  picture::Camera camera;
  camera.target = 0.5F * (low + high);
  const float depth = std::max(high.x - low.x, high.z - low.z);  // the head may be seen from its side
  camera.height_m = kMargin * std::max(high.y - low.y, depth / static_cast<float>(aspect));
  return camera;
}

float height_to_hold(const picture::Camera& camera, const runtime::Pose& pose, double aspect) {
  const glm::dvec3 target(camera.target);
  const runtime::Placement& head = pose.placements[static_cast<std::size_t>(runtime::Frame::head)];
  const glm::vec3 by(head.rotation * target + head.translation - target);
  const glm::vec3 right(std::cos(camera.yaw_rad), 0.0F, -std::sin(camera.yaw_rad));
  const glm::vec3 back(std::sin(camera.yaw_rad) * std::cos(camera.pitch_rad), std::sin(camera.pitch_rad),
                       std::cos(camera.yaw_rad) * std::cos(camera.pitch_rad));
  const float aside = std::abs(glm::dot(by, right)) / static_cast<float>(aspect);
  const float up = std::abs(glm::dot(by, glm::cross(back, right)));
  // Of the margin about a head at rest all but some room may be used up.
  const float free = (0.5F - 0.5F / kMargin - kLeastRoom) * camera.height_m;
  return camera.height_m + 2.0F * std::max({aside - free, up - free, 0.0F});
}

}  // namespace nms::cli
