#include "check_tables.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <nms/program/enum_names.h>

#include <nms/program/utf8.h>

namespace nms::program {
namespace {

constexpr float kPi = 3.14159274F;  // the float next above pi, so that 180 degrees, however rounded, pass
constexpr float kLargest = std::numeric_limits<float>::max();

/// False for NaN.
bool is_within(float value, float low, float high) { return value >= low && value <= high; }
bool is_finite(float value) { return is_within(value, -kLargest, kLargest); }
bool is_time(std::int64_t time_ns) { return time_ns >= -kTimeLimit_ns && time_ns <= kTimeLimit_ns; }

template <std::size_t N>
bool is_zero(const std::uint8_t (&bytes)[N]) {
  return std::all_of(bytes, bytes + N, [](std::uint8_t byte) { return byte == 0; });
}

template <std::size_t N>
bool is_finite(const float (&values)[N]) {
  return std::all_of(values, values + N, [](float value) { return is_finite(value); });
}

/// One check for each table, in an order in which each trusts only what has been checked before it.
/// Each returns false once `failure` is set.
class Checker {
 public:
  Checker(const Program& program, std::string_view place) : program_(program), place_(place) {}

  std::optional<Failure> run() {
    (void)(strings() && tracks() && channels() && knots() && curves() && clips() && markers() && sources() &&
           inputs() && muscles() && actuations() && landmarks() && faces() && face_parts());
    return std::move(failure_);
  }

 private:
  bool refuse(std::string_view table, std::size_t index, std::string cause) {
    failure_ = Failure{"invalid_program", fmt::format("{}: {}[{}]", place_, table, index), std::move(cause),
                       std::string(kReport)};
    return false;
  }

  [[nodiscard]] bool is_string(StringId id) const {
    return static_cast<std::size_t>(id) < program_.string_begin.size() - 1;  // no + 1: a size may have 32 bits
  }
  [[nodiscard]] bool is_channel(ChannelId id) const { return static_cast<std::size_t>(id) < program_.channels.size(); }

  bool strings();
  bool tracks();
  bool channels();
  bool channel(std::size_t index);
  bool knots();
  bool curves();
  bool curve(std::size_t index, std::size_t& next_handle);
  bool clips();
  bool markers();
  bool sources();
  bool inputs();
  bool muscles();
  bool actuations();
  bool landmarks();
  bool face_parts();
  bool faces();

  template <typename Record>
  bool unique_names(std::string_view table, std::span<const Record> records);

