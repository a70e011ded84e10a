#include <nms/runtime/rig.h>

#include <cmath>
#include <cstring>
#include <random>

#include <gtest/gtest.h>

#include "test_face.h"

namespace nms::runtime {
namespace {

std::size_t channel_index(const program::Program& program, std::string_view name) {
  for (std::size_t i = 0; i < program.channels.size(); ++i) {
    if (program.string(program.channels[i].name) == name) return i;
  }
  ADD_FAILURE() << "no channel " << name;
  return 0;
}

class RigTest : public testing::Test {
 protected:
  RigTest() : rest_(make_pose(face_, rig_)), pose_(make_pose(face_, rig_)), values_(rig_.channel_count(), 0.0F) {
    pose_face(face_, rig_, values_, rest_);
  }
  void set(std::string_view name, float value) { values_[channel_index(image_.program(), name)] = value; }
  void pose() { pose_face(face_, rig_, values_, pose_); }

  Face face_ = test_face();
  program::Image image_ = test_program();
  Rig rig_ = bind(face_, image_.program()).value();
  Pose rest_;
  Pose pose_;
  std::vector<float> values_;
};

// Values that any merge may give.
void randomise(std::mt19937& random, const program::Program& program, std::vector<float>& values) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    const float u = static_cast<float>(random() >> 8U) / 16777216.0F;
    const bool off = random() % 3 == 0;
    values[i] = off ? 0.0F : program.channels[i].kind == program::ChannelKind::axis ? 2.0F * u - 1.0F : u;
  }
}

TEST_F(RigTest, RestIsRest) {
  for (std::size_t i = 0; i < face_.skin.points.size(); ++i) {
    EXPECT_EQ(rest_.points[i], face_.skin.points[i]);
    EXPECT_EQ(rest_.positions[i], glm::vec3(face_.skin.points[i]));
  }
  std::mt19937 random(3);
  randomise(random, image_.program(), values_);
  pose();
  std::fill(values_.begin(), values_.end(), 0.0F);
  pose();
  EXPECT_EQ(std::memcmp(pose_.positions.data(), rest_.positions.data(), rest_.positions.size() * sizeof(glm::vec3)), 0);
}

TEST_F(RigTest, NoMixtureBreaksTheFace) {
  std::mt19937 random(7);
  std::vector<glm::vec3> positions(pose_.positions.size());
  std::vector<glm::vec3> normals(pose_.positions.size());
  for (int round = 0; round < 200; ++round) {
    randomise(random, image_.program(), values_);
    pose();
    place_skin(rig_, pose_, positions, normals);
    for (std::size_t v = 0; v < positions.size(); ++v) {
      ASSERT_TRUE(std::isfinite(positions[v].x) && std::isfinite(positions[v].y) && std::isfinite(positions[v].z));
      const glm::vec3 n = normals[v];
      ASSERT_NEAR(n.x * n.x + n.y * n.y + n.z * n.z, 1.0F, 1e-4F);
      const glm::vec3 d = pose_.positions[v] - rest_.positions[v];
      ASSERT_LT(std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z), 0.12F);
    }
  }
}

TEST_F(RigTest, LidsNeverCutTheEyeballNorCross) {
  std::mt19937 random(11);
  for (int round = 0; round < 200; ++round) {
    randomise(random, image_.program(), values_);
    set("AU26", 0.0F);
    pose();
    for (std::size_t e = 0; e < kEyeCount; ++e) {
      EXPECT_LE(pose_.lids[e].upper + pose_.lids[e].lower, 1.0201);
      const RigTables::Eye& eye = rig_.tables().eyes[e];
      ASSERT_FALSE(eye.points.empty());
      for (const RigTables::LidPoint& p : eye.points) {
        const glm::dvec3 v = pose_.points[p.point] - eye.centre;
        ASSERT_GE(std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z), kTestEyeRadius - 1e-9);
      }
    }
  }
}

