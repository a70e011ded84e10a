#include <cstring>

#include <nms/program/curve_shapes.h>

namespace nms::program {

std::optional<std::uint16_t> CurveShapes::shape(const Handles& handles, std::vector<Handles>& table) {
  std::uint64_t bits = 0;
  static_assert(sizeof(bits) == sizeof(handles));
  std::memcpy(&bits, &handles, sizeof(bits));
  const auto known = known_.find(bits);
  if (known != known_.end()) {
    return known->second;
  }
  if (known_.size() >= kShapeFirstReserved) {
    return std::nullopt;
  }
  const auto shape = static_cast<std::uint16_t>(known_.size());
  known_.emplace(bits, shape);
  table.push_back(handles);
  return shape;
}

}  // namespace nms::program
