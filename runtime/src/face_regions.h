#pragma once

#include <nms/runtime/face.h>
#include <nms/runtime/face_scale.h>

namespace nms::runtime {

/// Gives a face the regions that muscles ask for and it does not have, from its landmarks and from how its skin hangs
/// together: lip_upper, lip_lower, lining and raised about the mouth, lid_upper and lid_lower of each eye, jaw, neck.
///
/// Upper and lower lip, and upper and lower lid, may touch in space; along the skin they are far apart. So a vertex is
/// of the lip whose border is nearer along the skin, and it lies inside the mouth, or behind the lids, if no way leads
/// from the nose to it but over that border. Skin about them follows less and less with its distance along the skin.
/// The jaw's and the neck's shares are ramps in space, as far as lengths on the reference face say, scaled.
///
/// Regions whose landmarks are missing are left out.
void add_regions(Face& face, const Landmarks& landmarks);

}  // namespace nms::runtime
