#include <nms/runtime/gltf_avatar.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <set>
#include <sstream>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <tiny_gltf.h>

#include <nms/program/evaluate.h>
#include <nms/runtime/gltf_export.h>
#include <nms/runtime/rig.h>

#include "avatar_targets.h"
#include "glb_chunks.h"
#include "json_text.h"
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
  chunks.text =
      R"({"zebra":1,"asset":{"version":"2.0","copyright":"someone"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[)" +
      nodes + R"(],"meshes":[)" + meshes +
      R"(],"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},)"
      R"({"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],)"
      R"("bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36}])" +
      more + "}";
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

TEST_F(Avatar, targets_of_the_gaze_go_before_eye_bones) {
  const auto made = animate(glb(mesh({"eyeLookUpLeft", "eyeLookDownLeft", "eyeLookDownRight", "jawOpen"}),
                                R"({"name":"root","children":[1,2]},{"name":"face","mesh":0},{"name":"LeftEye"})", ""));
  ASSERT_TRUE(made.has_value());
  const tinygltf::Model model = read_model(made->glb);
  const auto weights = sampled(model, 1, "weights", 0.7F);  // 0.5 s: half down
  ASSERT_EQ(weights.size(), 4U);
  EXPECT_EQ(weights[0], 0.0F);
  EXPECT_NEAR(weights[1], 0.5F, 0.003F);
  EXPECT_NEAR(weights[2], 0.5F, 0.003F);
  EXPECT_TRUE(made->bones.empty());
}

TEST_F(Avatar, the_rest_of_the_file_stays_as_it_was) {
  const auto before = arkit_avatar();
  const auto made = animate(before);
  ASSERT_TRUE(made.has_value());
  const auto old = read_glb(before, "before");
  const auto now = read_glb(made->glb, "after");
  ASSERT_TRUE(old && now);
  EXPECT_TRUE(now->chunks.text.starts_with(R"({"zebra":1,"asset":{)")) << "members keep their order";
  for (const char* same : {"zebra", "asset", "scenes", "meshes"}) EXPECT_EQ(now->json[same], old->json[same]);
  EXPECT_TRUE(std::equal(old->chunks.binary.begin(), old->chunks.binary.end(), now->chunks.binary.begin()));
  EXPECT_FALSE(animate(made->glb).has_value()) << "the same clip a second time";
}

/// Texts of the root's members, and of the elements of those that are arrays.
std::vector<std::pair<std::string, std::vector<std::string>>> parts(const std::string& text) {
  std::vector<std::pair<std::string, std::vector<std::string>>> out;
  for (const JsonMember& m : json_members(text, json_value(text, 0))) {
    out.push_back({std::string(m.key.of(text)), {}});
    if (text[m.value.begin] != '[') out.back().second.emplace_back(m.value.of(text));
    for (const TextSpan& e : json_elements(text, m.value)) out.back().second.emplace_back(e.of(text));
  }
  return out;
}

TEST_F(Avatar, no_byte_of_the_rest_changes_however_it_is_written) {
  auto old = read_glb(arkit_avatar(), "before");
  ASSERT_TRUE(old.has_value());
  const std::string odd = R"(, "animations" : [ {"name":"wave", "channels":[],  "samplers":[]} ],
    "extensions":{"XYZ_odd":{"a":1.50,"b":[1e-7,1E+5,-0.0,12345678901234567890123,0.1000],"a":{"\u00e9":"\/]}"}}}})";
  old->chunks.text.replace(old->chunks.text.size() - 1, 1, odd);
  old->chunks.others = {{0x12345678U, {std::byte{1}, std::byte{2}, std::byte{3}, std::byte{4}}}};
  const auto made = animate(write_glb(old->chunks));
  ASSERT_TRUE(made.has_value()) << made.error().cause;
  const auto now = read_glb(made->glb, "after");
  ASSERT_TRUE(now.has_value());
  const auto before = parts(old->chunks.text);
  const auto after = parts(now->chunks.text);
  ASSERT_EQ(before.size(), after.size());
  for (std::size_t i = 0; i < before.size(); ++i) {
    const std::string& key = before[i].first;
    EXPECT_EQ(after[i].first, key);
    const bool grows = key == "animations" || key == "accessors" || key == "bufferViews";
    EXPECT_EQ(after[i].second.size() > before[i].second.size(), grows) << key;
    for (std::size_t k = 0; k < before[i].second.size(); ++k) {
      if (key == "buffers" || (key == "nodes" && k == 5)) continue;  // its length; what had a matrix
      EXPECT_EQ(after[i].second[k], before[i].second[k]) << key << ' ' << k;
    }
  }
  ASSERT_EQ(now->chunks.others.size(), 1U) << "chunks that glTF does not know";
  EXPECT_EQ(now->chunks.others[0].type, 0x12345678U);
  EXPECT_EQ(now->chunks.others[0].data, old->chunks.others[0].data);
  read_model(made->glb);
}

