#include <nms/runtime/places_at_rest.h>

#include <cstdint>

namespace nms::runtime {

std::vector<glm::dvec3> places_at_rest(const Skin& skin) {
  std::vector<glm::dvec3> places(skin.surface.rows);
  for (std::uint32_t v = 0; v < skin.surface.rows; ++v) {
    glm::dvec3 p(skin.offsets[v]);
    for (std::uint32_t i = skin.surface.row_begin[v]; i < skin.surface.row_begin[v + 1]; ++i) {
      p += static_cast<double>(skin.surface.value[i]) * skin.points[skin.surface.column[i]];
    }
    places[v] = p;
  }
  return places;
}

}  // namespace nms::runtime
