#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string_view>

#include <nms/program/records.h>

/// The enumerators of records by name, the one list of them: the text form prints and reads them, the checker counts
/// them, whoever writes of a program elsewhere calls them so.
namespace nms::program {

template <typename Enum>
struct EnumNames;

template <>
struct EnumNames<Side> {
  static constexpr std::array<std::string_view, 3> kNames{"none", "left", "right"};
};
template <>
struct EnumNames<ChannelKind> {
  static constexpr std::array<std::string_view, 2> kNames{"action_unit", "axis"};
};
template <>
struct EnumNames<Motion> {
  static constexpr std::array<std::string_view, 7> kNames{"none",        "rotate_x",    "rotate_y",   "rotate_z",
                                                          "translate_x", "translate_y", "translate_z"};
};
template <>
struct EnumNames<Frame> {
  static constexpr std::array<std::string_view, 5> kNames{"none", "torso", "head", "jaw", "eyes"};
};
template <>
struct EnumNames<MergeOperator> {
  static constexpr std::array<std::string_view, 3> kNames{"strongest", "sum", "latest"};
};
template <>
struct EnumNames<ClipKind> {
  static constexpr std::array<std::string_view, 6> kNames{"pose",  "expression", "timeline",
                                                          "entry", "utterance",  "discourse"};
};
template <>
struct EnumNames<MarkerKind> {
  static constexpr std::array<std::string_view, 12> kNames{
      "mark",   "sign_start", "stroke_end", "sign_end", "onset",           "apex",
      "offset", "release",    "use_start",  "use_end",  "utterance_start", "utterance_end"};
};
template <>
struct EnumNames<Hand> {
  static constexpr std::array<std::string_view, 2> kNames{"signing", "other"};
};
template <>
struct EnumNames<MuscleKind> {
  static constexpr std::array<std::string_view, 7> kNames{"linear", "sheet", "sphincter", "eyelid",
                                                          "hinge",  "bulge", "roll"};
};
template <>
struct EnumNames<Falloff> {
  static constexpr std::array<std::string_view, 2> kNames{"smooth", "thesis"};
};
template <>
struct EnumNames<Axis> {
  static constexpr std::array<std::string_view, 6> kNames{"x", "y", "z", "-x", "-y", "-z"};
};
template <>
struct EnumNames<FacePartKind> {
  static constexpr std::array<std::string_view, 11> kNames{"skin",       "lashes",      "brows",      "eye_left",
                                                           "eye_right",  "teeth_upper", "gums_upper", "teeth_lower",
                                                           "gums_lower", "tongue",      "head"};
};

/// Whether a value read from a file is an enumerator at all.
template <typename Enum>
[[nodiscard]] constexpr bool is_enumerator(Enum value) {
  return static_cast<std::size_t>(value) < EnumNames<Enum>::kNames.size();
}

/// @pre is_enumerator(value)
template <typename Enum>
[[nodiscard]] constexpr std::string_view enum_name(Enum value) {
  return EnumNames<Enum>::kNames[static_cast<std::size_t>(value)];
}

template <typename Enum>
[[nodiscard]] constexpr std::optional<Enum> enum_from(std::string_view name) {
  for (std::size_t i = 0; i < EnumNames<Enum>::kNames.size(); ++i) {
    if (EnumNames<Enum>::kNames[i] == name) {
      return static_cast<Enum>(i);
    }
  }
  return std::nullopt;
}

}  // namespace nms::program