TEST_F(RigTest, ABlinkBringsEveryColumnToTheOtherLid) {
  set("AU45L", 1.0F);
  pose();
  EXPECT_NEAR(pose_.lids[0].upper, 1.0, 1e-6);
  EXPECT_EQ(pose_.lids[1].upper, 0.0);
  const RigTables::Eye& eye = rig_.tables().eyes[0];
  const std::vector<float>& upper = face_.regions.at("lid_upper_left");
  const std::vector<float>& lower = face_.regions.at("lid_lower_left");
  for (std::size_t i = 0; i < upper.size(); ++i) {
    if (upper[i] < 1.0F) continue;
    double nearest = 1.0;
    for (std::size_t j = 0; j < lower.size(); ++j) {
      if (lower[j] < 1.0F) continue;
      const glm::dvec3 d = pose_.points[i] - pose_.points[j];
      nearest = std::min(nearest, std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z));
    }
    EXPECT_LT(nearest, 0.0006);  // a little past it, towards the corners
  }
  EXPECT_NEAR(eye.closing_angle, 34.0 * 3.14159265 / 180.0, 0.01);
}

TEST_F(RigTest, ASquintAndABlinkStopAtContact) {
  set("AU45L", 1.0F);
  set("AU7L", 1.0F);
  pose();
  EXPECT_NEAR(pose_.lids[0].lower, 0.3, 1e-6);
  EXPECT_NEAR(pose_.lids[0].upper, 1.02 - 0.3, 1e-6);
}

// Where lids meet goes up with the eye; none opens.
TEST_F(RigTest, NoGazeOpensAShutEye) {
  set("AU45L", 1.0F);
  set("gaze_pitch", 1.0F);  // up
  pose();
  EXPECT_NEAR(pose_.lids[0].upper + pose_.lids[0].lower, 1.0, 1e-6);
  EXPECT_GT(pose_.lids[0].lower, 0.05);
  EXPECT_LT(pose_.lids[1].upper, 0.0);
  // Half shut, the gaze opens half as far.
  const double opened = -(pose_.lids[1].upper + pose_.lids[1].lower);
  set("AU45L", 0.5F);
  pose();
  EXPECT_NEAR(pose_.lids[0].upper + pose_.lids[0].lower, 0.5 - 0.5 * opened, 1e-6);
}

TEST_F(RigTest, LidsFollowTheGaze) {
  set("gaze_pitch", -1.0F);  // down
  pose();
  EXPECT_GT(pose_.lids[0].upper, 0.5);
  EXPECT_LT(pose_.lids[0].lower, 0.0);
  // and the eyes look down: forward turns to -y
  const glm::dvec3 forward = pose_.placements[3].rotation * glm::dvec3(0, 0, 1);
  EXPECT_LT(forward.y, -0.4);
  set("gaze_pitch", 1.0F);
  pose();
  EXPECT_LT(pose_.lids[0].upper, 0.0);
}

TEST_F(RigTest, LeftMirrorsRight) {
  const std::vector<std::uint32_t> mirror = mirrored_points(face_);
  Pose other = make_pose(face_, rig_);
  std::mt19937 random(5);
  for (int round = 0; round < 20; ++round) {
    randomise(random, image_.program(), values_);
    set("head_yaw", 0.0F);
    std::vector<float> swapped = values_;
    for (std::size_t i = 0; i + 1 < values_.size(); ++i) {
      if (image_.program().channels[i].side == program::Side::left) std::swap(swapped[i], swapped[i + 1]);
    }
    pose();
    pose_face(face_, rig_, swapped, other);
    for (std::size_t i = 0; i < mirror.size(); ++i) {
      // The mask's diagonals all run one way, and a puffed cheek follows its normals.
      const glm::dvec3 a = pose_.points[i];
      const glm::dvec3 b = other.points[mirror[i]];
      ASSERT_NEAR(a.x, -b.x, 1e-6);
      ASSERT_NEAR(a.y, b.y, 1e-6);
      ASSERT_NEAR(a.z, b.z, 1e-6);
    }
  }
}

