#include <nms/runtime/gltf_export.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <set>
#include <string>

#include <gtest/gtest.h>
#include <tiny_gltf.h>
#include <glm/geometric.hpp>

#include <nms/program/evaluate.h>

#include "animation_keys.h"
#include "test_face.h"
#include "test_glb.h"

namespace nms::runtime {
namespace {

constexpr const char* kClips = R"(
clip Default expression -0.2s..1s hash 0000000000000001
  curve AU7L
    0s 0 linear
    0.1s 0.5 linear
    0.3s 0 hold
  curve AU12L
    -0.2s 0 smooth
    0.1s 0.8 smooth
    0.6s 0.8 smooth
    1s 0 hold
  curve AU26
    0s 0 hold
    0.5s 0.5 hold
    0.8s 0 hold
  curve AU45L
    0s 0 linear
    0.1s 1 linear
    0.2s 0 hold
  curve head_yaw
    0s 0 smooth
    0.5s -0.5 smooth
    1s 0.25 hold
  curve gaze_pitch
    0s 0 smooth
    0.5s -0.5 hold

clip "a b" pose 0s..0s hash 0000000000000002
  curve AU18
    0s 1 hold

clip "a:b" timeline 0s..2s hash 0000000000000003
  curve head_thrust
    0s 0 smooth
    1s 1 smooth
    2s 0 hold
)";

class GltfExport : public testing::Test {
 protected:
  static GltfOptions only_default() { return {{"Default"}, false, false}; }

