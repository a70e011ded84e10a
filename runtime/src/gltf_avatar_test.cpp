#include <nms/runtime/gltf_avatar.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include <gtest/gtest.h>
#include <tiny_gltf.h>

#include <nms/program/evaluate.h>
#include <nms/runtime/gltf_export.h>
#include <nms/runtime/rig.h>

#include "avatar_targets.h"
#include "glb_chunks.h"
#include "test_face.h"
#include "test_glb.h"

namespace nms::runtime {
namespace {

constexpr const char* kClip = R"(
clip ask utterance -0.2s..1s hash 0000000000000001
  curve AU12L
    -0.2s 0 smooth
    0.1s 0.8 smooth
    1s 0 hold
  curve AU26
    0s 0 linear
    0.5s 0.5 linear
    1s 0 hold
  curve AU45L
    0s 0 linear
    0.1s 1 linear
    0.2s 0 hold
  curve head_yaw
    0s 0 smooth
    0.5s 0.5 smooth
    1s 0 hold
  curve gaze_pitch
    0s 0 smooth
    0.5s -0.5 smooth
    1s 0 hold
)";

/// A triangle with morph targets of the names given, as primitives and names of a mesh.
std::string mesh(const std::vector<std::string>& names) {
  std::string targets;
  std::string list;
  for (const std::string& name : names) {
    targets += (targets.empty() ? "" : ",") + std::string(R"({"POSITION":1})");
    list += (list.empty() ? "" : ",") + ("\"" + name + "\"");
  }
  return R"({"primitives":[{"attributes":{"POSITION":0},"targets":[)" + targets + R"(]}],"extras":{"targetNames":[)" +
         list + "]}}";
}

std::vector<std::byte> glb(const std::string& meshes, const std::string& nodes, const std::string& more) {
  GlbChunks chunks;
  chunks.json = nlohmann::ordered_json::parse(
      R"({"zebra":1,"asset":{"version":"2.0","copyright":"someone"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[)" +
      nodes + R"(],"meshes":[)" + meshes +
      R"(],"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},)"
      R"({"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],)"
      R"("bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36}])" +
      more + "}");
  const float triangle[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  chunks.binary.resize(36);
  std::memcpy(chunks.binary.data(), triangle, 36);
  return write_glb(chunks);
}

/// Head and teeth with ARKit's names in different order and spelling; a head bone under a parent that is turned.
std::vector<std::byte> arkit_avatar() {
  return glb(mesh({"mouthSmileLeft", "jawOpen", "eyeBlink_L", "hairPuff"}) + "," + mesh({"JawOpen"}),
             R"({"name":"root","rotation":[0,0.70710678,0,0.70710678],"children":[1,2,3]},)"
             R"({"name":"face","mesh":0,"weights":[0,0,0,0.25]},{"name":"teeth","mesh":1},)"
             R"({"name":"mixamorig:Head","children":[4,5],"rotation":[0,0,0.38268343,0.92387953]},)"
             R"({"name":"LeftEye"},{"name":"RightEye","matrix":[1,0,0,0,0,1,0,0,0,0,1,0,2,3,4,1]})",
             "");
}

class Avatar : public testing::Test {
 protected:
  Avatar() : image_(test_program(kClip)), clip_(image_.program().find_clip("ask")) {}

  tl::expected<AnimatedAvatar, program::Failure> animate(const std::vector<std::byte>& bytes) {
    const program::Clip* clips[] = {clip_};
    return animate_avatar(bytes, "avatar.glb", image_.program(), clips);
  }

  /// The values of a channel of the first animation at a time, straight between its keys.
  static std::vector<float> sampled(const tinygltf::Model& model, int node, const std::string& path, float t) {
    for (const tinygltf::AnimationChannel& c : model.animations.at(0).channels) {
      if (c.target_node != node || c.target_path != path) continue;
      const tinygltf::AnimationSampler& s = model.animations[0].samplers[static_cast<std::size_t>(c.sampler)];
      const std::size_t keys = model.accessors[static_cast<std::size_t>(s.input)].count;
      const std::size_t width = model.accessors[static_cast<std::size_t>(s.output)].count *
                                (path == "weights"    ? 1
                                 : path == "rotation" ? 4
                                                      : 3) /
                                keys;
      const float* times = floats(model, s.input);
      const float* values = floats(model, s.output);
      std::size_t k = 0;
      while (k + 1 < keys && times[k + 1] <= t) ++k;
      const std::size_t next = std::min(k + 1, keys - 1);
      const float u = next == k ? 0.0F : (t - times[k]) / (times[next] - times[k]);
      std::vector<float> out(width);
      for (std::size_t i = 0; i < width; ++i)
        out[i] = values[k * width + i] + u * (values[next * width + i] - values[k * width + i]);
      return out;
    }
    return {};
  }

