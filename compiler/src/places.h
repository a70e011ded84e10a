#pragma once

#include <string_view>
#include <vector>

#include <nms/lang/tree.h>

namespace nms::compiler {

/// A direction that somebody or something is in, as the signer sees it.
struct Place {
  std::string_view name;
  double yaw_deg = 0.0;    ///< to the signer's left
  double pitch_deg = 0.0;  ///< up
  lang::NodeRef node;
  // Of a role: where the one is that it speaks to when it is quoted.
  double addressee_yaw_deg = 0.0;
  double addressee_pitch_deg = 0.0;
};

/// What names of places mean in one discourse, or inside one of its role shifts: `gaze NAME` goes there.
struct Places {
  std::vector<Place> known;
  /// Inside a role shift the head is turned towards the quoted one's addressee, and places are seen from there: that
  /// addressee's yaw. 0 outside.
  double addressee_yaw_deg = 0.0;

  [[nodiscard]] const Place* find(std::string_view name) const {
    for (const Place& p : known)
      if (p.name == name) return &p;
    return nullptr;
  }
};

}  // namespace nms::compiler
