#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nms/program/program.h>
#include <nms/runtime/rig.h>

/// Poses that a face must stand: every unit, every pair that one body can do together, and mixtures.
namespace nms::fit_face {

struct FacePose {
  std::string what;           ///< "60 % AU12", "AU10 + AU13"
  std::vector<float> values;  ///< one for each channel
};

/// Each unit at 30, 60 and 100 %, both sides together; of axes each direction.
std::vector<FacePose> each_unit(const program::Program& program, const runtime::Rig& rig);

/// Pairs at 100 %. Head and torso as a whole are left out: they move no skin against teeth or eyes.
std::vector<FacePose> each_pair(const program::Program& program, const runtime::Rig& rig);

/// Two to six channels at `least` to 100 %, sides apart; the same for the same seed.
std::vector<FacePose> mixtures(const program::Program& program, std::uint32_t seed, int count, float least = 0.2F);

}  // namespace nms::fit_face