  Face face_ = test_face();
  program::Image image_ = test_program(kClips);
  Rig rig_ = bind(face_, image_.program()).value();
};

TEST_F(GltfExport, GivesTheSameBytesTwice) {
  const auto a = export_glb(face_, rig_, image_.program(), {});
  const auto b = export_glb(face_, rig_, image_.program(), {});
  ASSERT_TRUE(a.has_value());
  EXPECT_EQ(*a, *b);
}

TEST_F(GltfExport, WritesOnlyTheTargetsThatClipsUse) {
  const auto some = export_glb(face_, rig_, image_.program(), only_default());
  ASSERT_TRUE(some.has_value());
  const std::vector<std::string> expected{"AU7L",
                                          "AU12L",
                                          "AU26",
                                          "AU45L",
                                          "AU64",
                                          "fix.lid_upper_L.50",
                                          "fix.lid_upper_L.contact",
                                          "fix.lid_upper_R.50",
                                          "fix.jaw.50"};
  EXPECT_EQ(target_names(read_model(*some)), expected);
  const auto all = export_glb(face_, rig_, image_.program(), {{"Default"}, true, false});
  const std::vector<std::string> every{"AU1L",
                                       "AU1R",
                                       "AU5L",
                                       "AU5R",
                                       "AU7L",
                                       "AU7R",
                                       "AU12L",
                                       "AU12R",
                                       "AU18",
                                       "AU24",
                                       "AU26",
                                       "AU34L",
                                       "AU34R",
                                       "AU45L",
                                       "AU45R",
                                       "AU63",
                                       "AU64",
                                       "fix.lid_upper_L.50",
                                       "fix.lid_upper_L.contact",
                                       "fix.lid_upper_R.50",
                                       "fix.jaw.50"};
  EXPECT_EQ(target_names(read_model(*all)), every);
}

TEST_F(GltfExport, TargetsCarryTheSurface) {
  for (const bool dense : {false, true}) {
    const auto bytes = export_glb(face_, rig_, image_.program(), {{}, true, dense});
    ASSERT_TRUE(bytes.has_value());
    const tinygltf::Model model = read_model(*bytes);
    const std::vector<std::string> names = target_names(model);
    ASSERT_EQ(model.meshes[0].weights.size(), names.size());
    ASSERT_EQ(model.meshes[0].primitives.size(), 2U);
    Pose rest = make_pose(face_, rig_);
    Pose pose = make_pose(face_, rig_);
    std::vector<float> values(rig_.channel_count(), 0.0F);
    pose_face(face_, rig_, values, rest);
    for (std::size_t t = 0; t < names.size(); ++t) {
      const auto& first = model.meshes[0].primitives[0].targets[t];
      EXPECT_EQ(first, model.meshes[0].primitives[1].targets[t]);  // one set of deltas for every material
      if (names[t] == "AU63" || names[t] == "AU64" || names[t].starts_with("fix.")) continue;
      std::size_t c = 0;
      while (image_.program().string(image_.program().channels[c].name) != names[t]) ++c;
      values[c] = 1.0F;
      pose_face(face_, rig_, values, pose);
      values[c] = 0.0F;
      const std::vector<glm::vec3> deltas = vectors(model, first.at("POSITION"));
      glm::vec3 low = deltas[0];
      glm::vec3 high = deltas[0];
      for (std::size_t v = 0; v < deltas.size(); ++v) {
        const glm::vec3 miss = rest.positions[v] + deltas[v] - pose.positions[v];
        ASSERT_LT(std::abs(miss.x) + std::abs(miss.y) + std::abs(miss.z), 2e-6F) << names[t];
        low = glm::min(low, deltas[v]);
        high = glm::max(high, deltas[v]);
      }
      const tinygltf::Accessor& a = model.accessors[static_cast<std::size_t>(first.at("POSITION"))];
      EXPECT_EQ(a.sparse.isSparse, !dense);
      for (int i = 0; i < 3; ++i) {
        EXPECT_EQ(static_cast<float>(a.minValues[static_cast<std::size_t>(i)]), low[i]);
        EXPECT_EQ(static_cast<float>(a.maxValues[static_cast<std::size_t>(i)]), high[i]);
      }
    }
  }
}

TEST_F(GltfExport, ClipsComeInOrderAndSetEverything) {
  const auto bytes = export_glb(face_, rig_, image_.program(), {});
  ASSERT_TRUE(bytes.has_value());
  const tinygltf::Model model = read_model(*bytes);
  ASSERT_EQ(model.animations.size(), 3U);
  EXPECT_EQ(model.animations[0].name, "Default");
  EXPECT_EQ(model.animations[1].name, "a_b");
  EXPECT_EQ(model.animations[2].name, "a_b_2");
  EXPECT_NEAR(model.animations[0].extras.Get("start_s").GetNumberAsDouble(), -0.2, 1e-9);
  EXPECT_EQ(model.animations[0].extras.Get("kind").Get<std::string>(), "expression");
  const std::size_t channels = model.animations[0].channels.size();
  const std::size_t targets = model.meshes[0].weights.size();
  for (const tinygltf::Animation& animation : model.animations) {
    EXPECT_EQ(animation.channels.size(), channels);
    std::set<std::pair<int, std::string>> seen;
    for (const tinygltf::AnimationChannel& channel : animation.channels) {
      EXPECT_TRUE(seen.emplace(channel.target_node, channel.target_path).second);
      const tinygltf::AnimationSampler& sampler = animation.samplers[static_cast<std::size_t>(channel.sampler)];
      EXPECT_EQ(sampler.interpolation, "LINEAR");
      const tinygltf::Accessor& input = model.accessors[static_cast<std::size_t>(sampler.input)];
      const tinygltf::Accessor& output = model.accessors[static_cast<std::size_t>(sampler.output)];
      const float* times = floats(model, sampler.input);
      EXPECT_EQ(times[0], 0.0F);
      for (std::size_t i = 1; i < input.count; ++i) EXPECT_LT(times[i - 1], times[i]);
      const bool is_skin = channel.target_node == node_named(model, "skin");
      EXPECT_EQ(output.count, input.count * (is_skin ? targets : 1));
    }
  }
}

TEST_F(GltfExport, WeightsAreTheCurvesToTheStatedBound) {
  const auto bytes = export_glb(face_, rig_, image_.program(), only_default());
  ASSERT_TRUE(bytes.has_value());
  const tinygltf::Model model = read_model(*bytes);
  const program::Program& program = image_.program();
  const program::Clip& clip = *program.find_clip("Default");
  const tinygltf::Animation& animation = model.animations[0];
  const tinygltf::AnimationSampler& sampler = animation.samplers[0];
  ASSERT_EQ(animation.channels[0].target_path, "weights");
  const tinygltf::Accessor& input = model.accessors[static_cast<std::size_t>(sampler.input)];
  const float* times = floats(model, sampler.input);
  const float* weights = floats(model, sampler.output);
  const std::size_t stride = model.meshes[0].weights.size();
  EXPECT_LT(input.count, 120U);  // 1.2 s; a key for every frame at 60 Hz would be 72 for the smooth parts alone
  std::vector<float> values(rig_.channel_count());
  std::size_t au12 = 0;
  while (program.string(program.channels[au12].name) != "AU12L") ++au12;
  std::size_t au26 = 0;
  while (program.string(program.channels[au26].name) != "AU26") ++au26;
  std::size_t gaze = 0;
  while (program.string(program.channels[gaze].name) != "gaze_pitch") ++gaze;
  double worst = 0.0;
  for (int i = 0; i <= 1200; ++i) {
    const double t = i * 0.001;
    std::fill(values.begin(), values.end(), 0.0F);
    program::evaluate(program, clip, clip.start_ns + static_cast<std::int64_t>(i) * 1'000'000, values);
    std::size_t k = 0;
    while (k + 2 < input.count && static_cast<double>(times[k + 1]) <= t) ++k;
    const double u =
        std::clamp((t - static_cast<double>(times[k])) / static_cast<double>(times[k + 1] - times[k]), 0.0, 1.0);
    const auto read_weight = [&](std::size_t target) {
      const double a = static_cast<double>(weights[stride * k + target]);
      const double b = static_cast<double>(weights[stride * (k + 1) + target]);
      return a + u * (b - a);
    };
    worst = std::max(worst, std::abs(read_weight(1) - static_cast<double>(values[au12])));
    worst = std::max(worst, std::abs(read_weight(4) - std::max(-static_cast<double>(values[gaze]), 0.0)));
    // the held values jump: within 1 ms of a jump anything between is right
    if (i % 100 > 1 && i % 100 < 99) {
      worst = std::max(worst, std::abs(read_weight(2) - static_cast<double>(values[au26])));
    }
  }
  EXPECT_LE(worst, 0.0021);
}

// What a viewer shows, at every time: the sum of the targets, against the runtime's own surface.
TEST_F(GltfExport, TargetsWithTheirCorrectionsFollowTheTurningLidsAndJaw) {
  const auto bytes = export_glb(face_, rig_, image_.program(), only_default());
  ASSERT_TRUE(bytes.has_value());
  const tinygltf::Model model = read_model(*bytes);
  const program::Program& program = image_.program();
  const program::Clip& clip = *program.find_clip("Default");
  const tinygltf::AnimationSampler& sampler = model.animations[0].samplers[0];
  const tinygltf::Accessor& input = model.accessors[static_cast<std::size_t>(sampler.input)];
  const float* times = floats(model, sampler.input);
  const float* weights = floats(model, sampler.output);
  const std::size_t stride = model.meshes[0].weights.size();
  std::vector<std::vector<glm::vec3>> deltas;
  for (const auto& target : model.meshes[0].primitives[0].targets)
    deltas.push_back(vectors(model, target.at("POSITION")));
  const std::vector<std::string> names = target_names(model);
  Pose rest = make_pose(face_, rig_);
  Pose pose = make_pose(face_, rig_);
  std::vector<float> values(rig_.channel_count(), 0.0F);
  pose_face(face_, rig_, values, rest);
  double worst_lid = 0.0;
  double worst_lid_without = 0.0;
  double worst = 0.0;
  const std::vector<float>& lid = face_.regions.at("lid_upper_left");
  for (std::size_t k = 0; k < input.count; ++k) {
    std::fill(values.begin(), values.end(), 0.0F);
    program::evaluate(program, clip, clip.start_ns + 1000 * std::llround(static_cast<double>(times[k]) * 1e6), values);
    pose_face(face_, rig_, values, pose);
    for (std::size_t v = 0; v < rest.positions.size(); ++v) {
      glm::dvec3 with(rest.positions[v]);
      glm::dvec3 without = with;
      for (std::size_t t = 0; t < stride; ++t) {
        const glm::dvec3 d = static_cast<double>(weights[stride * k + t]) * glm::dvec3(deltas[t][v]);
        with += d;
        if (!names[t].starts_with("fix.")) without += d;
      }
      worst = std::max(worst, glm::length(with - glm::dvec3(pose.positions[v])));
      if (lid[v] == 0.0F) continue;
      worst_lid = std::max(worst_lid, glm::length(with - glm::dvec3(pose.positions[v])));
      worst_lid_without = std::max(worst_lid_without, glm::length(without - glm::dvec3(pose.positions[v])));
    }
  }
  EXPECT_LT(worst_lid, 0.0001);          // [m]
  EXPECT_GT(worst_lid_without, 0.0006);  // the corrections are needed
  // The corner of the mouth, pulled while the jaw is open: its pull turns with the jaw, a target's does not.
  EXPECT_LT(worst, 0.0015);
}

TEST_F(GltfExport, NodesStandWhereTheFramesTurn) {
  const auto bytes = export_glb(face_, rig_, image_.program(), {});
  ASSERT_TRUE(bytes.has_value());
  const tinygltf::Model model = read_model(*bytes);
  EXPECT_EQ(model.asset.generator, "nmsc");
  std::set<std::string> names;
  for (const tinygltf::Node& n : model.nodes) {
    EXPECT_TRUE(names.insert(n.name).second) << n.name;
    for (const char c : n.name) EXPECT_TRUE(std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-');
  }
  const auto has_child = [&](std::string_view parent, std::string_view child) {
    const std::vector<int>& children = model.nodes[static_cast<std::size_t>(node_named(model, parent))].children;
    return std::find(children.begin(), children.end(), node_named(model, child)) != children.end();
  };
  EXPECT_TRUE(has_child("root", "torso"));
  EXPECT_TRUE(has_child("torso", "head"));
  EXPECT_TRUE(has_child("torso", "collar"));
  EXPECT_TRUE(has_child("head", "jaw"));
  EXPECT_TRUE(has_child("head", "eye_left"));
  EXPECT_TRUE(has_child("head", "teeth_upper"));
  EXPECT_TRUE(has_child("jaw", "teeth_lower"));
  EXPECT_TRUE(has_child("eye_left", "eyeball"));
  EXPECT_TRUE(has_child("eye_right", "eyeball_2"));
  ASSERT_EQ(model.skins.size(), 1U);
  const int skin_node = node_named(model, "skin");
  EXPECT_EQ(model.nodes[static_cast<std::size_t>(skin_node)].skin, 0);
  EXPECT_EQ(model.scenes[0].nodes, (std::vector<int>{node_named(model, "root"), skin_node}));
}

TEST_F(GltfExport, TheTongueHasATargetOfItsOwn) {
  const auto bytes = export_glb(face_, rig_, image_.program(), {{}, true, false});
  ASSERT_TRUE(bytes.has_value());
  const tinygltf::Model model = read_model(*bytes);
  const tinygltf::Node& tongue = model.nodes[static_cast<std::size_t>(node_named(model, "tongue"))];
  const tinygltf::Mesh& mesh = model.meshes[static_cast<std::size_t>(tongue.mesh)];
  ASSERT_EQ(mesh.weights.size(), 1U);
  EXPECT_EQ(mesh.extras.Get("targetNames").Get(0).Get<std::string>(), "AU19");
  for (const tinygltf::Animation& animation : model.animations) {
    EXPECT_TRUE(std::any_of(animation.channels.begin(), animation.channels.end(), [&](const auto& channel) {
      return channel.target_node == node_named(model, "tongue") && channel.target_path == "weights";
    }));
  }
}

TEST_F(GltfExport, WithoutClipsTheJawsTargetsTakeTheTeethAlong) {
  const program::Image image = test_program("");
  const Rig rig = bind(face_, image.program()).value();
  const tinygltf::Model model = read_model(export_glb(face_, rig, image.program(), {{}, true, false}).value());
  const auto mesh_of = [&](const char* node) {
    const int index = model.nodes[static_cast<std::size_t>(node_named(model, node))].mesh;
    return static_cast<std::size_t>(index);
  };
  EXPECT_EQ(target_names(model, mesh_of("teeth_lower")), std::vector<std::string>{"AU26"});
  EXPECT_EQ(target_names(model, mesh_of("tongue")), (std::vector<std::string>{"AU19", "AU26"}));
  // As the jaw's node would turn them.
  Pose pose = make_pose(face_, rig);
  std::vector<float> values(rig.channel_count(), 0.0F);
  for (std::uint32_t c = 0; c < image.program().channels.size(); ++c)
    if (image.program().string(image.program().channels[c].name) == "AU26") values[c] = 1.0F;
  pose_face(face_, rig, values, pose);
  const Placement& jaw = pose.placements[static_cast<std::size_t>(Frame::jaw)];
  for (const RigidMesh& m : face_.rigid) {
    if (m.frame != Frame::jaw) continue;
    const auto& primitive = model.meshes[mesh_of(m.name.c_str())].primitives[0];
    const std::vector<glm::vec3> moved = vectors(model, primitive.targets.back().at("POSITION"));
    const std::vector<glm::vec3> turned = vectors(model, primitive.targets.back().at("NORMAL"));
    ASSERT_EQ(moved.size(), m.positions.size());
    for (std::size_t v = 0; v < moved.size(); ++v) {
      const glm::dvec3 p(m.positions[v]);
      const glm::dvec3 n(m.normals[v]);
      EXPECT_LT(glm::distance(glm::dvec3(moved[v]), jaw.rotation * p + jaw.translation - p), 1e-6) << m.name;
      EXPECT_LT(glm::distance(glm::dvec3(turned[v]), jaw.rotation * n - n), 1e-3) << m.name;
      EXPECT_GT(glm::length(moved[v]), 0.001F);
    }
  }
}

TEST_F(GltfExport, PartsKeepTheirColours) {
  for (RigidMesh& m : face_.rigid)
    if (m.name == "teeth_lower") m.colors.assign(m.positions.size(), glm::vec3(0.5F, 0.25F, 0.125F));
  const tinygltf::Model model = read_model(export_glb(face_, rig_, image_.program(), only_default()).value());
  const auto attributes_of = [&](const char* node) {
    const int mesh = model.nodes[static_cast<std::size_t>(node_named(model, node))].mesh;
    return model.meshes[static_cast<std::size_t>(mesh)].primitives[0].attributes;
  };
  EXPECT_EQ(attributes_of("tongue").count("COLOR_0"), 0U);
  const auto attributes = attributes_of("teeth_lower");
  ASSERT_EQ(attributes.count("COLOR_0"), 1U);
  for (const glm::vec3& c : vectors(model, attributes.at("COLOR_0"))) EXPECT_EQ(c, glm::vec3(0.5F, 0.25F, 0.125F));
}

TEST_F(GltfExport, RefusesAClipThatThereIsNot) {
  const auto bytes = export_glb(face_, rig_, image_.program(), {{"nobody"}, false, false});
  ASSERT_FALSE(bytes.has_value());
  EXPECT_EQ(bytes.error().kind, "unknown_clip");
}

TEST_F(GltfExport, QuantizedVerticesAreTheSameToAStep) {
  for (const bool dense : {false, true}) {
    GltfOptions options;
    options.all_targets = true;
    options.dense = dense;
    const auto plain_bytes = export_glb(face_, rig_, image_.program(), options);
    options.quantize = true;
    const auto bytes = export_glb(face_, rig_, image_.program(), options);
    ASSERT_TRUE(bytes.has_value()) << bytes.error().cause;
    EXPECT_LT(bytes->size(), plain_bytes->size());
    const tinygltf::Model plain = read_model(*plain_bytes);
    const tinygltf::Model model = read_model(*bytes);
    EXPECT_TRUE(plain.extensionsRequired.empty());
    EXPECT_EQ(model.extensionsRequired, std::vector<std::string>{"KHR_mesh_quantization"});
    EXPECT_EQ(model.extensionsUsed, model.extensionsRequired);
    ASSERT_EQ(target_names(model), target_names(plain));
    for (std::size_t mesh = 0; mesh < model.meshes.size(); ++mesh) {
      // What a viewer multiplies vertices with: of the skin the inverse bind matrix, else the node's own transform.
      glm::vec3 shift(0.0F);
      float scale = 1.0F;
      if (model.meshes[mesh].name == "skin") {
        const float* now = floats(model, model.skins[0].inverseBindMatrices);
        const float* before = floats(plain, plain.skins[0].inverseBindMatrices);
        scale = now[0];
        EXPECT_EQ(now[5], scale);
        EXPECT_EQ(now[10], scale);
        shift = {now[12] - before[12], now[13] - before[13], now[14] - before[14]};
        EXPECT_EQ(now[16], scale) << "of the other joint too";
      } else {
        const auto found = std::find_if(model.nodes.begin(), model.nodes.end(),
                                        [&](const tinygltf::Node& n) { return n.mesh == static_cast<int>(mesh); });
        ASSERT_NE(found, model.nodes.end());
        const tinygltf::Node& node = *found;
        ASSERT_EQ(node.scale.size(), 3U) << node.name;
        scale = static_cast<float>(node.scale[0]);
        for (int i = 0; i < 3 && !node.translation.empty(); ++i) {
          shift[i] = static_cast<float>(node.translation[static_cast<std::size_t>(i)]);
        }
      }
      const float step = scale / 32767.0F;
      EXPECT_LT(step, 1e-5F);
      const tinygltf::Primitive& now = model.meshes[mesh].primitives[0];
      const tinygltf::Primitive& before = plain.meshes[mesh].primitives[0];
      const std::vector<std::string> names =
          now.targets.empty() ? std::vector<std::string>{} : target_names(model, mesh);
      const auto rest = vectors(plain, before.attributes.at("NORMAL"));
      const auto compare = [&](const std::map<std::string, int>& a, const std::map<std::string, int>& b, glm::vec3 by,
                               float least_m, bool alone) {
        const auto p = vectors(model, a.at("POSITION"));
        const auto q = vectors(plain, b.at("POSITION"));
        const auto n = vectors(model, a.at("NORMAL"));
        const auto o = vectors(plain, b.at("NORMAL"));
        ASSERT_EQ(p.size(), q.size());
        for (std::size_t v = 0; v < p.size(); ++v) {
          // What hardly moves is left out.
          const bool still = p[v] == glm::vec3(0.0F) && n[v] == glm::vec3(0.0F);
          const glm::vec3 off = by + scale * p[v] - q[v];
          ASSERT_LE(std::max({std::abs(off.x), std::abs(off.y), std::abs(off.z)}),
                    (still ? least_m : 0.0F) + 0.51F * step + 1e-7F);
          if (std::max({std::abs(o[v].x), std::abs(o[v].y), std::abs(o[v].z)}) > 1.0F) {
            // More than the file can hold: up to a right angle what is left of the normal has the right direction.
            const glm::vec3 whole = rest[v] + o[v];
            const float along = glm::dot(glm::normalize(whole), glm::normalize(rest[v] + n[v]));
            ASSERT_TRUE(along > 0.99F || !alone || glm::dot(whole, rest[v]) < 0.0F) << along;
            continue;
          }
          const glm::vec3 turned = o[v] - n[v];
          ASSERT_LE(std::max({std::abs(turned.x), std::abs(turned.y), std::abs(turned.z)}),
                    (still ? 1.51F : 0.51F) / 127.0F);
        }
      };
      compare(now.attributes, before.attributes, shift, 0.0F, true);
      for (std::size_t t = 0; t < now.targets.size(); ++t) {
        compare(now.targets[t], before.targets[t], glm::vec3(0.0F), 1e-5F, !names[t].starts_with("fix."));
      }
    }
    for (const tinygltf::BufferView& view : model.bufferViews) EXPECT_EQ(view.byteStride % 4, 0U);
  }
}

TEST_F(GltfExport, QuantizedSharesSumUpToOne) {
  GltfOptions options;
  options.quantize = true;
  const auto bytes = export_glb(face_, rig_, image_.program(), options);
  ASSERT_TRUE(bytes.has_value());
  const tinygltf::Model model = read_model(*bytes);
  const auto& attributes = model.meshes[0].primitives[0].attributes;
  const tinygltf::Accessor& a = accessor(model, attributes.at("WEIGHTS_0"));
  ASSERT_EQ(a.componentType, TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE);
  ASSERT_TRUE(a.normalized);
  const unsigned char* data = view_bytes(model, a.bufferView) + a.byteOffset;
  const tinygltf::Accessor& j = accessor(model, attributes.at("JOINTS_0"));
  const unsigned char* joints = view_bytes(model, j.bufferView) + j.byteOffset;
  for (std::size_t v = 0; v < a.count; ++v) {
    const unsigned char* shares = data + 4 * v;
    EXPECT_EQ(shares[0] + shares[1] + shares[2] + shares[3], 255);
    const float head = rig_.head_share()[v];
    const bool first_is_head = joints[4 * v] == 0;
    EXPECT_NEAR(static_cast<float>(first_is_head ? shares[0] : shares[1]) / 255.0F, head, 0.002F);
  }
}

TEST_F(GltfExport, AskedForAnErrorItHoldsItInPlacesAndNormals) {
  for (const bool quantize : {false, true}) {
    GltfOptions options = only_default();
    options.quantize = quantize;
    GltfReport before;
    ASSERT_TRUE(export_glb(face_, rig_, image_.program(), options, &before).has_value());
    options.max_error_m = 0.0002;
    GltfReport report;
    ASSERT_TRUE(export_glb(face_, rig_, image_.program(), options, &report).has_value());
    ASSERT_EQ(report.clips.size(), 1U);
    constexpr double kThreeDegrees = 3.0 * 3.14159265358979 / 180.0;
    EXPECT_GT(before.clips[0].largest_m, options.max_error_m) << "there was something to mend";
    EXPECT_LE(report.clips[0].largest_m, options.max_error_m);
    EXPECT_LE(report.clips[0].normal_rad, kThreeDegrees);
    EXPECT_GT(report.corrections.size(), before.corrections.size());
  }
}

/// Vertices that a file's corrective targets shift.
std::size_t corrected(const std::vector<std::byte>& bytes) {
  const tinygltf::Model model = read_model(bytes);
  const std::vector<std::string> names = target_names(model);
  std::size_t count = 0;
  for (std::size_t t = 0; t < names.size(); ++t) {
    if (!names[t].starts_with("fix")) continue;
    for (const glm::vec3& shift : vectors(model, model.meshes[0].primitives[0].targets[t].at("POSITION")))
      count += shift != glm::vec3(0.0F) ? 1U : 0U;
  }
  return count;
}

// Rounding to a grid, which is everywhere, is not what they are for.
TEST_F(GltfExport, CorrectiveTargetsOfAQuantizedMeshReachNoFurther) {
  GltfOptions options = only_default();
  options.max_error_m = 0.0002;
  const auto plain = export_glb(face_, rig_, image_.program(), options);
  options.quantize = true;
  const auto quantized = export_glb(face_, rig_, image_.program(), options);
  ASSERT_TRUE(plain && quantized);
  EXPECT_GT(corrected(*plain), 0U);
  EXPECT_LT(corrected(*quantized), 3 * corrected(*plain) / 2);
}

/// A clip of a file as a viewer shows it: the skin's targets added up between keys.
class ShownSkin {
 public:
  explicit ShownSkin(const std::vector<std::byte>& bytes) : model_(read_model(bytes)) {
    // The scale and the place of a quantized mesh's grid stand in the inverse bind matrices.
    const float* bind = floats(model_, model_.skins[0].inverseBindMatrices);
    const tinygltf::Node& head = model_.nodes[static_cast<std::size_t>(model_.skins[0].joints[0])];
    const tinygltf::Node& torso = model_.nodes[static_cast<std::size_t>(node_named(model_, "torso"))];
    for (int i = 0; i < 3; ++i) {
      const auto k = static_cast<std::size_t>(i);
      shift_[i] = bind[12 + i] + static_cast<float>(head.translation[k] + torso.translation[k]);
    }
    scale_ = bind[0];
    const tinygltf::Primitive& primitive = model_.meshes[0].primitives[0];
    rest_ = vectors(model_, primitive.attributes.at("POSITION"));
    normals_ = vectors(model_, primitive.attributes.at("NORMAL"));
    for (const auto& target : primitive.targets) {
      moved_.push_back(vectors(model_, target.at("POSITION")));
      turned_.push_back(vectors(model_, target.at("NORMAL")));
    }
    const int skin = node_named(model_, "skin");
    for (const tinygltf::AnimationChannel& channel : model_.animations[0].channels)
      if (channel.target_node == skin && channel.target_path == "weights") sampler_ = channel.sampler;
  }

  void look(double t) {
    const tinygltf::AnimationSampler& sampler = model_.animations[0].samplers[static_cast<std::size_t>(sampler_)];
    const float* times = floats(model_, sampler.input);
    const std::size_t keys = accessor(model_, sampler.input).count;
    std::size_t k = 0;
    while (k + 2 < keys && static_cast<double>(times[k + 1]) <= t) ++k;
    const double u =
        std::clamp((t - static_cast<double>(times[k])) / static_cast<double>(times[k + 1] - times[k]), 0.0, 1.0);
    positions.assign(rest_.begin(), rest_.end());
    normals.assign(normals_.begin(), normals_.end());
    for (std::size_t i = 0; i < moved_.size(); ++i) {
      const double a = weight(sampler.output, k * moved_.size() + i);
      const double w = a + u * (weight(sampler.output, (k + 1) * moved_.size() + i) - a);
      for (std::size_t v = 0; v < positions.size(); ++v) {
        positions[v] += w * glm::dvec3(moved_[i][v]);
        normals[v] += w * glm::dvec3(turned_[i][v]);
      }
    }
    for (glm::dvec3& p : positions) p = static_cast<double>(scale_) * p + glm::dvec3(shift_);
    for (glm::dvec3& n : normals) n = glm::normalize(n);
  }

  std::vector<glm::dvec3> positions, normals;

 private:
  double weight(int output, std::size_t index) const {
    const tinygltf::Accessor& a = accessor(model_, output);
    if (a.componentType == TINYGLTF_COMPONENT_TYPE_FLOAT) return static_cast<double>(floats(model_, output)[index]);
    EXPECT_EQ(a.componentType, TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT);
    std::uint16_t whole = 0;
    std::memcpy(&whole, view_bytes(model_, a.bufferView) + a.byteOffset + 2 * index, sizeof whole);
    return whole / 65535.0;
  }

  tinygltf::Model model_;
  glm::vec3 shift_{0.0F};
  float scale_ = 1.0F;
  int sampler_ = 0;
  std::vector<glm::vec3> rest_, normals_;
  std::vector<std::vector<glm::vec3>> moved_, turned_;
};

// The report is worked out beside the file: here the file itself is held to it, between keys too.
TEST_F(GltfExport, WhatTheReportSaysIsWhatTheFileShows) {
  const program::Program& program = image_.program();
  const program::Clip& clip = *program.find_clip("Default");
  for (const double asked_m : {0.0, 0.0002}) {
    for (const bool quantize : {false, true}) {
      GltfOptions options = only_default();
      options.quantize = quantize;
      options.max_error_m = asked_m;
      GltfReport report;
      const auto bytes = export_glb(face_, rig_, program, options, &report);
      ASSERT_TRUE(bytes.has_value());
      ShownSkin shown(*bytes);
      Pose pose = make_pose(face_, rig_);
      std::vector<float> values(rig_.channel_count());
      double largest_m = 0.0;
      double turned_rad = 0.0;
      for (int i = 0; i < 480; ++i) {
        const std::int64_t t = 1'250'000 + std::int64_t{i} * 2'500'000;
        if (t % 100'000'000 < 2'000'000 || t % 100'000'000 > 98'000'000) continue;  // a jump is a ramp of 1 ms
        std::fill(values.begin(), values.end(), 0.0F);
        program::evaluate(program, clip, clip.start_ns + t, values);
        pose_face(face_, rig_, values, pose);
        shown.look(static_cast<double>(t) * 1e-9);
        for (std::size_t v = 0; v < pose.positions.size(); ++v) {
          largest_m = std::max(largest_m, glm::distance(shown.positions[v], glm::dvec3(pose.positions[v])));
          turned_rad =
              std::max(turned_rad, std::acos(std::min(glm::dot(shown.normals[v], glm::dvec3(pose.normals[v])), 1.0)));
        }
      }
      const GltfClipError& said = report.clips.at(0);
      EXPECT_NEAR(largest_m, said.largest_m, 0.1 * said.largest_m + 2e-6) << asked_m << quantize;
      EXPECT_NEAR(turned_rad, said.normal_rad, 0.1 * said.normal_rad + 0.002) << asked_m << quantize;
      if (asked_m > 0.0) {
        EXPECT_LE(largest_m, asked_m) << quantize;
        EXPECT_LE(turned_rad, kAskew_rad) << quantize;
      }
    }
  }
}

// Landmarks that a face's geometry tells are places too.
TEST_F(GltfExport, PlacesAreNamedByTheFacesOwnLandmarks) {
  for (std::size_t i = 0; i < face_.skin.points.size(); ++i)
    face_.landmarks["of_the_face_" + std::to_string(i)] = face_.skin.points[i];
  GltfReport report;
  ASSERT_TRUE(export_glb(face_, rig_, image_.program(), only_default(), &report).has_value());
  EXPECT_TRUE(report.clips.at(0).place.starts_with("of_the_face_")) << report.clips.at(0).place;
  EXPECT_TRUE(report.clips.at(0).normal_place.starts_with("of_the_face_")) << report.clips.at(0).normal_place;
}

TEST(GltfNames, AClipIsCalledTheSameWhateverElseIsExported) {
  const Face face = test_face();
  const program::Image image = test_program(R"(
clip "d.x" pose 0s..0s hash 0000000000000001
  curve AU18
    0s 1 hold

clip d_x pose 0s..0s hash 0000000000000002
  curve AU24
    0s 1 hold
)");
  const Rig rig = bind(face, image.program()).value();
  const auto names = [&](const std::vector<std::string>& clips) {
    std::vector<std::string> found;
    const tinygltf::Model model = read_model(export_glb(face, rig, image.program(), {clips, false, false}).value());
    for (const tinygltf::Animation& a : model.animations) {
      found.push_back(a.name + " is " + a.extras.Get("clip").Get<std::string>());
    }
    return found;
  };
  EXPECT_EQ(names({}), (std::vector<std::string>{"d_x_2 is d.x", "d_x is d_x"}));
  EXPECT_EQ(names({"d.x"}), (std::vector<std::string>{"d_x_2 is d.x"}));
  EXPECT_EQ(names({"d_x"}), (std::vector<std::string>{"d_x is d_x"}));
}

TEST(AnimationKeys, DropsWhatTheOthersImply) {
  const std::vector<std::int64_t> breaks{0, 100'000'000, 200'000'000, 1'000'000'000};
  const std::vector<double> tolerance{0.002};
  const Keys straight = fit_keys(breaks, Interpolation::linear, tolerance, [](std::int64_t t, std::span<float> out) {
    out[0] = static_cast<float>(static_cast<double>(t) * 1e-9);
  });
  EXPECT_EQ(straight.times, (std::vector<float>{0.0F, 1.0F}));
  const Keys bent = fit_keys(breaks, Interpolation::linear, tolerance, [](std::int64_t t, std::span<float> out) {
    const double u = static_cast<double>(t) * 1e-9;
    out[0] = static_cast<float>(u * u * (3.0 - 2.0 * u));
  });
  EXPECT_GT(bent.times.size(), 8U);
  EXPECT_LT(bent.times.size(), 40U);
}

}  // namespace
}  // namespace nms::runtime
