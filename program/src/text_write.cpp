#include <algorithm>
#include <cstring>
#include <iterator>
#include <type_traits>

#include <fmt/format.h>

#include <nms/program/enum_names.h>
#include <nms/program/text.h>

#include "text_fields.h"
#include "text_words.h"

namespace nms::program {
namespace {

/// Minus zero is not the default: it has to be printed to come back.
bool is_default(float value) {
  std::uint32_t bits = 0;
  std::memcpy(&bits, &value, sizeof(bits));
  return bits == 0;
}

class Writer {
 public:
  explicit Writer(const Program& program) : program_(program) {}

  std::string write(const TextOptions& options) {
    if (options.rig && options.channels) {
      add("{}\n", kTextHead);  // a part of a program is not one
    }
    if (options.channels) {
      tracks();
      channels();
    }
    for (const Clip& clip : program_.clips) {
      this->clip(clip);
    }
    if (options.rig) {
      rig();
    }
    if (options.rig && options.channels) {
      inputs();
    }
    return std::move(text_);
  }

 private:
  template <typename... Args>
  void add(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(text_), format, std::forward<Args>(args)...);
  }

  void begin_section() {
    if (!text_.empty()) {
      text_ += '\n';
    }
  }

  void word(StringId id) {
    const std::string_view name = program_.string(id);
    if (!name.empty() && std::all_of(name.begin(), name.end(), is_bare)) {
      text_ += name;
      return;
    }
    text_ += '"';
    for (const char c : name) {
      if (c == '"' || c == '\\') {
        text_ += '\\';
        text_ += c;
      } else if (static_cast<unsigned char>(c) < 0x20U || c == 0x7F) {
        add("\\x{:02x}", static_cast<unsigned>(c));
      } else {
        text_ += c;
      }
    }
    text_ += '"';
  }

