#pragma once

#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include <nms/program/records.h>

namespace nms::program {

/// Gives the cubic segments of one curve their shapes, in the order of its knots: equal segments share one.
class CurveShapes {
 public:
  /// The next curve begins.
  void clear() { known_.clear(); }
  /// The shape of a knot whose segment has these inner values; new ones are added to `table`.
  /// Nothing: the curve has as many different ones as a shape can count.
  [[nodiscard]] std::optional<std::uint16_t> shape(const Handles& handles, std::vector<Handles>& table);

 private:
  std::unordered_map<std::uint64_t, std::uint16_t> known_;  ///< by the bits of both values
};

}  // namespace nms::program