TEST_F(RigTest, TheJawTakesItsSkinAlong) {
  set("AU26", 1.0F);
  pose();
  const std::vector<float>& jaw = face_.regions.at("jaw");
  const Placement& placement = pose_.placements[static_cast<std::size_t>(Frame::jaw)];
  for (std::size_t i = 0; i < jaw.size(); ++i) {
    const glm::dvec3 rest = face_.skin.points[i];
    const glm::dvec3 whole = placement.rotation * rest + placement.translation;
    const glm::dvec3 expected = rest + static_cast<double>(jaw[i]) * (whole - rest);
    EXPECT_NEAR(pose_.points[i].y, expected.y, 1e-12);
    if (jaw[i] == 1.0F && rest.y > -0.12) {
      EXPECT_LT(pose_.points[i].y, rest.y);
    }
  }
}

TEST_F(RigTest, LipsDoNotPassThroughOneAnother) {
  set("AU24", 1.0F);  // pulls the lower lip up by 6 mm
  pose();
  const std::vector<float>& upper = face_.regions.at("lip_upper");
  const std::vector<float>& lower = face_.regions.at("lip_lower");
  const auto edge = [&](const std::vector<float>& region, double x, bool lowest) {
    double y = lowest ? 1.0 : -1.0;
    for (std::size_t i = 0; i < region.size(); ++i) {
      if (region[i] < 1.0F || std::abs(face_.skin.points[i].x - x) > 1e-6) continue;
      y = lowest ? std::min(y, pose_.points[i].y) : std::max(y, pose_.points[i].y);
    }
    return y;
  };
  for (int i = -9; i <= 9; ++i) {
    const double x = i * 0.0025;
    EXPECT_GE(edge(upper, x, true) - edge(lower, x, false), 0.0);
    EXPECT_LE(edge(upper, x, true) - edge(lower, x, false), 0.0012);
  }
  EXPECT_LT(pose_.points[face_.skin.points.size() - 1].y, -0.03);
}

TEST_F(RigTest, TheTongueComesOutByItsTip) {
  set("AU19", 1.0F);
  pose();
  std::size_t mesh = 0;
  while (face_.rigid[mesh].name != "tongue") ++mesh;
  const std::vector<glm::vec3>& rest = face_.rigid[mesh].positions;
  ASSERT_EQ(pose_.parts[mesh].size(), rest.size());
  for (std::size_t v = 0; v < rest.size(); ++v) {
    // Two vertices in front, two behind; the root takes 30 % of the way.
    const float expected = rest[v].z > 0.06F ? 0.02F : 0.006F;
    EXPECT_NEAR(pose_.parts[mesh][v].z - rest[v].z, expected, 2e-5F);
  }
  const auto id = program::ChannelId{static_cast<std::uint32_t>(channel_index(image_.program(), "AU19"))};
  EXPECT_TRUE(rig_.actuated(id));
  EXPECT_FALSE(rig_.moves_skin(id));
  EXPECT_TRUE(rig_.moves_part(id, static_cast<std::uint32_t>(mesh)));
}

TEST_F(RigTest, TheBustStaysWhenTheHeadTurns) {
  set("head_yaw", 1.0F);
  set("head_pitch", 0.5F);
  set("head_thrust", 1.0F);
  pose();
  std::vector<glm::vec3> positions(pose_.positions.size());
  std::vector<glm::vec3> normals(pose_.positions.size());
  place_skin(rig_, pose_, positions, normals);
  const std::vector<float>& neck = face_.regions.at("neck");
  const glm::dvec3 pivot = rig_.pivot(Frame::head);
  for (std::size_t i = 0; i < neck.size(); ++i) {
    const glm::vec3 d = positions[i] - rest_.positions[i];
    if (neck[i] == 0.0F) {
      EXPECT_LT(std::abs(d.x) + std::abs(d.y) + std::abs(d.z), 1e-6F);
    }
    if (neck[i] == 1.0F) {
      const glm::dvec3 a = glm::dvec3(positions[i]) - pivot - glm::dvec3(0.0, 0.0, 0.04);
      const glm::dvec3 b = glm::dvec3(rest_.positions[i]) - pivot;
      EXPECT_NEAR(a.x * a.x + a.y * a.y + a.z * a.z, b.x * b.x + b.y * b.y + b.z * b.z, 1e-7);
    }
  }
  // Yaw first, then pitch: R = R_y R_x. Head up by half of 0.8 rad turned to the left by 1.3.
  const glm::dvec3 forward = pose_.placements[1].rotation * glm::dvec3(0, 0, 1);
  EXPECT_NEAR(forward.y, std::sin(0.4), 1e-6);
  EXPECT_NEAR(forward.x, std::cos(0.4) * std::sin(1.3), 1e-6);
}