  float value(const char* channel, std::int64_t t) {
    std::vector<float> values(image_.program().channels.size());
    program::evaluate(image_.program(), *clip_, t, values);
    for (std::size_t i = 0; i < values.size(); ++i)
      if (image_.program().string(image_.program().channels[i].name) == channel) return values[i];
    return -9.0F;
  }

  program::Image image_;
  const program::Clip* clip_;
};

TEST_F(Avatar, arkit_targets_follow_their_units_on_every_mesh) {
  const auto made = animate(arkit_avatar());
  ASSERT_TRUE(made.has_value());
  const tinygltf::Model model = read_model(made->glb);
  ASSERT_EQ(model.animations.size(), 1U);
  EXPECT_EQ(model.animations[0].name, "ask");
  for (const float t : {0.0F, 0.25F, 0.3F, 0.5F, 0.7F, 1.1F}) {
    const auto clip_time = static_cast<std::int64_t>((t - 0.2F) * 1e9F);  // the clip begins at -0.2 s
    const auto face = sampled(model, 1, "weights", t);
    const auto teeth = sampled(model, 2, "weights", t);
    ASSERT_EQ(face.size(), 4U);
    ASSERT_EQ(teeth.size(), 1U);
    EXPECT_NEAR(face[0], value("AU12L", clip_time), 0.003F) << t;
    EXPECT_NEAR(face[1], 0.7F * value("AU26", clip_time), 0.003F) << t;
    EXPECT_NEAR(face[2], value("AU45L", clip_time), 0.003F) << t;
    EXPECT_EQ(face[3], 0.25F) << "what no clip speaks of stays as it is in the file";
    EXPECT_NEAR(teeth[0], face[1], 0.003F);
  }
  EXPECT_EQ(made->targets, (std::vector<std::string>{"mouthSmileLeft", "jawOpen", "eyeBlink_L", "JawOpen"}));
}

TEST_F(Avatar, the_head_turns_about_the_worlds_axis_on_top_of_its_rest) {
  const auto made = animate(arkit_avatar());
  ASSERT_TRUE(made.has_value());
  const tinygltf::Model model = read_model(made->glb);
  const auto q = sampled(model, 3, "rotation", 0.7F);  // 0.5 s: full turn
  ASSERT_EQ(q.size(), 4U);
  float full_scale = 0.0F;
  for (const program::Channel& c : image_.program().channels)
    if (image_.program().string(c.name) == "head_yaw") full_scale = c.full_scale;
  // The parent is turned about y, as the head is: the two commute, and the head's rest is a turn about z.
  const double half = 0.5 * 0.5 * static_cast<double>(full_scale);
  const glm::dquat expected =
      glm::dquat(std::cos(half), 0.0, std::sin(half), 0.0) * glm::dquat(0.92387953, 0.0, 0.0, 0.38268343);
  EXPECT_NEAR(q[0], expected.x, 1e-3);
  EXPECT_NEAR(q[1], expected.y, 1e-3);
  EXPECT_NEAR(q[2], expected.z, 1e-3);
  EXPECT_NEAR(q[3], expected.w, 1e-3);
}

TEST_F(Avatar, eyes_without_targets_turn_their_bones_and_a_matrix_becomes_members) {
  const auto made = animate(arkit_avatar());
  ASSERT_TRUE(made.has_value());
  EXPECT_EQ(made->bones, (std::vector<std::string>{"mixamorig:Head", "LeftEye", "RightEye"}));
  const tinygltf::Model model = read_model(made->glb);
  EXPECT_EQ(sampled(model, 5, "rotation", 0.7F).size(), 4U);
  EXPECT_TRUE(model.nodes[5].matrix.empty());
  EXPECT_EQ(model.nodes[5].translation, (std::vector<double>{2, 3, 4}));
  EXPECT_TRUE(made->unshown.empty());
}

TEST_F(Avatar, the_rest_of_the_file_stays_as_it_was) {
  const auto before = arkit_avatar();
  const auto made = animate(before);
  ASSERT_TRUE(made.has_value());
  const auto old_chunks = read_glb(before, "before");
  const auto chunks = read_glb(made->glb, "after");
  ASSERT_TRUE(old_chunks && chunks);
  EXPECT_EQ(chunks->json.begin().key(), "zebra") << "members keep their order";
  for (const char* same : {"zebra", "asset", "scenes", "meshes"}) EXPECT_EQ(chunks->json[same], old_chunks->json[same]);
  EXPECT_TRUE(std::equal(old_chunks->binary.begin(), old_chunks->binary.end(), chunks->binary.begin()));
  EXPECT_FALSE(animate(made->glb).has_value()) << "the same clip a second time";
}

