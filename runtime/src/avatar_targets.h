#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace nms::runtime {

/// A share of one action unit: "AU12L", or one direction of an axis, "AU63".
struct UnitShare {
  std::string unit;
  float share = 1.0F;  ///< of the target's weight at 100 %
};

/// Which set a name is of, the one that says most exactly what is meant first. One movement must not be shown twice: of
/// two targets for one unit, "AU12" and "AU12L", "mouthSmile" and "mouthSmileLeft", the earlier set's serves it.
enum class NameSet : std::uint8_t { facs_side, facs, arkit_side, arkit, vrm_side, vrm };

struct TargetName {
  NameSet set = NameSet::facs_side;
  std::vector<UnitShare>
      units;  ///< the target's weight is the strongest of unit x share; empty: a name of no known set
};

/// What a morph target, an expression or a bone of an avatar that others made is called, without case and punctuation:
/// "eyeBlink_L" and "EyeBlinkLeft" are both "eyeblinkleft".
[[nodiscard]] std::string plain_name(std::string_view name);

/// Its words, small: "CC_Base_L_Eye" is cc base l eye, "J_Adj_L_FaceEye" j adj l face eye.
[[nodiscard]] std::vector<std::string> words_of(std::string_view name);

/// The action units that a target of that name shows: ARKit's blend shapes but mouthClose, mouthLeft and mouthRight,
/// which no unit stands for; FACS names (AU12, AU12_L, au12left, AU01_inner_brow_raiser_R, AD19, InnerBrowRaiser_L);
/// the presets of VRM 1.0.
///
/// Sides are the subject's. What a set does not part by side (browInnerUp) shows the stronger side, unless the avatar
/// parts it (browInnerUpLeft). Shares other than 1 are our own choice: ARKit gives no FACS intensities. A name of
/// several units, "AU6+AU12", is a correction of both and no unit's own: it shows none.
[[nodiscard]] TargetName units_of_target(std::string_view name);

}  // namespace nms::runtime
