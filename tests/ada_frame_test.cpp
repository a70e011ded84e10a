#include <cstddef>
#include <cstdlib>
#include <new>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <nms/program/play.h>
#include <nms/runtime/mesh_normals.h>
#include <nms/runtime/rig.h>
#include <nms/runtime/sparse_matrix.h>

#include "ada_fixture.h"

namespace {

// Every `new` of this program is counted.
std::size_t allocations = 0;

void* counted(std::size_t bytes, std::size_t alignment) {
  ++allocations;
  const std::size_t rounded = (bytes + alignment - 1) / alignment * alignment;
  void* made = std::aligned_alloc(alignment, rounded == 0 ? alignment : rounded);
  if (made == nullptr) std::abort();
  return made;
}

}  // namespace

// Not inlined: g++ 12 warns where it sees `new` and `free` of one pointer together.
[[gnu::noinline]] void* operator new(std::size_t bytes) { return counted(bytes, alignof(std::max_align_t)); }
[[gnu::noinline]] void* operator new(std::size_t bytes, std::align_val_t alignment) {
  return counted(bytes, static_cast<std::size_t>(alignment));
}
[[gnu::noinline]] void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept {
  return counted(bytes, alignof(std::max_align_t));
}
[[gnu::noinline]] void operator delete(void* made) noexcept { std::free(made); }
[[gnu::noinline]] void operator delete(void* made, const std::nothrow_t&) noexcept { std::free(made); }
[[gnu::noinline]] void operator delete(void* made, std::size_t) noexcept { std::free(made); }
[[gnu::noinline]] void operator delete(void* made, std::align_val_t) noexcept { std::free(made); }
[[gnu::noinline]] void operator delete(void* made, std::size_t, std::align_val_t) noexcept { std::free(made); }

namespace nms::ada {
namespace {

TEST(AdaFrame, allocates_nothing) {
  const Bound& b = all_units();
  const program::Program& program = b.image.program();
  std::vector<program::Player> players;
  for (const program::Clip& clip : program.clips) players.emplace_back(program, clip);
  runtime::Pose pose = runtime::make_pose(face(), b.rig);
  std::vector<float> values(program.channels.size(), 0.0F);
  std::vector<float> faded(values.size());
  std::vector<glm::vec3> positions(pose.positions.size());
  std::vector<glm::vec3> normals(pose.positions.size());
  for (program::Player& player : players) player.advance(0, values);  // each takes its room at its first frame
  ASSERT_GT(players.size(), 40U);

  const std::size_t before = allocations;
  for (program::Player& player : players) {
    for (const std::int64_t t : {400'000'000, 900'000'000, 100'000'000}) {
      player.advance(t, values);
      runtime::pose_face(face(), b.rig, values, pose);
      runtime::place_skin(b.rig, pose, positions, normals);
    }
  }
  EXPECT_EQ(allocations, before);

  // The counter counts.
  ::operator delete(::operator new(1));
  EXPECT_GT(allocations, before);
}

TEST(AdaFrame, surface_has_the_bits_of_the_plain_product) {
  const Bound& b = all_units();
  runtime::Pose pose = runtime::make_pose(face(), b.rig);
  std::vector<glm::vec3> plain(pose.positions.size());
  std::vector<glm::vec3> normals(pose.positions.size());
  std::mt19937 random(11);
  for (int frame = 0; frame < 40; ++frame) {
    std::vector<float> values(b.rig.channel_count(), 0.0F);
    for (int k = 0; k < 6; ++k) values[random() % values.size()] = static_cast<float>(random() % 101) / 100.0F;
    runtime::pose_face(face(), b.rig, values, pose);
    runtime::multiply(face().skin.surface, pose.x, plain);
    for (std::size_t v = 0; v < plain.size(); ++v) plain[v] += face().skin.offsets[v];
    std::swap(plain, pose.positions);
    runtime::hold_vertices_apart(b.rig, pose);
    std::swap(plain, pose.positions);
    runtime::area_weighted_normals(face().skin.primitives, plain, normals);
    for (std::size_t v = 0; v < plain.size(); ++v) {
      ASSERT_EQ(pose.positions[v], plain[v]) << "frame " << frame << ", vertex " << v;
      ASSERT_EQ(pose.normals[v], normals[v]) << "frame " << frame << ", vertex " << v;
    }
  }
}

}  // namespace
}  // namespace nms::ada
