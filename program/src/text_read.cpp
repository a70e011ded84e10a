#include <charconv>
#include <map>
#include <optional>
#include <tuple>
#include <type_traits>
#include <unordered_map>
#include <utility>

#include <fast_float/fast_float.h>
#include <fmt/format.h>

#include <nms/program/curve_shapes.h>
#include <nms/program/enum_names.h>
#include <nms/program/text.h>

#include "text_fields.h"
#include "text_words.h"

namespace nms::program {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// All of `digits`, and nothing else, as an unsigned number.
template <typename Unsigned>
std::optional<Unsigned> to_unsigned(std::string_view digits, int base = 10) {
  Unsigned value = 0;
  const char* end = digits.data() + digits.size();
  const auto result = std::from_chars(digits.data(), end, value, base);
  if (digits.empty() || result.ec != std::errc() || result.ptr != end) {
    return std::nullopt;
  }
  return value;
}

std::optional<float> to_float(std::string_view word) {
  const std::size_t sign = !word.empty() && word[0] == '-' ? 1 : 0;
  if (word.size() <= sign || !is_digit(word[sign])) {
    return std::nullopt;  // neither "inf" nor "nan"
  }
  float value = 0.0F;
  const char* end = word.data() + word.size();
  const auto result = fast_float::from_chars(word.data(), end, value);
  if (result.ec != std::errc() || result.ptr != end) {
    return std::nullopt;
  }
  return value;
}

/// "-0.234s" or "-234000000ns", exactly.
std::optional<std::int64_t> to_time(std::string_view word) {
  const bool is_negative = !word.empty() && word[0] == '-';
  word.remove_prefix(is_negative ? 1 : 0);
  std::uint64_t magnitude = 0;
  if (word.size() > 2 && word.substr(word.size() - 2) == "ns") {
    const auto count = to_unsigned<std::uint64_t>(word.substr(0, word.size() - 2));
    if (!count || *count > std::uint64_t{9'000'000'000'000'000'000U}) {
      return std::nullopt;
    }
    magnitude = *count;
  } else {
    if (word.size() < 2 || word.back() != 's') {
      return std::nullopt;
    }
    word.remove_suffix(1);
    const std::size_t point = word.find('.');
    const auto seconds = to_unsigned<std::uint64_t>(word.substr(0, point));
    if (!seconds || *seconds > 9'000'000'000U) {
      return std::nullopt;
    }
    magnitude = *seconds * 1'000'000'000U;
    if (point != std::string_view::npos) {
      const std::string_view digits = word.substr(point + 1);
      const auto fraction = to_unsigned<std::uint64_t>(digits);
      if (!fraction || digits.size() > 9) {
        return std::nullopt;
      }
      std::uint64_t rest = *fraction;
      for (std::size_t i = digits.size(); i < 9; ++i) {
        rest *= 10U;
      }
      magnitude += rest;
    }
  }
  const auto time_ns = static_cast<std::int64_t>(magnitude);
  return is_negative ? -time_ns : time_ns;
}

/// What is left of one line.
class Line {
 public:
  explicit Line(std::string_view rest) : rest_(rest) {}

  [[nodiscard]] bool at_end() {
    blanks();
    return rest_.empty() || rest_.front() == ';';
  }

  bool take(char c) {
    blanks();
    if (rest_.empty() || rest_.front() != c) {
      return false;
    }
    rest_.remove_prefix(1);
    return true;
  }

  /// A bare word, or an empty one if the line does not go on with one.
  std::string_view bare() {
    blanks();
    std::size_t size = 0;
    while (size < rest_.size() && is_bare(rest_[size])) {
      ++size;
    }
    const std::string_view word = rest_.substr(0, size);
    rest_.remove_prefix(size);
    return word;
  }

