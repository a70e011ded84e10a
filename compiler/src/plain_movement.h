#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include <nms/lang/tree.h>

#include "movement.h"
#include "name_index.h"

namespace nms::compiler {

/// The movements that large files are full of, worked out without the detours that all others need:
///
///     pose p = 60% AU12 + 40% AU4L                  whole shares of action units, each channel once, in range
///     expression e 2.4s { 40%: p; 60%: q }          whole shares and the names of poses in the same file
///
/// What is not quite that, or would have to be reported, is left to the evaluator; both come to the same.
class PlainMovements {
 public:
  explicit PlainMovements(Evaluator& evaluator);

  /// Works out a movement without arguments, if it is plain. True: it is right, and the evaluator knows it from now on.
  /// False: nothing has happened. Numbers are those of Declarations::movements, and come in ascending order.
  [[nodiscard]] bool work_out(std::uint32_t number);

 private:
  /// Where an action unit goes, as far as plain poses need to know.
  struct Unit {
    std::uint16_t channel = 0;  ///< of a sided one the left one, which the right one follows
    bool exists = false;
    bool sided = false;
  };
  struct Step {
    std::uint32_t share = 0;  ///< the node of its percentage
    std::uint32_t pose = 0;   ///< number of the movement that it names
  };
  struct Steps {
    std::uint32_t first = 0;
    std::uint32_t count = 0;  ///< 0: not plain
  };

  void read_ahead(std::uint32_t number);
  [[nodiscard]] bool add_steps(const Declaration& expression);
  [[nodiscard]] bool pose(std::uint32_t number);
  [[nodiscard]] bool add_term(const lang::Tree& tree, std::uint32_t term, Evaluator::Known& pose);
  [[nodiscard]] bool add(std::uint32_t channel, Evaluator::Known& pose);
  [[nodiscard]] bool expression(std::uint32_t number);
  [[nodiscard]] bool spend(std::uint32_t steps);

  Evaluator& evaluator_;
  const Declarations& declarations_;
  std::vector<Unit> units_;           ///< by number
  std::vector<std::uint64_t> moved_;  ///< by the pose at hand: a bit a channel

  // Tables of a large file do not fit in the processor's cache, and a step may name any pose. So names are looked up a
  // block of movements at a time: memory is asked for all of them before the first is needed.
  static constexpr std::uint32_t kBlock = 32;
  std::uint32_t block_end_ = 0;
  std::vector<Steps> block_;  ///< by number, from the block's first
  std::vector<Step> steps_;
  std::vector<NameKey> names_;  ///< of steps_
};

}  // namespace nms::compiler
