#include "pose_stream.h"

#include <array>
#include <cstdint>

#include <fmt/format.h>

namespace nms::bench {
namespace {

/// A fixed sequence, so that runs compare (Knuth's MMIX generator).
class Sequence {
 public:
  std::uint32_t below(std::uint32_t n) {
    state_ = state_ * 6364136223846793005U + 1442695040888963407U;
    return static_cast<std::uint32_t>(state_ >> 33U) % n;
  }

 private:
  std::uint64_t state_ = 1;
};

/// Units of the face; the first kSided have a left and a right.
constexpr std::array<int, 30> kUnits{1,  2,  4,  5,  6,  7,  9,  10, 11, 12, 13, 14, 15, 16, 20,
                                     30, 33, 34, 36, 38, 17, 18, 22, 23, 24, 25, 26, 27, 28, 29};
constexpr std::size_t kSided = 20;

void pose(Sequence& s, std::size_t number, PoseStream& out) {
  out.nms += fmt::format("pose p{} = ", number);
  out.lua += fmt::format("p{} = {{ ", number);
  std::array<int, kUnits.size()> units = kUnits;
  const std::uint32_t count = 2 + s.below(5);
  for (std::uint32_t i = 0; i < count; ++i) {
    // Each unit once, so that no sum passes 100 %.
    const std::size_t pick = i + s.below(static_cast<std::uint32_t>(units.size()) - i);
    std::swap(units[i], units[pick]);
    bool sided = false;
    for (std::size_t k = 0; k < kSided; ++k) sided = sided || kUnits[k] == units[i];
    const char* side = sided && s.below(8) == 0 ? (s.below(2) == 0 ? "L" : "R") : "";
    const std::uint32_t percent = 5 + s.below(96);
    out.nms += fmt::format("{}{}% AU{}{}", i == 0 ? "" : " + ", percent, units[i], side);
    out.lua += fmt::format("{}AU{}{} = {}", i == 0 ? "" : ", ", units[i], side, percent);
  }
  out.nms += '\n';
  out.lua += " }\n";
}

void expression(Sequence& s, std::size_t number, std::size_t poses, PoseStream& out) {
  const std::uint32_t tenths = 5 + s.below(35);
  out.nms += fmt::format("expression e{} {}.{}s {{\n", number, tenths / 10, tenths % 10);
  out.lua += fmt::format("e{} = {{ {}.{},\n", number, tenths / 10, tenths % 10);
  const std::uint32_t steps = 2 + s.below(3);
  std::uint32_t left = 100;
  for (std::uint32_t i = 0; i < steps; ++i) {
    const std::uint32_t share = i + 1 == steps ? left : 10 + s.below(left - 10 * (steps - i));
    left -= share;
    const std::uint32_t which = s.below(static_cast<std::uint32_t>(poses));
    out.nms += fmt::format("  {}%: p{}\n", share, which);
    out.lua += fmt::format("  {{ {}, p{} }},\n", share, which);
  }
  out.nms += "}\n";
  out.lua += "}\n";
}

}  // namespace

PoseStream make_pose_stream(std::size_t bytes) {
  Sequence s;
  PoseStream out;
  std::size_t poses = 0;
  while (out.nms.size() < bytes) {
    if (poses == 0 || s.below(10) < 6)
      pose(s, poses++, out);
    else
      expression(s, out.definitions, poses, out);
    ++out.definitions;
  }
  return out;
}

}  // namespace nms::bench