  /// A bare or a quoted name.
  std::optional<std::string> name() {
    if (!take('"')) {
      const std::string_view word = bare();
      return word.empty() ? std::nullopt : std::optional<std::string>(word);
    }
    std::string name;
    while (!rest_.empty()) {
      const char c = rest_.front();
      rest_.remove_prefix(1);
      if (c == '"') {
        return name;
      }
      if (c != '\\') {
        name += c;
        continue;
      }
      if (rest_.empty()) {
        break;
      }
      const char escaped = rest_.front();
      rest_.remove_prefix(1);
      if (escaped == '"' || escaped == '\\') {
        name += escaped;
        continue;
      }
      const auto code = escaped == 'x' && rest_.size() >= 2 ? to_unsigned<std::uint8_t>(rest_.substr(0, 2), 16)
                                                            : std::optional<std::uint8_t>();
      if (!code) {
        break;
      }
      name += static_cast<char>(*code);
      rest_.remove_prefix(2);
    }
    return std::nullopt;
  }

 private:
  void blanks() {
    while (!rest_.empty() && (rest_.front() == ' ' || rest_.front() == '\t')) {
      rest_.remove_prefix(1);
    }
  }

  std::string_view rest_;
};

/// Reads line by line; each function returns false once `expected_` says what should have stood there.
class Reader {
 public:
  tl::expected<Draft, Failure> read(std::string_view text, std::string_view name) {
    std::size_t number = 0;
    bool has_head = false;
    while (!text.empty()) {
      ++number;
      const std::size_t end = text.find('\n');
      std::string_view line = text.substr(0, end);
      text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
      if (!line.empty() && line.back() == '\r') {
        line.remove_suffix(1);
      }
      bool is_good = true;
      if (!has_head) {
        has_head = is_good = line == kTextHead || want("\"nms program 1\": a text without it is a part of a program");
      } else {
        is_good = this->line(line);
      }
      if (!is_good) {
        return tl::make_unexpected(Failure{"invalid_program_text", fmt::format("{}:{}", name, number),
                                           fmt::format("expected {}", expected_),
                                           "give it as `nmsc dump` prints it, or mend that line"});
      }
    }
    if (!has_head) {
      return tl::make_unexpected(Failure{"invalid_program_text", fmt::format("{}:1", name), "the text is empty",
                                         "give it as `nmsc dump` prints it"});
    }
    if (!has_source_) {
      draft_.knot_sources.clear();
    }
    return std::move(draft_);
  }

 private:
  enum class Section { none, tracks, channels, clip, muscle, actuations, landmarks, face_parts, inputs };
  using Names = std::unordered_map<std::string, std::uint32_t>;

  bool want(std::string_view what) {
    expected_ = what;
    return false;
  }

  StringId intern(std::string&& string) {
    const auto [at, is_new] =
        strings_.try_emplace(std::move(string), static_cast<std::uint32_t>(draft_.strings.size()));
    if (is_new) {
      draft_.strings.push_back(at->first);
    }
    return StringId{at->second};
  }

  bool name(Line& line, StringId& id) {
    std::optional<std::string> name = line.name();
    if (!name) {
      return want("a name, bare or in quotes");
    }
    id = intern(std::move(*name));
    return true;
  }

  /// A name that nothing else of its kind has, which will be number `index`.
  bool new_name(Line& line, StringId& id, Names& names, std::size_t index) {
    std::optional<std::string> name = line.name();
    if (!name) {
      return want("a name, bare or in quotes");
    }
    if (!names.try_emplace(*name, static_cast<std::uint32_t>(index)).second) {
      return want("another name: this one was given before");
    }
    id = intern(std::move(*name));
    return true;
  }

  bool known_name(Line& line, const Names& names, std::string_view what, std::uint32_t& index) {
    const std::optional<std::string> name = line.name();
    const auto at = name ? names.find(*name) : names.end();
    if (at == names.end()) {
      return want(what);
    }
    index = at->second;
    return true;
  }

  bool number(Line& line, float& value) {
    const std::optional<float> number = to_float(line.bare());
    if (!number) {
      return want("a number");
    }
    value = *number;
    return true;
  }

  bool time(Line& line, std::int64_t& time_ns) {
    const std::optional<std::int64_t> time = to_time(line.bare());
    if (!time) {
      return want("a time in s, to the nanosecond at most, or in whole ns");
    }
    time_ns = *time;
    return true;
  }

  template <typename Enum>
  bool enumerator(Line& line, Enum& value) {
    const std::optional<Enum> found = enum_from<Enum>(line.bare());
    if (!found) {
      return want(fmt::format("one of {}", fmt::join(EnumNames<Enum>::kNames, ", ")));
    }
    value = *found;
    return true;
  }

