#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include <nms/lang/quantity.h>
#include <nms/program/records.h>

#include "declarations.h"
#include "layer.h"

namespace nms::compiler {

/// How the values of layers are joined on a track's channels.
enum class LayerOperator : std::uint8_t {
  either,   ///< 1 - prod(1 - v_i); axes add
  highest,  ///< a higher layer takes the place of those below, as far as its envelope says
};

/// A track with what stdlib says of it.
struct TrackInfo {
  std::string name;
  program::MergeOperator merge = program::MergeOperator::strongest;
  LayerOperator layers = LayerOperator::either;
  /// What tracks of the same slot share: of the layers in `slot_order` one moves it at a time, the first that does.
  std::string slot;
  std::vector<Layer> slot_order;
  std::int64_t onset_ns = 0;
  std::int64_t offset_ns = 0;
};

/// Channels that stand in a relation to another: one, or both sides of a unit, of which the larger counts.
struct Related {
  std::uint32_t first = 0;
  std::uint32_t last = 0;
  double least = 0.0;  ///< both are meant to be seen from this value on
};

struct ChannelInfo {
  std::string name;
  std::string title;
  std::string positive, negative;  ///< of an axis
  std::uint32_t track = 0;
  program::ChannelKind kind = program::ChannelKind::action_unit;
  program::Side side = program::Side::none;
  program::Motion motion = program::Motion::none;
  program::Frame frame = program::Frame::none;
  std::uint16_t au = 0;
  double full_scale = 0.0;  ///< of an axis, in `unit`: degrees or millimetres; may be negative
  lang::Unit unit = lang::Unit::none;
  std::vector<Related> antagonists;  ///< a face cannot do both
  std::vector<Related> contrary;     ///< a face can do both, two grammatical markers cannot
  std::vector<Related> hidden_by;    ///< where those are, nothing is seen of it
  std::int64_t longest_ns = 0;       ///< 0, or how long it may last before it is another unit
  std::string beyond_longest;        ///< the other unit's name

  [[nodiscard]] bool is_axis() const { return kind == program::ChannelKind::axis; }
  [[nodiscard]] double low() const { return is_axis() ? -1.0 : 0.0; }
};

/// Where an AU's value goes: its channel or channels, and the sign on an axis.
struct UnitInfo {
  std::uint16_t number = 0;
  bool sided = false;
  std::uint32_t channel = 0;  ///< unsided, or an axis; sided: the left one, the right one follows it
  double sign = 1.0;
  Declaration declaration;
};

/// All channels there are, in the program's order: AUs by number, left before right, then axes by their first AU.
struct Channels {
  std::vector<TrackInfo> tracks;
  std::vector<ChannelInfo> channels;
  std::vector<UnitInfo> units;  ///< by number

  std::vector<std::uint16_t> unit_of_number;  ///< index in `units`, one more; 0: there is none

  [[nodiscard]] const TrackInfo& track_of(std::uint32_t channel) const { return tracks[channels[channel].track]; }
  [[nodiscard]] const UnitInfo* find_unit(std::uint32_t number) const {
    const std::uint16_t at = number < unit_of_number.size() ? unit_of_number[number] : std::uint16_t{0};
    return at == 0 ? nullptr : &units[at - 1U];
  }
  /// Index of the axis of that name, or kUnreachable.
  [[nodiscard]] std::uint32_t find_axis(std::string_view name) const;
  [[nodiscard]] std::vector<std::string> unit_names() const;
};

/// Whether a property of an `au` is anything but the share of a muscle.
[[nodiscard]] bool is_unit_property(std::string_view name);

/// Checks tracks, AUs and axes. Where several files declare one name, the first in use counts.
[[nodiscard]] Channels build_channels(const std::vector<LoadedFile>& files, const Declarations& declarations,
                                      lang::Diagnostics& diagnostics);

}  // namespace nms::compiler
