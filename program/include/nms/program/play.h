#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <nms/program/program.h>

namespace nms::program {

/// A clip made ready for many times: its segments as cubics, eight channels side by side, and an index over time.
///
/// The segments that hold at one moment make a row. Rows are kept at every n-th knot of the clip in the order of time,
/// n = a third of its curves; what changes between two rows is kept as a list of events. A value at any time is a
/// search for the row, the row's cubics, and the few events since.
///
/// Memory: 64 bytes a knot, and 48 bytes a curve for each row: at most 208 bytes a knot and a row more. The program's
/// own tables are not needed any more.
/// Safe from many threads.
class BoundClip {
 public:
  /// Cost O(knots x log knots).
  /// @pre clip is of program
  BoundClip(const Program& program, const Clip& clip);

  /// Values of every channel of the clip at a time; the others keep what `values` holds. The same bits as evaluate().
  /// @param values  in/out, one for each channel of the program   [-]
  /// Cost O(curves + log knots), for any time. No allocation.
  void evaluate(std::int64_t time_ns, std::span<float> values) const;

  /// What it takes, itself included  [bytes]
  [[nodiscard]] std::size_t memory_size() const;

 private:
  friend class Player;

  static constexpr std::size_t kLanes = 8;

  /// Cubics of eight curves, see src/cubic.h; behind the last curve all 0.
  struct alignas(64) Block {
    double start[kLanes] = {};
    double rate[kLanes] = {};
    double a[kLanes] = {};
    double b[kLanes] = {};
    double c[kLanes] = {};
    double d[kLanes] = {};
  };
  /// Where the values of a block go.
  struct Place {
    std::uint32_t channel[kLanes] = {};
    std::uint32_t count = 0;
    bool is_run = false;  ///< eight channels, one behind the other
  };
  /// From a time on, another cubic holds for one curve.
  struct Event {
    std::int64_t time_ns = 0;
    std::uint32_t lane = 0;
    double start = 0.0;
    double rate = 0.0;
    double a = 0.0;
    double b = 0.0;
    double c = 0.0;
    double d = 0.0;
  };

  static void evaluate_blocks(const Block* blocks, const float* low, std::size_t count, double time_ns, float* out);
  void evaluate_row(const Block* row, double time_ns, float* values) const;
  static void apply(const Event& event, Block* row);
  void list_events(const Program& program, const Clip& clip);
  void lay_rows(std::vector<Block> row);
  /// The last row at or before the time.
  [[nodiscard]] std::size_t row_at(std::int64_t time_ns) const;
  [[nodiscard]] std::span<const Block> row(std::size_t index) const;

  std::size_t channel_count_ = 0;
  std::vector<Place> places_;         ///< one for each block of a row
  std::vector<float> low_;            ///< for each curve, and to the end of the last block: lowest value
  std::vector<Event> events_;         ///< by time, then curve
  std::size_t row_events_ = 1;        ///< events from one row to the next
  std::vector<std::int64_t> row_ns_;  ///< for each row: the time of the last event it has taken in
  std::vector<Block> rows_;
};

/// Play of one clip: costs least from one time to the next. Going back, or far ahead, is a seek: a search, never a
/// replay. Gives the same bits as evaluate().
class Player {
 public:
  /// @pre clip is of program
  Player(const Program& program, const Clip& clip) : clip_(program, clip) {}
  /// As BoundClip::evaluate.
  void advance(std::int64_t time_ns, std::span<float> values);

 private:
  void seek(std::int64_t time_ns);
  [[nodiscard]] bool is_near(std::int64_t time_ns) const;

  BoundClip clip_;
  std::vector<BoundClip::Block> row_;  ///< what holds at time_ns_
  std::size_t next_event_ = 0;         ///< the first after time_ns_
  std::int64_t time_ns_ = 0;           ///< of the last call
  bool is_placed_ = false;             ///< row_ and next_event_ are of time_ns_
};

}  // namespace nms::program