TEST_F(Avatar, vrm_expressions_drive_what_they_are_bound_to) {
  const auto made = animate(glb(
      mesh({"a", "b", "c"}), R"({"name":"face","mesh":0},{"name":"J_Head"})",
      R"(,"extensions":{"VRMC_vrm":{"specVersion":"1.0","humanoid":{"humanBones":{"head":{"node":1}}},"expressions":{)"
      R"("preset":{"blinkLeft":{"morphTargetBinds":[{"node":0,"index":2,"weight":0.5}]}},)"
      R"("custom":{"MouthSmileLeft":{"morphTargetBinds":[{"node":0,"index":0,"weight":1}]},)"
      R"("jawOpen":{"morphTargetBinds":[{"node":0,"index":77,"weight":1},{"node":12,"index":0,"weight":1}]}}}}})"));
  ASSERT_TRUE(made.has_value());
  const tinygltf::Model model = read_model(made->glb);
  const auto weights = sampled(model, 0, "weights", 0.3F);
  ASSERT_EQ(weights.size(), 3U);
  EXPECT_NEAR(weights[0], 0.8F, 0.003F);
  EXPECT_EQ(weights[1], 0.0F);
  EXPECT_NEAR(weights[2], 0.5F, 0.003F);
  EXPECT_EQ(made->bones, (std::vector<std::string>{"J_Head"}));
  EXPECT_EQ(made->unshown, (std::vector<std::string>{"AU64"}));
}

TEST_F(Avatar, our_own_file_takes_the_clip_that_it_was_made_with) {
  const Face face = test_face();
  const auto rig = bind(face, image_.program());
  ASSERT_TRUE(rig.has_value());
  const auto still = export_glb(face, *rig, test_program().program(), {{}, true, false});
  ASSERT_TRUE(still.has_value()) << still.error().cause;
  const auto made = animate(*still);
  ASSERT_TRUE(made.has_value());
  const tinygltf::Model model = read_model(made->glb);
  const auto names = model.meshes[0].extras.Get("targetNames");
  for (std::size_t i = 0; i < model.nodes.size(); ++i) {
    if (model.nodes[i].mesh != 0) continue;
    const auto weights = sampled(model, static_cast<int>(i), "weights", 0.3F);
    ASSERT_EQ(weights.size(), names.ArrayLen());
    for (std::size_t k = 0; k < names.ArrayLen(); ++k) {
      const std::string name = names.Get(static_cast<int>(k)).Get<std::string>();
      if (name == "AU12L") {
        EXPECT_NEAR(weights[k], 0.8F, 0.003F);
      }
      if (name == "AU12R") {
        EXPECT_EQ(weights[k], 0.0F);
      }
    }
  }
}

TEST_F(Avatar, what_is_no_avatar_is_refused) {
  const auto good = arkit_avatar();
  for (std::size_t cut = 0; cut < good.size(); cut += 7)
    EXPECT_FALSE(animate({good.begin(), good.begin() + static_cast<std::ptrdiff_t>(cut)}).has_value()) << cut;
  const auto kind = [&](const std::vector<std::byte>& bytes) {
    const auto made = animate(bytes);
    return made ? std::string("made") : made.error().kind;
  };
  EXPECT_EQ(kind(glb(mesh({"smirk"}), R"({"mesh":0})", "")), "no_targets");
  EXPECT_EQ(kind(glb(mesh({"jawOpen"}), R"({"mesh":0,"children":[1]},{"children":[0]})", "")), "bad_avatar");
  EXPECT_EQ(kind(glb(mesh({"jawOpen"}), R"({"mesh":0,"children":[7]})", "")), "bad_avatar");
  EXPECT_EQ(kind(glb(mesh({"jawOpen"}), R"({"mesh":0})", R"(,"animations":3)")), "bad_avatar");
  auto chunks = read_glb(arkit_avatar(), "avatar");
  ASSERT_TRUE(chunks.has_value());
  chunks->json["buffers"][0]["byteLength"] = 4'000'000'000U;
  EXPECT_EQ(kind(write_glb(*chunks)), "bad_avatar");
}

TEST(AvatarTargets, names_are_matched_without_case_and_punctuation) {
  for (const char* name : {"eyeBlinkLeft", "EyeBlinkLeft", "eyeBlink_L", "eye-blink-left"}) {
    const auto units = units_of_target(name);
    ASSERT_FALSE(units.empty()) << name;
    EXPECT_EQ(units.front().unit, "AU43L") << name;
  }
  EXPECT_EQ(units_of_target("AU12_L").front().unit, "AU12L");
  EXPECT_EQ(units_of_target("au12right").front().unit, "AU12R");
  EXPECT_EQ(units_of_target("AU26").front().unit, "AU26");
  EXPECT_TRUE(units_of_target("fix.lid_upper_L.50").empty());
  EXPECT_TRUE(units_of_target("viseme_aa").empty());
  EXPECT_TRUE(units_of_target("").empty());
  EXPECT_EQ(units_of_target("eyeLookOutLeft").front().unit, units_of_target("eyeLookInRight").front().unit);
}

}  // namespace
}  // namespace nms::runtime
