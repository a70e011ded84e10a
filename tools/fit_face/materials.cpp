#include "materials.h"

#include <glm/vec3.hpp>

namespace nms::fit_face {

// Colours are linear. Open sheets whose back may show are double-sided.
Materials add_materials(runtime::FaceFile& file) {
  const auto add = [&](const char* name, const glm::vec3& color, float roughness, bool double_sided) {
    runtime::Material m;
    m.name = name;
    m.base_color = {color, 1.0F};
    m.roughness = roughness;
    m.double_sided = double_sided;
    file.materials.push_back(m);
    return static_cast<std::uint32_t>(file.materials.size() - 1);
  };
  Materials m{};
  m.skin = add("skin", {.62F, .37F, .27F}, .55F, false);
  m.lips = add("lips", {.47F, .175F, .15F}, .45F, true);
  m.mouth_lining = add("mouth_lining", {.35F, .09F, .08F}, .5F, true);
  m.cheek = add("cheek_inside", {.35F, .09F, .08F}, .5F, true);
  m.dark = add("mouth_dark", {.035F, .008F, .008F}, .9F, true);
  m.sclera = add("sclera", {.78F, .76F, .73F}, .18F, false);
  m.iris = add("iris", {.085F, .05F, .022F}, .15F, false);
  m.limbus = add("limbus", {.03F, .02F, .012F}, .15F, false);
  m.pupil = add("pupil", {.004F, .004F, .004F}, .08F, false);
  m.brow = add("brow", {.05F, .03F, .02F}, .85F, false);
  m.hair = add("hair", {.035F, .02F, .013F}, .62F, false);
  m.teeth = add("teeth", {.75F, .70F, .60F}, .25F, true);
  m.gums = add("gums", {.45F, .14F, .13F}, .35F, true);
  m.tongue = add("tongue", {.5F, .17F, .16F}, .4F, true);
  return m;
}

}  // namespace nms::fit_face
