#pragma once

#include <glm/vec3.hpp>

#include "model.h"

namespace nms::fit_face {

/// Centre of the left eyeball [mm]. The scan's eyeball is no sphere and sits elsewhere in the lids; this one leaves
/// room for a sphere that turns.
inline constexpr glm::dvec3 kEyeCentre{31.16, 36.02, 79.82};

/// Lays the lids' backs on a sphere just off the eyeball, from the lids' edges away from the opening, so that the lids
/// can slide over the eye. The scan's own socket is not a sphere and is not followed.
void shape_lid_backs(Model& model);

/// Draws the lining inwards at the corner of the mouth, where the scan's hairpin would fold it out over the lip.
void tuck_lining(Model& model);

/// Parts the lips' edges beside the corner of the mouth, where the scan's cross.
void part_corner(Model& model);

/// The parameter of the mouth's corner on the curves of the lips: where they reach furthest out.
double mouth_corner(const Model& model);

}  // namespace nms::fit_face
