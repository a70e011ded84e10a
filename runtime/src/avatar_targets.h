#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace nms::runtime {

/// A share of one action unit: "AU12L", or one direction of an axis, "AU63".
struct UnitShare {
  std::string unit;
  float share = 1.0F;  ///< of the target's weight at 100 %
};

/// What a morph target or an expression of an avatar that others made is called, without case and punctuation:
/// "eyeBlink_L" and "EyeBlinkLeft" are both "eyeblinkleft".
[[nodiscard]] std::string plain_name(std::string_view name);

/// The action units that a target of that name shows: its weight is the strongest of unit x share. ARKit's 52 blend
/// shapes, FACS names (AU12, AU12_L, au12left), the presets of VRM 1.0. Empty: a name of no known set.
///
/// Sides are the subject's. ARKit does not part AU1 and AU34 by side: the stronger side is shown. Shares other than 1
/// are our own choice: ARKit gives no FACS intensities.
[[nodiscard]] std::vector<UnitShare> units_of_target(std::string_view name);

}  // namespace nms::runtime
