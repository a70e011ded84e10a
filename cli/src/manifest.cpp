#include "manifest.h"

#include <charconv>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <nms/program/enum_names.h>

#include "tiers.h"

namespace nms::cli {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kFormat = "nms lexicon assets";
constexpr int kVersion = 1;

/// Seconds that read back as the same nanoseconds.
double seconds(std::int64_t ns) { return static_cast<double>(ns) / 1e9; }

Json markers_of(const program::Program& program, const program::Clip& clip) {
  Json out = Json::array();
  for (std::uint32_t i = 0; i < clip.marker_count; ++i) {
    const program::Marker& m = program.markers[clip.first_marker + i];
    out.push_back({{"time_s", seconds(m.time_ns)},
                   {"kind", program::enum_name(m.kind)},
                   {"name", printable(program.string(m.name))}});
    if (m.hand != program::Hand::signing) out.back()["hand"] = program::enum_name(m.hand);
  }
  return out;
}

/// Strings of a source may hold anything; JSON holds UTF-8.
Json texts(const std::vector<std::string>& all) {
  Json out = Json::array();
  for (const std::string& one : all) out.push_back(printable(one));
  return out;
}

}  // namespace

std::vector<std::string> units_moved(const program::Program& program, const program::Clip& clip) {
  std::vector<std::string> out;
  for (std::uint32_t i = 0; i < clip.curve_count; ++i) {
    const program::Curve& curve = program.curves[clip.first_curve + i];
    const program::Channel& channel = program.channels[static_cast<std::size_t>(curve.channel)];
    bool up = false;
    bool down = false;
    for (std::uint32_t k = 0; k < curve.knot_count; ++k) {
      const float value = program.knots[curve.first_knot + k].value;
      up = up || value > 0.0F;
      down = down || value < 0.0F;
    }
    const bool axis = channel.kind == program::ChannelKind::axis;
    if (up) out.emplace_back(program.string(axis ? channel.positive : channel.name));
    if (down && axis) out.emplace_back(program.string(channel.negative));
  }
  return out;
}

std::string write_manifest(const compiler::LexiconRecord& lexicon, const compiler::FaceRecord& face_record,
                           const std::string& face, const program::Program& program, const std::vector<Asset>& assets) {
  Json entries = Json::array();
  for (const Asset& a : assets) {
    const compiler::EntryRecord& e = *a.entry;
    entries.push_back({{"name", e.name},
                       {"ids", texts(e.ids)},
                       {"function", e.function},
                       {"labels", texts(e.labels)},
                       {"aliases", texts(e.aliases)},
                       {"meaning", printable(e.meaning)},
                       {"spreads", e.spreads},
                       {"evidence", e.evidence},
                       {"sources", texts(e.sources)},
                       {"lexicon", e.lexicon},
                       {"declared", {{"file", e.file}, {"line", e.line}}},
                       {"file", a.file},
                       {"clip", std::string(program.string(a.clip->name))},
                       {"start_s", seconds(a.clip->start_ns)},
                       {"duration_s", seconds(a.clip->end_ns - a.clip->start_ns)},
                       {"markers", markers_of(program, *a.clip)},
                       {"action_units", units_moved(program, *a.clip)},
                       {"hash", fmt::format("{:016x}", a.hash)}});
  }
  const Json manifest{{"format", kFormat},
                      {"version", kVersion},
                      {"lexicon", lexicon.name},
                      {"title", printable(lexicon.title)},
                      {"extends", lexicon.extends},
                      {"face", face},
                      {"licence", {{"lexicon", printable(lexicon.licence)}, {"face", printable(face_record.licence)}}},
                      {"made_by", "nmsc " NMS_VERSION},
                      {"entries", std::move(entries)}};
  return manifest.dump(1) + "\n";
}

std::map<std::string, std::uint64_t> read_manifest_hashes(std::string_view text) {
  std::map<std::string, std::uint64_t> out;
  const Json manifest = Json::parse(text.begin(), text.end(), nullptr, false);
  if (!manifest.is_object() || manifest.value("format", Json()) != kFormat ||
      manifest.value("version", Json()) != kVersion || !manifest.contains("entries"))
    return out;
  for (const Json& e : manifest["entries"]) {
    const Json file = e.is_object() ? e.value("file", Json()) : Json();
    const Json hash = e.is_object() ? e.value("hash", Json()) : Json();
    if (!file.is_string() || !hash.is_string()) continue;
    const auto& digits = hash.get_ref<const std::string&>();
    std::uint64_t value = 0;
    const auto read = std::from_chars(digits.data(), digits.data() + digits.size(), value, 16);
    if (digits.size() == 16 && read.ptr == digits.data() + digits.size()) out[file.get<std::string>()] = value;
  }
  return out;
}

}  // namespace nms::cli