  bool hash(Line& line, std::uint64_t& value) {
    const bool has_word = line.bare() == "hash";
    const std::string_view digits = line.bare();
    const auto number = to_unsigned<std::uint64_t>(digits, 16);
    if (!has_word || !number || digits.size() != 16) {
      return want("\"hash\" and 16 hexadecimal digits");
    }
    value = *number;
    return true;
  }

  bool end(Line& line) { return line.at_end() || want("the end of the line"); }

  bool index(Line& line, std::uint32_t& value) {
    const auto number = to_unsigned<std::uint32_t>(line.bare());
    if (!number) {
      return want("a whole number");
    }
    value = *number;
    return true;
  }

  bool field(Line& line, StringId& id) { return name(line, id); }
  bool field(Line& line, float& value) { return number(line, value); }
  bool field(Line& line, float (&value)[3]) {
    return number(line, value[0]) && number(line, value[1]) && number(line, value[2]);
  }
  bool field(Line& line, std::uint16_t& value) {
    const auto number = to_unsigned<std::uint16_t>(line.bare());
    if (!number) {
      return want("a whole number");
    }
    value = *number;
    return true;
  }
  template <typename Enum, typename = std::enable_if_t<std::is_enum_v<Enum>>>
  bool field(Line& line, Enum& value) {
    return enumerator(line, value);
  }

  bool line(std::string_view text) {
    Line line(text);
    if (line.at_end()) {
      return true;
    }
    if (text.front() != ' ' && text.front() != '\t') {
      return head(line);
    }
    switch (section_) {
      case Section::none:
        return want("the head of a section at the margin");
      case Section::tracks:
        return track(line);
      case Section::channels:
        return channel(line);
      case Section::clip:
        return clip_line(line);
      case Section::muscle:
        return muscle_field(line);
      case Section::actuations:
        return actuation(line);
      case Section::landmarks:
        return landmark(line);
      case Section::face_parts:
        return face_part(line);
      case Section::inputs:
        return input(line);
    }
    return false;
  }

  bool head(Line& line) {
    const std::string_view word = line.bare();
    if (word == "tracks") {
      section_ = Section::tracks;
      return end(line);
    }
    if (word == "channels") {
      section_ = Section::channels;
      return end(line);
    }
    if (word == "actuations") {
      section_ = Section::actuations;
      return end(line);
    }
    if (word == "landmarks") {
      section_ = Section::landmarks;
      return end(line);
    }
    if (word == "face_parts") {
      section_ = Section::face_parts;
      return end(line);
    }
    if (word == "inputs") {
      section_ = Section::inputs;
      return end(line);
    }
    if (word == "clip") {
      section_ = Section::clip;
      return clip(line);
    }
    if (word == "muscle") {
      section_ = Section::muscle;
      Muscle& muscle = draft_.muscles.emplace_back();
      return new_name(line, muscle.name, muscles_, draft_.muscles.size() - 1) && enumerator(line, muscle.kind) &&
             end(line);
    }
    if (word == "face") {
      section_ = Section::none;
      FaceReference& face = draft_.faces.emplace_back();
      if (!name(line, face.name)) {
        return false;
      }
      return face_fields(line, face);
    }
    return want("tracks, channels, clip, face, face_parts, landmarks, muscle, actuations or inputs");
  }

  bool face_fields(Line& line, FaceReference& face) {
    while (!line.at_end()) {
      const std::string_view key = line.bare();
      bool is_good = false;
      if (key == "surface") {
        is_good = field(line, face.surface);
      } else if (key == "unit") {
        is_good = field(line, face.unit);
      } else if (key == "up") {
        is_good = field(line, face.up);
      } else if (key == "forward") {
        is_good = field(line, face.forward);
      } else if (key == "origin") {
        is_good = field(line, face.origin);
      } else if (key == "low") {
        is_good = field(line, face.low);
      } else if (key == "high") {
        is_good = field(line, face.high);
      } else {
        return want("surface, unit, up, forward, origin, low or high");
      }
      if (!is_good) {
        return false;
      }
    }
    return true;
  }