TEST_F(RigTest, ContractionsAddAndSaturate) {
  set("AU7L", 1.0F);
  set("AU45L", 0.5F);
  std::vector<float> k(rig_.muscle_count());
  contractions(rig_, values_, k);
  std::size_t lid = 0;
  while (image_.program().string(image_.program().muscles[lid].name) != "lid_L") ++lid;
  EXPECT_FLOAT_EQ(k[lid], 0.62F);
  set("AU45L", 1.0F);
  contractions(rig_, values_, k);
  EXPECT_FLOAT_EQ(k[lid], 1.0F);
}

TEST_F(RigTest, SaysWhatIsNotActuated) {
  const auto id = [&](std::string_view name) {
    return program::ChannelId{static_cast<std::uint32_t>(channel_index(image_.program(), name))};
  };
  EXPECT_FALSE(rig_.actuated(id("AU66")));
  EXPECT_TRUE(rig_.actuated(id("AU12L")));
  EXPECT_TRUE(rig_.moves_skin(id("AU26")));
  EXPECT_TRUE(rig_.actuated(id("head_yaw")));
  EXPECT_FALSE(rig_.moves_skin(id("head_yaw")));
  EXPECT_TRUE(rig_.moves_skin(id("gaze_pitch")));
}

// One hash over 50 poses: the same for every compiler, build type and processor.
TEST_F(RigTest, GivesTheSameBitsEverywhere) {
  std::uint64_t hash = 0xCBF29CE484222325U;
  std::mt19937 random(13);
  for (int round = 0; round < 50; ++round) {
    randomise(random, image_.program(), values_);
    pose();
    for (const glm::vec3& p : pose_.positions) {
      for (const float f : {p.x, p.y, p.z}) {
        std::uint32_t bits = 0;
        std::memcpy(&bits, &f, sizeof bits);
        for (int i = 0; i < 4; ++i) hash = (hash ^ ((bits >> (8 * i)) & 0xFFU)) * 0x100000001B3U;
      }
    }
  }
  EXPECT_EQ(hash, 13622112317817972475U);
}

TEST(RigBinding, NamesTheMuscleAndTheLandmarkThatIsMissing) {
  const Face face = test_face();
  const program::Image image = test_program();
  program::Program program = image.program();
  std::vector<program::Landmark> landmarks;
  for (const program::Landmark& mark : program.landmarks) {
    if (!program.string(mark.name).starts_with("cheek")) landmarks.push_back(mark);
  }
  program.landmarks = landmarks;
  const auto rig = bind(face, program);
  ASSERT_FALSE(rig.has_value());
  EXPECT_EQ(rig.error().kind, "missing_landmark");
  EXPECT_EQ(rig.error().place, "muscle puff_L");
  EXPECT_NE(rig.error().cause.find("cheek"), std::string::npos);
}

TEST(RigBinding, RefusesAFaceWithoutTheRegionAMuscleNeeds) {
  Face face = test_face();
  face.regions.erase("jaw");
  const program::Image image = test_program();
  const auto rig = bind(face, image.program());
  ASSERT_FALSE(rig.has_value());
  EXPECT_EQ(rig.error().kind, "missing_region");
  EXPECT_EQ(rig.error().place, "muscle jaw_opener");
}

TEST(RigBinding, RefusesAFaceWhoseTablesDisagree) {
  Face face = test_face();
  face.skin.primitives[0].triangles[5] = 1'000'000;
  const program::Image image = test_program();
  const auto rig = bind(face, image.program());
  ASSERT_FALSE(rig.has_value());
  EXPECT_EQ(rig.error().kind, "bad_face");
}

}  // namespace
}  // namespace nms::runtime
