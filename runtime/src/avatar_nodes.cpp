#include "avatar_nodes.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

namespace nms::runtime {

using program::Failure;

namespace {
constexpr double kFarthest = 1e30;  // so that sums and products stay finite, as floats too
}

const Json& element(const Json& array, std::size_t i) {
  static const Json null;
  return array.is_array() && i < array.size() ? array[i] : null;
}

const Json& member(const Json& object, const char* name) {
  static const Json null;
  if (!object.is_object()) return null;
  const auto found = object.find(name);
  return found != object.end() ? *found : null;
}

std::optional<std::uint32_t> index_of(const Json& value) {
  if (!value.is_number_unsigned() || value.get<std::uint64_t>() >= kNoNode) return std::nullopt;
  return value.get<std::uint32_t>();
}

std::string text_of(const Json& value) { return value.is_string() ? value.get<std::string>() : std::string(); }

double number_of(const Json& value, double otherwise) {
  const double n = value.is_number() ? value.get<double>() : otherwise;
  return std::fabs(n) < kFarthest ? n : otherwise;
}

NodeRest rest_of(const Json& node) {
  NodeRest rest;
  const Json& matrix = member(node, "matrix");
  if (matrix.is_array() && matrix.size() == 16) {
    glm::dmat3 m(1.0);
    for (int c = 0; c < 3; ++c) {
      for (int r = 0; r < 3; ++r) m[c][r] = number_of(matrix[static_cast<std::size_t>(c * 4 + r)], c == r ? 1.0 : 0.0);
      rest.translation[c] = number_of(matrix[static_cast<std::size_t>(12 + c)], 0.0);
    }
    const double mirrored = glm::determinant(m) < 0.0 ? -1.0 : 1.0;
    for (int c = 0; c < 3; ++c) {
      rest.scale[c] = std::max(1e-12, glm::length(m[c])) * (c == 0 ? mirrored : 1.0);
      m[c] /= rest.scale[c];
    }
    rest.rotation = glm::normalize(glm::quat_cast(m));
    return rest;
  }
  const Json& t = member(node, "translation");
  const Json& s = member(node, "scale");
  const Json& r = member(node, "rotation");
  for (int c = 0; c < 3; ++c) {
    rest.translation[c] = number_of(element(t, static_cast<std::size_t>(c)), 0.0);
    rest.scale[c] = number_of(element(s, static_cast<std::size_t>(c)), 1.0);
  }
  const glm::dquat q(number_of(element(r, 3), 1.0), number_of(element(r, 0), 0.0), number_of(element(r, 1), 0.0),
                     number_of(element(r, 2), 0.0));
  const double length = std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  if (length > 1e-6) rest.rotation = q * (1.0 / length);
  return rest;
}

std::optional<Failure> read_parents(const Json& nodes, const std::string& place, std::vector<std::uint32_t>& parents) {
  constexpr std::size_t kDeepest = 1024;
  const char* const remedy = "check the file with the glTF validator";
  if (!nodes.is_array() || nodes.size() >= kNoNode)
    return Failure{"bad_avatar", place, "it has no nodes", "give an avatar"};
  parents.assign(nodes.size(), kNoNode);
  for (std::uint32_t n = 0; n < nodes.size(); ++n)
    for (const Json& child : member(nodes[n], "children")) {
      const auto c = index_of(child);
      if (!c || *c >= nodes.size() || parents[*c] != kNoNode)
        return Failure{"bad_avatar", place, fmt::format("node {} has a child that is missing or has two parents", n),
                       remedy};
      parents[*c] = n;
    }
  // From the roots down: what is not reached goes in a circle.
  std::vector<std::uint32_t> level;
  for (std::uint32_t n = 0; n < nodes.size(); ++n)
    if (parents[n] == kNoNode) level.push_back(n);
  std::size_t reached = 0;
  for (std::size_t depth = 0; !level.empty(); ++depth) {
    if (depth > kDeepest)
      return Failure{"bad_avatar", place, fmt::format("its nodes are more than {} deep", kDeepest), "give an avatar"};
    reached += level.size();
    std::vector<std::uint32_t> next;
    for (const std::uint32_t n : level)
      for (const Json& child : member(nodes[n], "children")) next.push_back(child.get<std::uint32_t>());
    level = std::move(next);
  }
  if (reached != nodes.size()) return Failure{"bad_avatar", place, "some of its nodes are their own ancestors", remedy};
  return std::nullopt;
}

}  // namespace nms::runtime
