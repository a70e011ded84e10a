#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace nms::compiler {

/// How far one channel is moved: AUs in [0, 1] (more where sums saturate), axes in signed shares of their full scale.
struct Amount {
  std::uint32_t channel = 0;
  double value = 0.0;
};

/// An instantaneous state: amounts by ascending channel, each channel once. A stated 0 is not the same as no amount.
using Pose = std::vector<Amount>;

/// Adds an amount to a pose; amounts of one channel add.
void add_amount(Pose& pose, std::uint32_t channel, double value);

/// Poses that are kept as long as a compilation, in blocks that never move: four bytes an amount if it is a whole
/// percentage, as nearly all are, else twelve.
class PoseStore {
 public:
  /// The number by which the pose is found again.
  [[nodiscard]] std::uint32_t keep(const Pose& pose);
  /// Adds the amounts of a kept pose, times `factor`.
  void add_to(Pose& into, std::uint32_t number, double factor) const;

 private:
  static constexpr std::size_t kBlockBytes = std::size_t{1} << 16U;
  static constexpr std::size_t kAlign = 4;  // numbers count in these, so that 32 bits reach 16 GB
  std::vector<std::unique_ptr<std::byte[]>> blocks_;
  std::size_t used_ = kBlockBytes;  ///< of the last block
};

}  // namespace nms::compiler