TEST_F(Avatar, a_movement_is_shown_once_by_the_name_that_says_it_best) {
  const auto made = animate(glb(mesh({"mouthSmile", "mouthSmileLeft", "mouthSmileRight", "AU26", "jawOpen",
                                      "eyesClosed", "AU45_blink_L", "eyeBlinkLeft", "AU45_blink_R", "AU12+AU45"}),
                                R"({"mesh":0})", ""));
  ASSERT_TRUE(made.has_value());
  const tinygltf::Model model = read_model(made->glb);
  const auto smile = sampled(model, 0, "weights", 0.3F);
  ASSERT_EQ(smile.size(), 10U);
  const std::vector<float> wanted{0.0F, 0.8F, 0.0F, value("AU26", 100'000'000), 0.0F, 0.0F, 1.0F, 0.0F, 0.0F, 0.0F};
  for (std::size_t i = 0; i < wanted.size(); ++i) EXPECT_NEAR(smile[i], wanted[i], 0.003F) << i;
}

TEST_F(Avatar, a_mesh_called_head_is_not_the_bone) {
  const auto made =
      animate(glb(mesh({"jawOpen"}),
                  R"({"name":"Head","mesh":0,"skin":0},{"name":"Head"},{"name":"Head"},{"name":"mixamorig7:LeftEye"})",
                  R"(,"skins":[{"joints":[2],"inverseBindMatrices":0}])"));
  ASSERT_TRUE(made.has_value());
  const tinygltf::Model model = read_model(made->glb);
  EXPECT_TRUE(sampled(model, 0, "rotation", 0.7F).empty());
  EXPECT_TRUE(sampled(model, 1, "rotation", 0.7F).empty());
  EXPECT_EQ(sampled(model, 2, "rotation", 0.7F).size(), 4U);
  EXPECT_EQ(sampled(model, 3, "rotation", 0.7F).size(), 4U);
}

TEST_F(Avatar, bones_are_found_in_other_rigs_too) {
  const auto made =
      animate(glb(mesh({"a"}),
                  R"({"name":"Forehead"},{"name":"CC_Base_Head","children":[2,3]},{"name":"J_Adj_L_FaceEye"},)"
                  R"({"name":"Eye.R"},{"name":"Bip001 L EyeLid"},{"name":"Base_Head"})",
                  R"(,"skins":[{"joints":[0,1,2,3,4],"inverseBindMatrices":0}])"));
  ASSERT_TRUE(made.has_value()) << made.error().cause;
  EXPECT_EQ(made->bones, (std::vector<std::string>{"CC_Base_Head", "J_Adj_L_FaceEye", "Eye.R"}));
}

