#include <nms/runtime/landmark_set.h>

namespace nms::runtime {

namespace {

constexpr LandmarkInfo kSet[] = {
    {"trichion", false, "middle of the hair line"},
    {"forehead_mid", false, "middle of the forehead"},
    {"forehead_inner", true, "forehead above the brow's inner end, under the hair line"},
    {"forehead_outer", true, "forehead above the brow's outer third, under the hair line"},
    {"glabella", false, "between the brows, where the forehead stands out most"},
    {"brow_inner", true, "the brow's inner end"},
    {"brow_mid", true, "the brow's highest place"},
    {"brow_outer", true, "the brow's outer end"},
    {"nasion", false, "root of the nose, its deepest place from the side"},
    {"temple", true, "hollow of the temple, behind the brow's outer end"},
    {"eye_centre", true, "centre of the eyeball; a part eye_left or eye_right tells it"},
    {"eye_inner", true, "inner corner of the eye, on the lids' edge"},
    {"eye_outer", true, "outer corner of the eye, on the lids' edge"},
    {"lid_upper_mid", true, "middle of the upper lid's front edge"},
    {"lid_lower_mid", true, "middle of the lower lid's front edge"},
    {"infraorbital", true, "below the eye's middle, on the edge of its socket"},
    {"nasal_bone", true, "side of the nose's bridge, half-way down its bone"},
    {"nose_tip", false, "the nose's foremost place"},
    {"ala", true, "wing of the nose, its outermost place"},
    {"ala_crease", true, "where the wing meets the cheek"},
    {"nostril", true, "middle of the nostril"},
    {"canine_fossa", true, "hollow beside the nose, above the canine tooth"},
    {"subnasale", false, "where the nose's partition meets the lip"},
    {"malar", true, "cheekbone below the eye's outer half"},
    {"zygomatic", true, "side of the cheekbone, where the large zygomatic muscle begins"},
    {"zygomatic_minor", true, "the same of the small one, nearer to the nose"},
    {"tragion", true, "notch above the ear's small flap"},
    {"cheek_mid", true, "middle of the soft cheek, beside the mouth"},
    {"buccinator_origin", true, "cheek behind the corner of the mouth, between the rows of teeth"},
    {"risorius_origin", true, "cheek before the masseter, as high as the mouth"},
    {"masseter", true, "middle of the chewing muscle, before the angle of the jaw"},
    {"lip_upper_mid", false, "middle of the upper lip's red border"},
    {"lip_upper_lateral", true, "upper lip's red border, two thirds of the way to the corner"},
    {"stomion", false, "where the lips meet, in the middle"},
    {"mouth_corner", true, "corner of the mouth"},
    {"lip_lower_lateral", true, "lower lip's red border, two thirds of the way to the corner"},
    {"lip_lower_mid", false, "middle of the lower lip's red border"},
    {"mentolabial", false, "deepest place of the fold between lip and chin"},
    {"pogonion", false, "the chin's foremost place"},
    {"menton", false, "the chin's lowest place"},
    {"chin_lateral", true, "side of the chin's boss"},
    {"chin_tubercle", true, "the jaw's edge below the corner of the mouth, in front"},
    {"jaw_body", true, "the jaw's edge, half-way from the chin to its angle"},
    {"jaw_angle", true, "angle of the jaw, below the ear"},
    {"jaw_hinge", true, "in front of the ear, at its lobe: what the jaw turns about"},
    {"cervical", false, "where chin and throat meet"},
    {"neck_side", true, "side of the neck, half-way down"},
    {"platysma_clavicle", true, "collarbone, its middle"},
    {"head_pivot", false, "between the ears, on the top of the spine: what the head turns about"},
    {"torso_pivot", false, "root of the neck: what the upper body turns about"},
};

}  // namespace

std::span<const LandmarkInfo> landmark_set() { return kSet; }

std::span<const RegionNeeds> region_needs() {
  static const std::vector<RegionNeeds> kNeeds = {
      {"lip_upper", {"mouth_corner", "lip_upper_mid", "lip_lower_mid", "nose_tip"}},
      {"lip_lower", {"mouth_corner", "lip_upper_mid", "lip_lower_mid", "nose_tip"}},
      {"lining", {"mouth_corner", "lip_upper_mid", "lip_lower_mid", "nose_tip"}},
      {"raised", {"mouth_corner", "lip_upper_mid", "lip_lower_mid", "nose_tip"}},
      {"lid_upper", {"eye_inner", "eye_outer", "lid_upper_mid", "lid_lower_mid"}},
      {"lid_lower", {"eye_inner", "eye_outer", "lid_upper_mid", "lid_lower_mid"}},
      {"lids", {"eye_inner", "eye_outer", "lid_upper_mid", "lid_lower_mid"}},
      {"jaw", {"jaw_hinge", "stomion", "menton"}},
      {"neck", {"jaw_hinge", "menton"}},
  };
  return kNeeds;
}

}  // namespace nms::runtime