  bool face_part(Line& line) {
    FacePart& part = draft_.face_parts.emplace_back();
    if (!enumerator(line, part.kind)) {
      return false;
    }
    while (!line.at_end()) {
      const std::string_view key = line.bare();
      if (key == "name") {
        if (!name(line, part.name)) {
          return false;
        }
      } else if (key == "vertices") {
        if (!index(line, part.first) || !index(line, part.last)) {
          return false;
        }
      } else {
        return want("name or vertices");
      }
    }
    return true;
  }

  bool track(Line& line) {
    Track& track = draft_.tracks.emplace_back();
    return new_name(line, track.name, tracks_, draft_.tracks.size() - 1) && enumerator(line, track.merge) && end(line);
  }

  bool channel(Line& line) {
    Channel& channel = draft_.channels.emplace_back();
    if (!new_name(line, channel.name, channels_, draft_.channels.size() - 1) || !enumerator(line, channel.kind)) {
      return false;
    }
    while (!line.at_end()) {
      const std::string_view key = line.bare();
      bool is_known = key == "track";
      bool is_good = is_known && known_name(line, tracks_, "a track named before", channel.track);
      visit_channel_fields(channel, [&](std::string_view field_name, auto& value) {
        if (field_name == key) {
          is_known = true;
          is_good = field(line, value);
        }
      });
      if (!is_known) {
        return want("a field of a channel");
      }
      if (!is_good) {
        return false;
      }
    }
    return true;
  }

  bool clip(Line& line) {
    Clip& clip = draft_.clips.emplace_back();
    clip.first_curve = static_cast<std::uint32_t>(draft_.curves.size());
    clip.first_marker = static_cast<std::uint32_t>(draft_.markers.size());
    has_curve_ = false;
    if (!name(line, clip.name) || !enumerator(line, clip.kind)) {
      return false;
    }
    const std::string_view span = line.bare();
    const std::size_t dots = span.find("..");
    const auto start = to_time(span.substr(0, dots));
    const auto end_time = dots == std::string_view::npos ? std::nullopt : to_time(span.substr(dots + 2));
    if (!start || !end_time) {
      return want("the clip's start and end as 0s..1.5s");
    }
    clip.start_ns = *start;
    clip.end_ns = *end_time;
    return hash(line, clip.content_hash) && end(line);
  }

  bool clip_line(Line& line) {
    Line rest = line;
    const std::string_view word = rest.bare();
    Clip& clip = draft_.clips.back();
    if (word == "marker") {
      Marker& marker = draft_.markers.emplace_back();
      ++clip.marker_count;
      return time(rest, marker.time_ns) && enumerator(rest, marker.kind) && name(rest, marker.name) &&
             (rest.at_end() || enumerator(rest, marker.hand)) && end(rest);
    }
    if (word == "curve") {
      Curve& curve = draft_.curves.emplace_back();
      ++clip.curve_count;
      has_curve_ = true;
      curve.first_knot = static_cast<std::uint32_t>(draft_.knots.size());
      curve.first_handle = static_cast<std::uint32_t>(draft_.handles.size());
      shapes_.clear();
      std::uint32_t channel = 0;
      if (!known_name(rest, channels_, "a channel named before", channel)) {
        return false;
      }
      curve.channel = ChannelId{channel};
      return end(rest);
    }
    return has_curve_ ? knot(line) : want("a marker or a curve");
  }

  bool knot(Line& line) {
    Knot& knot = draft_.knots.emplace_back();
    std::uint32_t& source = draft_.knot_sources.emplace_back(kNone);
    ++draft_.curves.back().knot_count;
    std::int64_t time_ns = 0;
    if (!time(line, time_ns) || !number(line, knot.value)) {
      return false;
    }
    if (time_ns < -kTimeLimit_ns || time_ns > kTimeLimit_ns) {
      return want("a time within 100000s of 0s");
    }
    knot = Knot(time_ns, knot.value, kShapeHold);
    const std::string_view shape = line.bare();
    if (shape == "smooth") {
      knot.shape = kShapeSmooth;
    } else if (shape == "linear") {
      knot.shape = kShapeLinear;
    } else if (shape == "hold") {
      knot.shape = kShapeHold;
    } else if (shape == "cubic") {
      if (!cubic(line, knot.shape)) {
        return false;
      }
    } else {
      return want("smooth, linear, hold or cubic(0.2, 0.4)");
    }
    return line.take(';') ? this->source(line, source) : end(line);
  }

