#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <glm/vec3.hpp>

#include <nms/program/program.h>
#include <nms/runtime/face.h>
#include <nms/runtime/rig.h>

/// The face ada with every unit of the library, for the tests of what her muscles do.
namespace nms::ada {

std::string embedded(std::string_view path);

const runtime::Face& face();

struct Bound {
  program::Image image;
  runtime::Rig rig;
};

/// Compiles the source with the library and binds it to the face.
Bound bind_with(const std::string& source);

/// One for every unit of the library.
std::string expressions_of_all_units();

/// Every unit of the library, so that each has a channel and its muscles.
const Bound& all_units();

/// Vertices at rest. [m]
const std::vector<glm::dvec3>& rest();

/// Brows and hair: shells that ride on the skin.
bool is_shell(const runtime::Primitive& p);

using Triangle = std::array<std::uint32_t, 3>;

const std::vector<Triangle>& skin_triangles();

/// For every vertex the one at its mirror image; -1 where there is none.
const std::vector<int>& partners();

/// The mirror image of a set of values: left and right change places, and axes that turn or shift sideways change sign.
std::vector<float> mirrored(const program::Program& p, const std::vector<float>& values);

/// How much of each vertex belongs to a region of the face. [0, 1]
std::vector<float> vertex_weights(std::string_view region);

/// Values with the units of these names at 1: "AU12" (both sides), "AU12L", "AU63" (an axis' side).
std::vector<float> values_of(const Bound& b, const std::vector<std::string>& units, float amount = 1.0F);

/// A landmark of the face. [m]
glm::dvec3 landmark(const Bound& b, std::string_view name);

/// The landmark nearest to a place at rest.
std::string nearest_landmark(const Bound& b, const glm::dvec3& p);

}  // namespace nms::ada