/// A head whose third vertex is an eyeball's, by the heaviest of its joints; eyeLookDown moves `moved` alone.
std::vector<std::byte> head_with_eye(std::uint8_t moved) {
  GlbChunks chunks;
  chunks.text =
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,1]}],"nodes":[{"name":"face","mesh":0,"skin":0},)"
      R"({"name":"Head","children":[2]},{"name":"LeftEye"}],"skins":[{"joints":[1,2],"inverseBindMatrices":0}],"meshes":[{"primitives":[{)"
      R"("attributes":{"POSITION":0,"JOINTS_0":1,"WEIGHTS_0":2},"targets":[{"POSITION":3}]}],)"
      R"("extras":{"targetNames":["eyeLookDownLeft"]}}],"accessors":[)"
      R"({"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},)"
      R"({"bufferView":1,"componentType":5121,"count":3,"type":"VEC4"},)"
      R"({"bufferView":2,"componentType":5126,"count":3,"type":"VEC4"},)"
      R"({"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[0,1,0],"sparse":{"count":1,)"
      R"("indices":{"bufferView":3,"componentType":5121},"values":{"bufferView":4}}}],"bufferViews":[)"
      R"({"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":12},)"
      R"({"buffer":0,"byteOffset":48,"byteLength":48},{"buffer":0,"byteOffset":96,"byteLength":1},)"
      R"({"buffer":0,"byteOffset":100,"byteLength":12}],"buffers":[{"byteLength":112}]})";
  chunks.binary.resize(112);
  const auto put = [&](std::size_t at, const auto& values) { std::memcpy(&chunks.binary[at], &values, sizeof values); };
  put(0, std::array<float, 9>{0, 0, 0, 1, 0, 0, 0, 1, 0});
  put(36, std::array<std::uint8_t, 12>{0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0});
  put(48, std::array<float, 12>{1, 0, 0, 0, 0.6F, 0.4F, 0, 0, 0.2F, 0.8F, 0, 0});
  put(96, moved);
  put(100, std::array<float, 3>{0, 1, 0});
  return write_glb(chunks);
}

TEST_F(Avatar, eyes_whose_targets_move_the_lids_alone_turn_their_bones_too) {
  const auto lids = animate(head_with_eye(1));
  const auto eyes = animate(head_with_eye(2));
  ASSERT_TRUE(lids && eyes);
  for (const auto* made : {&*lids, &*eyes})
    EXPECT_NEAR(sampled(read_model(made->glb), 0, "weights", 0.7F).at(0), 0.5F, 0.003F);
  EXPECT_EQ(lids->bones, (std::vector<std::string>{"Head", "LeftEye"}));
  EXPECT_EQ(eyes->bones, (std::vector<std::string>{"Head"})) << "the target turns the eyeball";
}

TEST_F(Avatar, vrm_presets_that_are_bound_to_nothing_show_nothing) {
  const auto file = [&](const char* look) {
    return glb(
        mesh({"shut", "shut_l", "shut_r"}), R"({"name":"face","mesh":0},{"name":"J_Eye_L"})",
        fmt::format(
            R"(,"extensions":{{"VRMC_vrm":{{"specVersion":"1.0","lookAt":{{"type":"{}"}},"humanoid":{{"humanBones":)"
            R"({{"leftEye":{{"node":1}}}}}},"expressions":{{"preset":{{"lookDown":{{"isBinary":false}},)"
            R"("blink":{{"morphTargetBinds":[{{"node":0,"index":0,"weight":1}},{{"node":0,"index":1,"weight":1}},)"
            R"({{"node":0,"index":2,"weight":1}}]}},)"
            R"("blinkLeft":{{"morphTargetBinds":[{{"node":0,"index":1,"weight":1}}]}},)"
            R"("blinkRight":{{"morphTargetBinds":[{{"node":0,"index":2,"weight":1}}]}}}}}}}}}})",
            look));
  };
  for (const char* look : {"bone", "expression"}) {
    const auto made = animate(file(look));
    ASSERT_TRUE(made.has_value()) << made.error().cause;
    const tinygltf::Model model = read_model(made->glb);
    EXPECT_EQ(made->bones, (std::vector<std::string>{"J_Eye_L"}));
    EXPECT_EQ(sampled(model, 1, "rotation", 0.7F).size(), 4U);
    const auto wink = sampled(model, 0, "weights", 0.3F);
    ASSERT_EQ(wink.size(), 3U);
    EXPECT_EQ(wink[0], 0.0F);
    EXPECT_NEAR(wink[1], 1.0F, 0.003F) << "AU45L: the left eye alone";
    EXPECT_EQ(wink[2], 0.0F);
  }
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
  EXPECT_EQ(made->unshown, (std::vector<std::string>{"AU26", "AU64"})) << "jawOpen is bound to what is not there";
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
  auto file = read_glb(arkit_avatar(), "avatar");
  ASSERT_TRUE(file.has_value());
  std::string& text = file->chunks.text;
  text.replace(text.rfind(R"("byteLength":36}])"), 17, R"("byteLength":40}])");
  EXPECT_EQ(kind(write_glb(file->chunks)), "bad_avatar");
}