  bool cubic(Line& line, std::uint16_t& shape) {
    Handles handles;
    if (!(line.take('(') && number(line, handles.b1) && line.take(',') && number(line, handles.b2) && line.take(')'))) {
      return want("two inner values as cubic(0.2, 0.4)");
    }
    const std::optional<std::uint16_t> found = shapes_.shape(handles, draft_.handles);
    if (!found) {
      return want("no more different cubics in one curve");
    }
    shape = *found;
    return true;
  }

  bool source(Line& line, std::uint32_t& index) {
    Source source;
    if (!name(line, source.file)) {
      return false;
    }
    for (std::uint32_t* part : {&source.line, &source.column}) {
      const auto number = line.take(':') ? to_unsigned<std::uint32_t>(line.bare()) : std::optional<std::uint32_t>();
      if (!number) {
        return want("the source of a knot as file.nms:12:3");
      }
      *part = *number;
    }
    if (!line.at_end() && !name(line, source.entry)) {
      return false;
    }
    const auto key = std::make_tuple(static_cast<std::uint32_t>(source.file), source.line, source.column,
                                     static_cast<std::uint32_t>(source.entry));
    const auto [at, is_new] = sources_.try_emplace(key, static_cast<std::uint32_t>(draft_.sources.size()));
    if (is_new) {
      draft_.sources.push_back(source);
    }
    index = at->second;
    has_source_ = true;
    return end(line);
  }

  bool muscle_field(Line& line) {
    const std::string_view key = line.bare();
    bool is_known = false;
    bool is_good = false;
    visit_fields(draft_.muscles.back(), [&](std::string_view field_name, auto& value) {
      if (field_name == key) {
        is_known = true;
        is_good = field(line, value);
      }
    });
    if (!is_known) {
      return want("a field of a muscle");
    }
    return is_good && end(line);
  }

  bool actuation(Line& line) {
    Actuation& actuation = draft_.actuations.emplace_back();
    std::uint32_t channel = 0;
    std::uint32_t muscle = 0;
    if (!known_name(line, channels_, "a channel named before", channel) ||
        !known_name(line, muscles_, "a muscle named before", muscle)) {
      return false;
    }
    actuation.channel = ChannelId{channel};
    actuation.muscle = MuscleId{muscle};
    return number(line, actuation.share) && end(line);
  }

  bool landmark(Line& line) {
    Landmark& landmark = draft_.landmarks.emplace_back();
    if (!new_name(line, landmark.name, landmarks_, draft_.landmarks.size() - 1)) {
      return false;
    }
    Line rest = line;
    const std::string_view where = rest.bare();
    if (where == "vertex") {
      line = rest;
      return index(line, landmark.vertex) && end(line);
    }
    if (where == "on") {
      line = rest;
      if (!name(line, landmark.surface)) {
        return false;
      }
    }
    return field(line, landmark.position) && end(line);
  }

  bool input(Line& line) {
    Input& input = draft_.inputs.emplace_back();
    if (!name(line, input.name)) {
      return false;
    }
    Line rest = line;
    if (rest.bare() == "from") {
      line = rest;
      if (!name(line, input.from)) {
        return false;
      }
    }
    if (line.bare() != "path") {
      return want("\"path\" and a path");
    }
    return name(line, input.path) && hash(line, input.hash) && end(line);
  }

  Draft draft_;
  CurveShapes shapes_;  ///< of the curve being read
  Section section_ = Section::none;
  bool has_curve_ = false;   ///< the clip being read has one, so knots can stand
  bool has_source_ = false;  ///< any knot has one
  std::string expected_;
  std::unordered_map<std::string, std::uint32_t> strings_{{std::string(), 0}};
  std::map<std::tuple<std::uint32_t, std::uint32_t, std::uint32_t, std::uint32_t>, std::uint32_t> sources_;
  Names tracks_;
  Names channels_;
  Names muscles_;
  Names landmarks_;
};

}  // namespace

tl::expected<Draft, Failure> from_text(std::string_view text, std::string_view name) {
  return Reader().read(text, name);
}

}  // namespace nms::program