  void time(std::int64_t time_ns) {
    const bool is_negative = time_ns < 0;
    const auto magnitude =
        is_negative ? ~static_cast<std::uint64_t>(time_ns) + 1U : static_cast<std::uint64_t>(time_ns);
    add("{}{}", is_negative ? "-" : "", magnitude / 1'000'000'000U);
    if (const std::uint64_t rest = magnitude % 1'000'000'000U; rest != 0) {
      std::string digits = fmt::format("{:09}", rest);
      digits.erase(digits.find_last_not_of('0') + 1);
      add(".{}", digits);
    }
    text_ += 's';
  }

  // One of these for each type of field; nothing is printed for a default.
  void field(std::string_view name, StringId id) {
    if (id != StringId{}) {
      add(" {} ", name);
      word(id);
    }
  }
  void field(std::string_view name, float value) {
    if (!is_default(value)) {
      add(" {} {}", name, value);
    }
  }
  void field(std::string_view name, const float (&value)[3]) {
    if (!std::all_of(value, value + 3, is_default)) {
      add(" {} {} {} {}", name, value[0], value[1], value[2]);
    }
  }
  void field(std::string_view name, std::uint16_t value) {
    if (value != 0) {
      add(" {} {}", name, value);
    }
  }
  template <typename Enum, typename = std::enable_if_t<std::is_enum_v<Enum>>>
  void field(std::string_view name, Enum value) {
    if (value != Enum{}) {
      add(" {} {}", name, enum_name(value));
    }
  }

  void tracks() {
    if (program_.tracks.empty()) {
      return;
    }
    begin_section();
    add("tracks\n");
    for (const Track& track : program_.tracks) {
      add("  ");
      word(track.name);
      add(" {}\n", enum_name(track.merge));
    }
  }

  void channels() {
    if (program_.channels.empty()) {
      return;
    }
    begin_section();
    add("channels\n");
    for (const Channel& channel : program_.channels) {
      add("  ");
      word(channel.name);
      add(" {}", enum_name(channel.kind));
      visit_channel_fields(channel, [&](std::string_view name, const auto& value) { field(name, value); });
      if (channel.track != kNone) {
        field("track", program_.tracks[channel.track].name);
      }
      add("\n");
    }
  }

  void clip(const Clip& clip) {
    begin_section();
    add("clip ");
    word(clip.name);
    add(" {} ", enum_name(clip.kind));
    time(clip.start_ns);
    add("..");
    time(clip.end_ns);
    add(" hash {:016x}\n", clip.content_hash);
    for (const Marker& marker : program_.markers.subspan(clip.first_marker, clip.marker_count)) {
      add("  marker ");
      time(marker.time_ns);
      add(" {} ", enum_name(marker.kind));
      word(marker.name);
      if (marker.hand != Hand::signing) add(" {}", enum_name(marker.hand));
      add("\n");
    }
    for (const Curve& curve : program_.curves.subspan(clip.first_curve, clip.curve_count)) {
      add("  curve ");
      word(program_.channels[static_cast<std::size_t>(curve.channel)].name);
      add("\n");
      for (std::uint32_t k = 0; k < curve.knot_count; ++k) {
        knot(curve, curve.first_knot + k);
      }
    }
  }

  void knot(const Curve& curve, std::uint32_t index) {
    const Knot& knot = program_.knots[index];
    add("    ");
    time(knot.time_ns());
    add(" {} ", knot.value);
    if (knot.shape == kShapeSmooth) {
      add("smooth");
    } else if (knot.shape == kShapeLinear) {
      add("linear");
    } else if (knot.shape == kShapeHold) {
      add("hold");
    } else {
      const Handles& handles = program_.handles_of(curve, knot);
      add("cubic({}, {})", handles.b1, handles.b2);
    }
    const std::uint32_t source_index = program_.knot_sources.empty() ? kNone : program_.knot_sources[index];
    if (source_index != kNone) {
      const Source& source = program_.sources[source_index];
      add("  ; ");
      word(source.file);
      add(":{}:{}", source.line, source.column);
      if (source.entry != StringId{}) {
        add(" ");
        word(source.entry);
      }
    }
    add("\n");
  }

  void rig() {
    for (const FaceReference& face : program_.faces) {
      begin_section();
      add("face ");
      word(face.name);
      field("surface", face.surface);
      if (face.unit != 1.0F) add(" unit {}", face.unit);
      if (face.up != Axis::y) add(" up {}", enum_name(face.up));
      if (face.forward != Axis::z) add(" forward {}", enum_name(face.forward));
      field("origin", face.origin);
      field("low", face.low);
      field("high", face.high);
      add("\n");
    }
    if (!program_.face_parts.empty()) {
      begin_section();
      add("face_parts\n");
    }
    for (const FacePart& part : program_.face_parts) {
      add("  {}", enum_name(part.kind));
      field("name", part.name);
      if (part.first != 0 || part.last != kNone) add(" vertices {} {}", part.first, part.last);
      add("\n");
    }
    if (!program_.landmarks.empty()) {
      begin_section();
      add("landmarks\n");
    }
    for (const Landmark& landmark : program_.landmarks) {
      add("  ");
      word(landmark.name);
      if (landmark.vertex != kNone) {
        add(" vertex {}\n", landmark.vertex);
        continue;
      }
      field("on", landmark.surface);
      add(" {} {} {}\n", landmark.position[0], landmark.position[1], landmark.position[2]);
    }
    for (const Muscle& muscle : program_.muscles) {
      begin_section();
      add("muscle ");
      word(muscle.name);
      add(" {}\n", enum_name(muscle.kind));
      visit_fields(muscle, [&](std::string_view name, const auto& value) {
        const std::size_t before = text_.size();
        field(name, value);
        if (text_.size() != before) {
          text_.insert(before, 1, ' ');
          text_ += '\n';
        }
      });
    }
    if (!program_.actuations.empty()) {
      begin_section();
      add("actuations\n");
    }
    for (const Actuation& actuation : program_.actuations) {
      add("  ");
      word(program_.channels[static_cast<std::size_t>(actuation.channel)].name);
      add(" ");
      word(program_.muscles[static_cast<std::size_t>(actuation.muscle)].name);
      add(" {}\n", actuation.share);
    }
  }

  void inputs() {
    if (program_.inputs.empty()) {
      return;
    }
    begin_section();
    add("inputs\n");
    for (const Input& input : program_.inputs) {
      add("  ");
      word(input.name);
      field("from", input.from);
      field("path", input.path);
      add(" hash {:016x}\n", input.hash);
    }
  }

  const Program& program_;
  std::string text_;
};

}  // namespace

std::string to_text(const Program& program, const TextOptions& options) { return Writer(program).write(options); }

}  // namespace nms::program