  const Program& program_;
  std::string_view place_;
  std::optional<Failure> failure_;
};

bool Checker::strings() {
  const auto begin = program_.string_begin;
  const std::size_t byte_count = program_.string_bytes.size();
  if (begin.size() < 2 || begin[0] != 0 || begin[1] != 0) {
    return refuse("string_begin", 0, "string 0 is not the empty string");
  }
  for (std::size_t i = 1; i < begin.size(); ++i) {
    if (begin[i] < begin[i - 1] || begin[i] > byte_count) {
      return refuse("string_begin", i, fmt::format("string {} would end before it begins, or past the strings", i - 1));
    }
    const std::uint32_t length = begin[i] - begin[i - 1];
    if (length == 0 && i > 1) {
      return refuse("string_begin", i - 1, "an empty string that is not string 0");
    }
    if (length > kStringLimit) {
      return refuse("string_begin", i - 1,
                    fmt::format("a string of {} bytes; {} are the most", grouped(length), grouped(kStringLimit)));
    }
    if (!is_utf8({program_.string_bytes.data() + begin[i - 1], length})) {
      return refuse("string_begin", i - 1, "the string is not UTF-8");
    }
  }
  if (begin.back() != byte_count) {
    return refuse("string_begin", begin.size() - 1,
                  fmt::format("the strings end at byte {} of {}", begin.back(), byte_count));
  }
  return true;
}

/// What is looked up by its name has one, of its own.
template <typename Record>
bool Checker::unique_names(std::string_view table, std::span<const Record> records) {
  std::vector<std::pair<std::string_view, std::size_t>> names;
  names.reserve(records.size());
  for (std::size_t i = 0; i < records.size(); ++i) {
    names.emplace_back(program_.string(records[i].name), i);
  }
  std::sort(names.begin(), names.end());
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (names[i].first.empty()) {
      return refuse(table, names[i].second, "it has no name");
    }
    if (i > 0 && names[i].first == names[i - 1].first) {
      return refuse(table, names[i].second,
                    fmt::format("\"{}\" is also the name of {}[{}]", names[i].first, table, names[i - 1].second));
    }
  }
  return true;
}

bool Checker::tracks() {
  for (std::size_t i = 0; i < program_.tracks.size(); ++i) {
    const Track& track = program_.tracks[i];
    if (!is_string(track.name) || !is_enumerator(track.merge) || !is_zero(track.zero)) {
      return refuse("tracks", i, "its name, its merge operator or its filling is out of range");
    }
  }
  return unique_names("tracks", program_.tracks);
}

bool Checker::channels() {
  for (std::size_t i = 0; i < program_.channels.size(); ++i) {
    if (!channel(i)) {
      return false;
    }
  }
  return unique_names("channels", program_.channels);
}

bool Checker::channel(std::size_t index) {
  const Channel& channel = program_.channels[index];
  if (!is_string(channel.name) || !is_string(channel.title) || !is_string(channel.positive) ||
      !is_string(channel.negative)) {
    return refuse("channels", index, "it names a string that there is not");
  }
  if (channel.track != kNone && channel.track >= program_.tracks.size()) {
    return refuse("channels", index, fmt::format("there is no track {}", channel.track));
  }
  if (!is_enumerator(channel.kind) || !is_enumerator(channel.side) || !is_enumerator(channel.motion) ||
      !is_enumerator(channel.frame) || !is_zero(channel.zero)) {
    return refuse("channels", index, "its kind, side, motion, frame or filling is out of range");
  }
  // Negative where the positive unit goes against the right-hand rule: head up is a turn about -x.
  if (!is_finite(channel.full_scale)) {
    return refuse("channels", index, "its full scale is not a finite number");
  }
  const bool has_pair = channel.positive != StringId{} && channel.negative != StringId{};
  const bool has_neither = channel.positive == StringId{} && channel.negative == StringId{};
  if (channel.kind == ChannelKind::axis) {
    if (!has_pair || channel.side != Side::none) {
      return refuse("channels", index, "an axis has two action units and no side");
    }
    return true;
  }
  if (!has_neither || channel.full_scale != 0.0F || channel.motion != Motion::none || channel.frame != Frame::none) {
    return refuse("channels", index, "an action unit has no pair, full scale, motion or frame: those are an axis'");
  }
  const std::string_view name = program_.string(channel.name);
  if ((channel.side == Side::left && (name.empty() || name.back() != 'L')) ||
      (channel.side == Side::right && (name.empty() || name.back() != 'R'))) {
    return refuse(
        "channels", index,
        fmt::format("\"{}\" is of the signer's {} side, its name says otherwise", name, enum_name(channel.side)));
  }
  return true;
}

bool Checker::knots() {
  for (std::size_t i = 0; i < program_.knots.size(); ++i) {
    const Knot& knot = program_.knots[i];
    if (!is_time(knot.time_ns())) {
      return refuse("knots", i, fmt::format("its time, {} ns, is too far from its clip's origin", knot.time_ns()));
    }
    const bool is_named = knot.shape == kShapeSmooth || knot.shape == kShapeLinear || knot.shape == kShapeHold;
    if (!is_named && knot.shape >= kShapeFirstReserved) {
      return refuse("knots", i, fmt::format("its segment has no shape {}", knot.shape));
    }
  }
  for (std::size_t i = 0; i < program_.handles.size(); ++i) {
    const Handles& handles = program_.handles[i];
    if (!is_within(handles.b1, -3.0F, 3.0F) || !is_within(handles.b2, -3.0F, 3.0F)) {
      return refuse("handles", i, fmt::format("({}, {}) is outside -3 to 3", handles.b1, handles.b2));
    }
  }
  return true;
}

bool Checker::curves() {
  std::size_t next_knot = 0;
  std::size_t next_handle = 0;
  for (std::size_t i = 0; i < program_.curves.size(); ++i) {
    const Curve& curve = program_.curves[i];
    if (!is_channel(curve.channel)) {
      return refuse("curves", i, fmt::format("there is no channel {}", static_cast<std::uint32_t>(curve.channel)));
    }
    if (curve.knot_count == 0 || curve.first_knot != next_knot ||
        curve.knot_count > program_.knots.size() - next_knot) {
      return refuse("curves", i,
                    fmt::format("it should have at least one knot, from knot {} of {}; it has {} from {}", next_knot,
                                program_.knots.size(), curve.knot_count, curve.first_knot));
    }
    next_knot += curve.knot_count;
    if (curve.first_handle != next_handle) {
      return refuse("curves", i,
                    fmt::format("its handles should begin with handle {}, not {}", next_handle, curve.first_handle));
    }
    if (!this->curve(i, next_handle)) {
      return false;
    }
  }
  if (next_handle != program_.handles.size()) {
    return refuse("handles", next_handle, "it is of no curve");
  }
  if (next_knot != program_.knots.size()) {
    return refuse("knots", next_knot, "it is of no curve");
  }
  return true;
}

/// @param next_handle  in: the curve's first handle; out: the one behind its last
bool Checker::curve(std::size_t index, std::size_t& next_handle) {
  const Curve& curve = program_.curves[index];
  const bool is_axis = program_.channels[static_cast<std::size_t>(curve.channel)].kind == ChannelKind::axis;
  const std::size_t end = std::size_t{curve.first_knot} + curve.knot_count;
  for (std::size_t k = curve.first_knot; k < end; ++k) {
    const Knot& knot = program_.knots[k];
    if (!is_within(knot.value, is_axis ? -1.0F : 0.0F, 1.0F)) {
      return refuse("knots", k,
                    fmt::format("its value is {}; {} goes from {} to 1", knot.value,
                                is_axis ? "an axis" : "an action unit", is_axis ? -1 : 0));
    }
    if (k > curve.first_knot && knot.time_ns() < program_.knots[k - 1].time_ns()) {
      return refuse("knots", k, "it is earlier than the knot before it");
    }
    if (k > curve.first_knot + std::size_t{1} && knot.time_ns() == program_.knots[k - 2].time_ns()) {
      return refuse("knots", k, "three knots of one curve share a time; a jump takes two");
    }
    if (knot.shape >= kShapeFirstReserved) {
      continue;
    }
    const std::size_t handle = std::size_t{curve.first_handle} + knot.shape;
    if (handle > next_handle || handle >= program_.handles.size()) {
      return refuse("knots", k, fmt::format("its segment has no shape {}, or not yet", knot.shape));
    }
    next_handle = std::max(next_handle, handle + 1);
    const Handles& handles = program_.handles[handle];
    if (!is_axis && (!is_within(handles.b1, -1.0F, 2.0F) || !is_within(handles.b2, -1.0F, 2.0F))) {
      return refuse("knots", k,
                    fmt::format("an action unit's inner values ({}, {}) are outside -1 to 2", handles.b1, handles.b2));
    }
  }
  return true;
}

bool Checker::clips() {
  std::size_t next_curve = 0;
  std::size_t next_marker = 0;
  // The clips share out each table in their order, so nothing is of no clip, or of two.
  const auto takes = [](std::size_t& next, std::uint32_t first, std::uint32_t count, std::size_t size) {
    if (count == 0) {
      return true;
    }
    if (first != next || count > size - next) {
      return false;
    }
    next += count;
    return true;
  };
  for (std::size_t i = 0; i < program_.clips.size(); ++i) {
    const Clip& clip = program_.clips[i];
    if (!is_string(clip.name) || !is_enumerator(clip.kind) || !is_zero(clip.zero)) {
      return refuse("clips", i, "its name, kind or filling is out of range");
    }
    if (!is_time(clip.start_ns) || !is_time(clip.end_ns) || clip.end_ns < clip.start_ns) {
      return refuse("clips", i, fmt::format("it cannot last from {} to {} ns", clip.start_ns, clip.end_ns));
    }
    if ((clip.curve_count == 0 && clip.first_curve > program_.curves.size()) ||
        !takes(next_curve, clip.first_curve, clip.curve_count, program_.curves.size())) {
      return refuse("clips", i, fmt::format("its curves should begin with curve {}", next_curve));
    }
    if ((clip.marker_count == 0 && clip.first_marker > program_.markers.size()) ||
        !takes(next_marker, clip.first_marker, clip.marker_count, program_.markers.size())) {
      return refuse("clips", i, fmt::format("its markers should begin with marker {}", next_marker));
    }
    for (std::size_t c = std::size_t{clip.first_curve} + 1; c < std::size_t{clip.first_curve} + clip.curve_count; ++c) {
      if (program_.curves[c].channel <= program_.curves[c - 1].channel) {
        return refuse("curves", c, "a clip's curves are ordered by channel, and a channel occurs once");
      }
    }
  }
  if (next_curve != program_.curves.size() || next_marker != program_.markers.size()) {
    return refuse("clips", program_.clips.size(), "there are curves or markers of no clip");
  }
  return true;
}

bool Checker::markers() {
  for (std::size_t i = 0; i < program_.markers.size(); ++i) {
    const Marker& marker = program_.markers[i];
    if (!is_time(marker.time_ns) || !is_string(marker.name) || !is_enumerator(marker.kind) ||
        !is_enumerator(marker.hand) || !is_zero(marker.zero)) {
      return refuse("markers", i, "its time, name, kind, hand or filling is out of range");
    }
  }
  for (const Clip& clip : program_.clips) {
    for (std::size_t m = std::size_t{clip.first_marker} + 1; m < std::size_t{clip.first_marker} + clip.marker_count;
         ++m) {
      if (program_.markers[m].time_ns < program_.markers[m - 1].time_ns) {
        return refuse("markers", m, "it is earlier than the marker before it");
      }
    }
  }
  return true;
}

bool Checker::sources() {
  for (std::size_t i = 0; i < program_.sources.size(); ++i) {
    const Source& source = program_.sources[i];
    if (!is_string(source.file) || !is_string(source.entry)) {
      return refuse("sources", i, "it names a string that there is not");
    }
    if (source.line == 0 || source.column == 0) {
      return refuse("sources", i, "lines and columns count from 1");
    }
  }
  if (!program_.knot_sources.empty() && program_.knot_sources.size() != program_.knots.size()) {
    return refuse("knot_sources", 0,
                  fmt::format("there are {} for {} knots", program_.knot_sources.size(), program_.knots.size()));
  }
  for (std::size_t i = 0; i < program_.knot_sources.size(); ++i) {
    const std::uint32_t source = program_.knot_sources[i];
    if (source != kNone && source >= program_.sources.size()) {
      return refuse("knot_sources", i, fmt::format("there is no source {}", source));
    }
  }
  return true;
}

bool Checker::inputs() {
  for (std::size_t i = 0; i < program_.inputs.size(); ++i) {
    const Input& input = program_.inputs[i];
    if (!is_string(input.name) || !is_string(input.from) || !is_string(input.path) || !is_zero(input.zero)) {
      return refuse("inputs", i, "it names a string that there is not, or its filling is not zero");
    }
    if (input.name == StringId{} || input.path == StringId{}) {
      return refuse("inputs", i, "it has no name, or no path");
    }
  }
  return true;
}

bool Checker::muscles() {
  for (std::size_t i = 0; i < program_.muscles.size(); ++i) {
    const Muscle& muscle = program_.muscles[i];
    if (!is_string(muscle.name) || !is_string(muscle.attachment) || !is_string(muscle.insertion) ||
        !is_string(muscle.region) || !is_string(muscle.except)) {
      return refuse("muscles", i, "it names a string that there is not");
    }
    if (!is_enumerator(muscle.kind) || !is_enumerator(muscle.side) || !is_enumerator(muscle.falloff) ||
        !is_enumerator(muscle.frame)) {
      return refuse("muscles", i, "its kind, side, falloff or frame is out of range");
    }
    if (!is_finite(muscle.attachment_offset) || !is_finite(muscle.insertion_offset) || !is_finite(muscle.slide) ||
        !is_finite(muscle.amount)) {
      return refuse("muscles", i, "an offset, slide or amount is not a finite number");
    }
    const bool turns =
        muscle.kind == MuscleKind::eyelid || muscle.kind == MuscleKind::hinge || muscle.kind == MuscleKind::roll;
    if (!is_within(muscle.angle, turns ? -kPi : 0.0F, kPi)) {
      return refuse("muscles", i, fmt::format("its angle is {} rad", muscle.angle));
    }
    for (const float size : {muscle.insertion_radius, muscle.dissipation_radius, muscle.perpendicular_radius,
                             muscle.major_radius, muscle.minor_radius, muscle.limit}) {
      if (!is_within(size, 0.0F, kLargest)) {
        return refuse("muscles", i, fmt::format("a radius or its limit is {}; it should be 0 or more", size));
      }
    }
    if (!is_within(muscle.closes, 0.0F, 1.0F)) {
      return refuse("muscles", i,
                    fmt::format("its share of the way to the other lid is {}, not 0 to 1", muscle.closes));
    }
    if (muscle.kind == MuscleKind::hinge && muscle.frame == Frame::none) {
      return refuse("muscles", i, "a hinge moves a frame, and this one has none");
    }
  }
  return unique_names("muscles", program_.muscles);
}

bool Checker::actuations() {
  for (std::size_t i = 0; i < program_.actuations.size(); ++i) {
    const Actuation& actuation = program_.actuations[i];
    if (!is_channel(actuation.channel) || static_cast<std::size_t>(actuation.muscle) >= program_.muscles.size()) {
      return refuse("actuations", i, "there is no such channel, or no such muscle");
    }
    if (!is_finite(actuation.share)) {
      return refuse("actuations", i, "its share is not a finite number");
    }
    if (i > 0) {
      const Actuation& before = program_.actuations[i - 1];
      if (actuation.channel < before.channel ||
          (actuation.channel == before.channel && actuation.muscle <= before.muscle)) {
        return refuse("actuations", i, "they are ordered by channel, then muscle, and a pair occurs once");
      }
    }
  }
  return true;
}

bool Checker::landmarks() {
  for (std::size_t i = 0; i < program_.landmarks.size(); ++i) {
    const Landmark& landmark = program_.landmarks[i];
    if (!is_string(landmark.name) || !is_finite(landmark.position) || !is_string(landmark.surface)) {
      return refuse("landmarks", i, "its name or its place is out of range");
    }
    if (landmark.vertex != kNone && landmark.surface != StringId{}) {
      return refuse("landmarks", i, "it is at a vertex and on a surface, and can be one only");
    }
  }
  return unique_names("landmarks", program_.landmarks);
}

bool Checker::faces() {
  if (program_.faces.size() > 1) {
    return refuse("faces", 1, "a program is for one face at most");
  }
  for (std::size_t i = 0; i < program_.faces.size(); ++i) {
    const FaceReference& face = program_.faces[i];
    if (!is_string(face.name) || !is_string(face.surface) || !is_zero(face.zero)) {
      return refuse("faces", i, "it names a string that there is not, or its filling is not zero");
    }
    if (!is_enumerator(face.up) || !is_enumerator(face.forward) ||
        static_cast<int>(face.up) % 3 == static_cast<int>(face.forward) % 3) {
      return refuse("faces", i, "up and forward are not two of its axes");
    }
    if (!is_within(face.unit, 1e-6F, 1000.0F)) {
      return refuse("faces", i, fmt::format("its unit is {} m, not 1e-6 to 1000", face.unit));
    }
    if (!is_finite(face.origin) || !is_finite(face.low) || !is_finite(face.high)) {
      return refuse("faces", i, "its bounds are not finite numbers");
    }
  }
  return true;
}

bool Checker::face_parts() {
  for (std::size_t i = 0; i < program_.face_parts.size(); ++i) {
    const FacePart& part = program_.face_parts[i];
    if (!is_enumerator(part.kind) || !is_string(part.name) || !is_zero(part.zero)) {
      return refuse("face_parts", i, "its kind or its name is out of range");
    }
    if (part.last < part.first) {
      return refuse("face_parts", i, fmt::format("its vertices run from {} to {}", part.first, part.last));
    }
  }
  return true;
}

}  // namespace

std::optional<Failure> check_tables(const Program& program, std::string_view place) {
  return Checker(program, place).run();
}

std::string grouped(std::uint64_t number) {
  std::string digits = fmt::format("{}", number);
  for (std::size_t end = digits.size(); end > 3;) {
    end -= 3;
    digits.insert(end, 1, ',');
  }
  return digits;
}

}  // namespace nms::program
