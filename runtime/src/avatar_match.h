#pragma once

#include <cstddef>
#include <cstdint>
#include <set>
#include <span>
#include <string>
#include <vector>

#include <glm/gtc/quaternion.hpp>
#include <glm/vec3.hpp>
#include <nlohmann/json.hpp>
#include <tl/expected.hpp>

#include <nms/program/failure.h>
#include <nms/program/program.h>

/// What of an avatar that others made shows what a program's clips do.
namespace nms::runtime::avatar {

/// One direction of a channel: an AU, or half of an axis.
struct Driver {
  std::uint32_t channel = 0;
  float sign = 1.0F;
  float share = 1.0F;
  float top = 1.0F;  ///< weight at 100 %: VRM's binds may ask for less
};

/// A morph target that some clip moves.
struct Target {
  std::size_t index = 0;  ///< in its mesh
  std::vector<Driver> drivers;
};

struct MeshNode {
  std::uint32_t node = 0;
  std::vector<float> rest;  ///< weights as the file has them
  std::vector<Target> targets;
};

enum class Part : std::uint8_t { head, torso, eye };

struct Bone {
  std::uint32_t node = 0;
  Part part = Part::head;
  glm::dquat parent{1.0, 0.0, 0.0, 0.0};  ///< turn of its parent in the world, at rest
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0};
  glm::dvec3 translation{0.0};
  double scale = 1.0;  ///< of its parent in the world
};

/// The axes that a part turns and shifts by.
[[nodiscard]] program::Frame frame_of(Part part);

struct Match {
  std::set<std::uint32_t> channels;     ///< that the clips move
  std::vector<MeshNode> meshes;         ///< by node
  std::vector<Bone> bones;              ///< each node once
  std::vector<std::string> targets;     ///< names of morph targets and expressions that something drives, each once
  std::vector<std::string> bone_names;  ///< each once
  std::vector<std::string> unshown;     ///< action units that nothing shows, in program order
};

/// Failures: bad_avatar (its hierarchy is broken), too_large, no_targets (nothing in it that we know).
/// @param json    the document: nothing is assumed of it but that it is an object
/// @param binary  buffer 0, looked into for whether targets turn the eyeballs
/// @param place   what messages call the file
[[nodiscard]] tl::expected<Match, program::Failure> match(const nlohmann::json& json, std::span<const std::byte> binary,
                                                          const std::string& place, const program::Program& program,
                                                          std::span<const program::Clip* const> clips);

}  // namespace nms::runtime::avatar
