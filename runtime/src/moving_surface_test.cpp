#include <cstdint>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <nms/runtime/mesh_normals.h>
#include <nms/runtime/rig.h>
#include <nms/runtime/sparse_matrix.h>

#include "test_face.h"

namespace nms::runtime {
namespace {

TEST(RowBlocks, GiveTheBitsOfThePlainProduct) {
  std::mt19937 random(5);
  const auto number = [&] { return static_cast<float>(random() % 2001) / 1000.0F - 1.0F; };
  SparseMatrix m;
  m.rows = 53;
  m.columns = 31;
  m.row_begin.push_back(0);
  for (std::uint32_t r = 0; r < m.rows; ++r) {
    for (std::uint32_t c = 0; c < m.columns; ++c) {
      if (r == 7 || random() % 3 != 0) continue;  // one row has nothing
      m.column.push_back(c);
      m.value.push_back(number());
    }
    m.row_begin.push_back(static_cast<std::uint32_t>(m.column.size()));
  }
  std::vector<glm::vec3> x(m.columns);
  for (glm::vec3& v : x) v = {number(), number(), number()};
  std::vector<glm::vec3> offsets(m.rows);
  for (glm::vec3& v : offsets) v = {number(), number(), number()};
  std::vector<glm::vec3> plain(m.rows);
  multiply(m, x, plain);

  std::vector<std::uint32_t> rows;
  for (std::uint32_t r = 0; r < m.rows; ++r) {
    if (r % 5 != 2) rows.push_back(r);
  }
  const glm::vec3 before(7.0F, 8.0F, 9.0F);
  std::vector<glm::vec3> out(m.rows, before);
  multiply(row_blocks(m, rows), x, offsets, out);
  for (std::uint32_t r = 0; r < m.rows; ++r) EXPECT_EQ(out[r], r % 5 == 2 ? before : plain[r] + offsets[r]) << r;
}

class MovingSurface : public testing::Test {
 protected:
  std::vector<float> some_values() {
    std::vector<float> values(rig_.channel_count(), 0.0F);
    for (float& v : values) v = random_() % 3 == 0 ? static_cast<float>(random_() % 101) / 100.0F : 0.0F;
    return values;
  }

  Face face_ = test_face();
  program::Image image_ = test_program();
  Rig rig_ = bind(face_, image_.program()).value();
  std::mt19937 random_{3};
};

TEST_F(MovingSurface, SumsOfNormalsAreThoseOfAllTriangles) {
  Pose pose = make_pose(face_, rig_);
  std::vector<glm::vec3> normals(pose.normals.size());
  for (int frame = 0; frame < 50; ++frame) {
    pose_face(face_, rig_, some_values(), pose);
    area_weighted_normals(face_.skin.primitives, pose.positions, normals);
    for (std::size_t v = 0; v < normals.size(); ++v) ASSERT_EQ(pose.normals[v], normals[v]) << frame << " " << v;
  }
}

TEST_F(MovingSurface, NoVertexIsForgotten) {
  Pose pose = make_pose(face_, rig_);
  std::vector<glm::vec3> plain(pose.positions.size());
  for (int frame = 0; frame < 50; ++frame) {
    pose_face(face_, rig_, some_values(), pose);
    multiply(face_.skin.surface, pose.x, plain);
    for (std::size_t v = 0; v < plain.size(); ++v) plain[v] += face_.skin.offsets[v];
    std::swap(plain, pose.positions);
    hold_vertices_apart(rig_, pose);
    std::swap(plain, pose.positions);
    for (std::size_t v = 0; v < plain.size(); ++v) {
      ASSERT_EQ(pose.positions[v], plain[v]) << frame << " " << v;
    }
  }
  // And not everything was taken for moving.
  EXPECT_LE(rig_.tables().moving_normals.vertices.size(), plain.size());
}

}  // namespace
}  // namespace nms::runtime
