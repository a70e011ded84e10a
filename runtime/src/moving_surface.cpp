// What of the surface a rig can move, and moving it. The rest stays as make_pose() left it.
#include <cstdint>
#include <vector>

#include <nms/runtime/mesh_normals.h>
#include <nms/runtime/sparse_matrix.h>

#include "rig_parts.h"

namespace nms::runtime {

void RigParts::make_moving_surface() {
  std::vector<bool> points(face.skin.points.size(), false);
  for (const Pull& pull : rig.pulls) points[pull.point] = true;
  for (const RigTables::Eye& eye : rig.eyes) {
    for (const RigTables::LidPoint& p : eye.points) points[p.point] = true;
  }
  for (const RigTables::JawPoint& p : rig.jaw_points) points[p.point] = true;
  for (const RigTables::LipPoint& p : rig.lip_points) points[p.point] = true;
  for (const RigTables::MouthPoint& p : rig.mouth_points) points[p.index] = true;

  const SparseMatrix& t = face.skin.surface;
  std::vector<bool> vertices(t.rows, false);
  for (std::uint32_t v = 0; v < t.rows; ++v) {
    for (std::uint32_t k = t.row_begin[v]; k < t.row_begin[v + 1]; ++k)
      vertices[v] = vertices[v] || points[t.column[k]];
  }
  // What is held apart from something is put back by the points first.
  for (const RigTables::Eye& eye : rig.eyes) {
    for (const RigTables::EyeVertex& v : eye.vertices) vertices[v.vertex] = true;
  }
  for (const RigTables::LipVertex& v : rig.lip_vertices) vertices[v.vertex] = true;
  for (const RigTables::MouthPoint& v : rig.mouth_vertices) vertices[v.index] = true;

  std::vector<std::uint32_t> rows;
  for (std::uint32_t v = 0; v < t.rows; ++v) {
    if (vertices[v]) rows.push_back(v);
  }
  rig.moving_rows = row_blocks(t, rows);
  rig.moving_normals = normal_sums(face.skin.primitives, vertices);
}

void make_surface(const Face& face, const Rig& rig, Pose& pose) {
  const RigTables& t = rig.tables();
  for (std::size_t i = 0; i < pose.points.size(); ++i) pose.x[i] = glm::vec3(pose.points[i]);
  multiply(t.moving_rows, pose.x, face.skin.offsets, pose.positions);
  hold_vertices_apart(rig, pose);
  area_weighted_normals(t.moving_normals, pose.positions, pose.scratch, pose.normals);
}

void make_whole_surface(const Face& face, const Rig& rig, Pose& pose) {
  for (std::size_t i = 0; i < pose.points.size(); ++i) pose.x[i] = glm::vec3(pose.points[i]);
  multiply(face.skin.surface, pose.x, pose.positions);
  for (std::size_t v = 0; v < pose.positions.size(); ++v) pose.positions[v] += face.skin.offsets[v];
  hold_vertices_apart(rig, pose);
  area_weighted_normals(face.skin.primitives, pose.positions, pose.normals);
}

}  // namespace nms::runtime
