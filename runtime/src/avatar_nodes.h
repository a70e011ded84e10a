#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <glm/gtc/quaternion.hpp>
#include <glm/vec3.hpp>
#include <nlohmann/json.hpp>

#include <nms/program/failure.h>

namespace nms::runtime {

using Json = nlohmann::json;

constexpr std::uint32_t kNoNode = 0xFFFFFFFFU;

// What a glTF document says, where it is no document of ours: anything may be missing, and of any kind.

/// The element of an array, or null.
[[nodiscard]] const Json& element(const Json& array, std::size_t i);
/// The member of an object, or null.
[[nodiscard]] const Json& member(const Json& object, const char* name);
[[nodiscard]] std::optional<std::uint32_t> index_of(const Json& value);
[[nodiscard]] std::string text_of(const Json& value);
/// A finite number below 1e30.
[[nodiscard]] double number_of(const Json& value, double otherwise);

/// A node's pose in its parent, as the file has it.
struct NodeRest {
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0};
  glm::dvec3 translation{0.0};
  glm::dvec3 scale{1.0};
};

/// Translation, rotation and scale of a node, from its own members or from its matrix (columns, glTF 2.0, 5.25). A
/// matrix that mirrors gives a negative scale of x; shear is left out.
[[nodiscard]] NodeRest rest_of(const Json& node);

/// The parent of each node; kNoNode: it has none.
/// Failures: bad_avatar (no nodes, a child that is missing or has two parents, a circle, more than 1,024 deep).
[[nodiscard]] std::optional<program::Failure> read_parents(const Json& nodes, const std::string& place,
                                                           std::vector<std::uint32_t>& parents);

}  // namespace nms::runtime