TEST_F(Avatar, what_is_nested_long_or_heavy_is_refused_or_kept_within_seconds) {
  std::string deep(200'000, '[');
  deep += std::string(200'000, ']');
  EXPECT_TRUE(animate(glb(mesh({"jawOpen"}), R"({"mesh":0})", ",\"extras\":" + deep)).has_value());
  std::string chain;
  for (int n = 1; n <= 100'000; ++n) chain += fmt::format(R"({{"children":[{}]}},)", n);
  EXPECT_FALSE(animate(glb(mesh({"jawOpen"}), chain + R"({"mesh":0})", "")).has_value());
  const std::vector<std::string> many(4096, "jawOpen");
  std::string uses = R"({"mesh":0})";
  for (int n = 0; n < 100; ++n) uses += R"(,{"mesh":0})";
  EXPECT_FALSE(animate(glb(mesh(many), uses, "")).has_value());
}

// ARFaceAnchor.BlendShapeLocation; `#` stands for Left and Right. Three of them no action unit stands for: the mouth
// goes sideways as a whole, or shuts again what the jaw has opened.
TEST(AvatarTargets, of_arkits_52_all_but_three_show_units) {
  const char* names[] = {"browDown#",      "browInnerUp",     "browOuterUp#",    "cheekPuff",       "cheekSquint#",
                         "eyeBlink#",      "eyeLookDown#",    "eyeLookIn#",      "eyeLookOut#",     "eyeLookUp#",
                         "eyeSquint#",     "eyeWide#",        "jawForward",      "jawLeft",         "jawOpen",
                         "jawRight",       "mouthClose",      "mouthDimple#",    "mouthFrown#",     "mouthFunnel",
                         "mouthLeft",      "mouthLowerDown#", "mouthPress#",     "mouthPucker",     "mouthRight",
                         "mouthRollLower", "mouthRollUpper",  "mouthShrugLower", "mouthShrugUpper", "mouthSmile#",
                         "mouthStretch#",  "mouthUpperUp#",   "noseSneer#",      "tongueOut"};
  const std::set<std::string> unshown{"mouthClose", "mouthLeft", "mouthRight"};
  const auto mirrored = [](std::vector<UnitShare> units) {
    for (UnitShare& u : units) {
      if (u.unit.ends_with('L')) {
        u.unit.back() = 'R';
      } else if (u.unit.ends_with('R')) {
        u.unit.back() = 'L';
      } else if (u.unit == "AU61" || u.unit == "AU62") {
        u.unit = u.unit == "AU61" ? "AU62" : "AU61";
      }
    }
    return units;
  };
  const auto said = [](const std::vector<UnitShare>& units) {
    std::string text;
    for (const UnitShare& u : units) text += u.unit + " " + std::to_string(u.share) + " ";
    return text;
  };
  std::size_t count = 0;
  for (const std::string name : names) {
    if (!name.ends_with('#')) {
      ++count;
      EXPECT_EQ(units_of_target(name).units.empty(), unshown.contains(name)) << name;
      continue;
    }
    count += 2;
    const std::string stem = name.substr(0, name.size() - 1);
    const auto left = units_of_target(stem + "Left").units;
    EXPECT_FALSE(left.empty()) << name;
    EXPECT_EQ(said(units_of_target(stem + "Right").units), said(mirrored(left))) << name;
    for (const UnitShare& u : left) EXPECT_FALSE(u.unit.ends_with('R')) << name;
  }
  EXPECT_EQ(count, 52U);
  EXPECT_EQ(said(units_of_target("jawRight").units), said(mirrored(units_of_target("jawLeft").units)));
  EXPECT_EQ(units_of_target("eyeLookOutLeft").units.front().unit, "AU61") << "the eyes turn to the subject's left";
}

// Those of the face; where they are ARKit's names too, those come first, and "Mouth Stretch" means another unit there.
TEST(AvatarTargets, the_units_own_titles_are_names) {
  std::ifstream file(NMS_SOURCE_DIR "/stdlib/facs.nms");
  std::size_t count = 0;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string keyword;
    int number = 0;
    std::string title;
    if (!(words >> keyword >> number) || keyword != "au" || (number > 46 && number != 65 && number != 66)) continue;
    words.ignore(2);
    std::getline(words, title, '"');
    if (title == "Mouth Stretch") continue;
    const bool sides = line.find("sides") != std::string::npos;
    ++count;
    const auto left = units_of_target(title + "_L").units;
    ASSERT_FALSE(left.empty()) << title;
    const std::string unit = "AU" + std::to_string(number) + (sides ? "L" : "");
    EXPECT_TRUE(std::any_of(left.begin(), left.end(), [&](const UnitShare& u) { return u.unit == unit; })) << title;
    EXPECT_FALSE(units_of_target(title).units.empty()) << title;
  }
  EXPECT_EQ(count, 45U);
}

TEST(AvatarTargets, names_are_matched_without_case_and_punctuation) {
  const auto first = [](const char* name) {
    const TargetName found = units_of_target(name);
    return found.units.empty() ? std::string("nothing") : found.units.front().unit;
  };
  for (const char* name : {"eyeBlinkLeft", "EyeBlinkLeft", "eyeBlink_L", "eye-blink-left", "EYE_BLINK.L", "eyeBlinkL",
                           "eyeBlink L", "left_eye_blink", "AU43_L", "au43left", "FACS_AU43Left", "AU043LEyesClosed",
                           "AU43_Eyes_Closed_L", "L_AU43", "blendShape1.AU43_left"})
    EXPECT_EQ(first(name), "AU43L") << name;
  EXPECT_EQ(first("au12right"), "AU12R");
  EXPECT_EQ(first("AU01_inner_brow_raiser_R"), "AU1R");
  EXPECT_EQ(first("AU12_lip_corner_puller"), "AU12");
  EXPECT_EQ(first("AU26"), "AU26");
  EXPECT_EQ(first("AD19"), "AU19");
  EXPECT_EQ(first("browInnerUpRight"), "AU1R");
  EXPECT_EQ(units_of_target("browInnerUpRight").units.size(), 1U);
  EXPECT_EQ(units_of_target("browInnerUp").units.size(), 2U);
  EXPECT_EQ(units_of_target("AU18_R").units.back().unit, "AU18") << "moves with either half";
  for (const char* name :
       {"fix.lid_upper_L.50", "AU12.50", "AU6+AU12", "AU6_12", "viseme_aa", "our", "AU", "tau12", "", "_L"})
    EXPECT_EQ(first(name), "nothing") << name;
  EXPECT_EQ(first("eyeLookOutLeft"), first("eyeLookInRight"));
  EXPECT_LT(units_of_target("AU12L").set, units_of_target("AU12").set);
  EXPECT_LT(units_of_target("mouthSmileLeft").set, units_of_target("mouthSmile").set);
  EXPECT_LT(units_of_target("eyeBlink").set, units_of_target("blinkLeft").set);
}

}  // namespace
}  // namespace nms::runtime
