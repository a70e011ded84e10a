#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

namespace nms::fit_face {

/// Millimetres in one of the scan's units. The fit works in the scan's units; what is built onto it works in mm.
inline constexpr double kMillimetres = 10.0;

/// The scan of a head: +x the subject's left, +y up, +z forward. Units of 10 mm.
struct Scan {
  std::vector<glm::dvec3> positions;
  std::vector<std::array<std::uint32_t, 4>> quads;  ///< the skin's
  std::vector<glm::dvec3> normals;                  ///< the skin's, weighted by area, unit
};

/// Reads a Wavefront OBJ; the quads of the materials M_Face and M_BackHead are the skin. Ends the program where it
/// cannot.
Scan read_scan(const std::string& path);

/// Says why on stderr and ends the program: an offline tool has nobody to hand a failure to.
[[noreturn]] void fail(const std::string& text);

}  // namespace nms::fit_face
