// What a face lacks, and what that costs it.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <nms/lang/diagnostic.h>
#include <nms/program/enum_names.h>
#include <nms/runtime/face_file.h>
#include <nms/runtime/landmark_set.h>
#include <nms/runtime/rig.h>

#include "commands.h"
#include "loading.h"
#include "report.h"

namespace nms::cli {
namespace {

/// A landmark on the skin stands no further from it, times the face's size. Muscles' ends may lie in the flesh.
constexpr double kOffSkin_m = 0.008;

/// What an action unit loses.
struct UnitLoss {
  std::string unit;
  bool whole = false;  ///< nothing of it is left
  std::vector<std::string> muscles;
};

/// One thing that is not there.
struct Lack {
  std::string name;  ///< "mouth_corner_L", or a part: "tongue"
  std::string where;
  std::vector<std::string> muscles;  ///< that do nothing
  std::vector<UnitLoss> units;
};

struct Doubt {
  std::string landmark;
  std::string cause;
};

struct Findings {
  std::string face;
  std::size_t known = 0;  ///< landmarks of the set that the face has
  std::size_t all = 0;
  std::size_t shown = 0;  ///< channels
  std::size_t channels = 0;
  std::vector<Lack> landmarks;
  std::vector<Lack> parts;
  std::vector<Doubt> doubts;
};

std::string base_of(std::string_view name) {
  for (const std::string_view tail : {"_L", "_R", "_left", "_right"})
    if (name.ends_with(tail)) return std::string(name.substr(0, name.size() - tail.size()));
  return std::string(name);
}

char side_of(std::string_view name) {
  if (name.ends_with("_L") || name.ends_with("_left")) return 'L';
  return name.ends_with("_R") || name.ends_with("_right") ? 'R' : ' ';
}

bool same_side(char a, char b) { return a == ' ' || b == ' ' || a == b; }

/// Whether a region that the face does not have needs this landmark.
bool region_needs(const runtime::Face& face, std::string_view region, char side, const std::string& landmark) {
  if (region.empty() || !same_side(side, side_of(landmark))) return false;
  const char* tail = side == 'L' ? "_left" : side == 'R' ? "_right" : "";
  if (face.regions.contains(std::string(region) + tail) || face.regions.contains(std::string(region))) return false;
  for (const runtime::RegionNeeds& needs : runtime::region_needs())
    if (needs.region == region)
      return std::find(needs.landmarks.begin(), needs.landmarks.end(), base_of(landmark)) != needs.landmarks.end();
  return false;
}

/// Whether a muscle stands at this landmark, or is held to a region that needs it.
bool needs(const runtime::Face& face, const program::Program& program, const program::Muscle& muscle,
           const std::string& landmark) {
  const char side = muscle.side == program::Side::left ? 'L' : muscle.side == program::Side::right ? 'R' : ' ';
  for (const program::StringId place : {muscle.attachment, muscle.insertion})
    if (program.string(place) == base_of(landmark) && same_side(side, side_of(landmark))) return true;
  return region_needs(face, program.string(muscle.region), side, landmark) ||
         region_needs(face, program.string(muscle.except), side, landmark) ||
         (muscle.kind == program::MuscleKind::eyelid && region_needs(face, "lids", side, landmark));
}

/// Whether a gap is there because this landmark is missing, perhaps among others.
bool costs(const runtime::Face& face, const program::Program& program, const std::string& landmark,
           const runtime::RigGap& gap) {
  if (gap.muscle != program::kNone) return needs(face, program, program.muscles[gap.muscle], landmark);
  return base_of(gap.name) == base_of(landmark);
}

/// What each action unit loses with these muscles.
std::vector<UnitLoss> losses(const program::Program& program, const std::set<std::uint32_t>& lost) {
  std::map<std::uint32_t, UnitLoss> by_channel;
  std::map<std::uint32_t, bool> any_left;
  for (const program::Actuation& a : program.actuations) {
    const auto channel = static_cast<std::uint32_t>(a.channel);
    if (!lost.contains(static_cast<std::uint32_t>(a.muscle))) {
      any_left[channel] = true;
      continue;
    }
    UnitLoss& loss = by_channel[channel];
    loss.unit = program.string(program.channels[channel].name);
    loss.muscles.emplace_back(program.string(program.muscles[static_cast<std::uint32_t>(a.muscle)].name));
  }
  std::vector<UnitLoss> result;
  for (auto& [channel, loss] : by_channel) {
    loss.whole = !any_left[channel];
    result.push_back(std::move(loss));
  }
  return result;
}

Lack lack_of(const runtime::Face& face, const program::Program& program, const std::string& name,
             std::string_view where, const std::vector<runtime::RigGap>& gaps) {
  Lack lack{name, std::string(where), {}, {}};
  std::set<std::uint32_t> lost;
  for (const runtime::RigGap& gap : gaps) {
    if (!costs(face, program, name, gap)) continue;
    if (gap.muscle == program::kNone) {
      lack.units.push_back({std::string(program.string(program.channels[gap.channel].name)), true, {}});
    } else if (lost.insert(gap.muscle).second) {
      lack.muscles.emplace_back(program.string(program.muscles[gap.muscle].name));
    }
  }
  for (UnitLoss& loss : losses(program, lost)) lack.units.push_back(std::move(loss));
  return lack;
}

bool has_part(const runtime::Face& face, runtime::Frame frame, std::string_view name) {
  return std::any_of(face.rigid.begin(), face.rigid.end(), [&](const runtime::RigidMesh& m) {
    return m.frame == frame && (name.empty() || m.name.starts_with(name));
  });
}

/// Parts that are not there: no muscle of the skin needs them, but what is not there shows nothing.
std::vector<Lack> missing_parts(const runtime::Face& face, const program::Program& program) {
  std::vector<Lack> lacks;
  const auto add = [&](const char* name, const char* where) { lacks.push_back({name, where, {}, {}}); };
  if (!has_part(face, runtime::Frame::eye_left, "")) add("eye_left", "no eyeball turns; lids have no ball to lie on");
  if (!has_part(face, runtime::Frame::eye_right, "")) add("eye_right", "no eyeball turns; lids have no ball to lie on");
  if (!has_part(face, runtime::Frame::head, "teeth"))
    add("teeth_upper", "lips may sink in where teeth should hold them");
  if (!has_part(face, runtime::Frame::jaw, "teeth"))
    add("teeth_lower", "lips may sink in where teeth should hold them");
  if (!has_part(face, runtime::Frame::jaw, "tongue")) {
    add("tongue", "nothing shows what the tongue does");
    std::set<std::uint32_t> lost;
    for (std::uint32_t m = 0; m < program.muscles.size(); ++m)
      if (program.string(program.muscles[m].region) == "tongue") lost.insert(m);
    for (const std::uint32_t m : lost) lacks.back().muscles.emplace_back(program.string(program.muscles[m].name));
    lacks.back().units = losses(program, lost);
  }
  return lacks;
}

/// Places of every face from above down, by twos: each chain's next stands lower. Those of a side on both.
constexpr const char* kDownwards[][2] = {{"forehead_mid", "glabella"},
                                         {"glabella", "nasion"},
                                         {"nasion", "nose_tip"},
                                         {"nose_tip", "lip_upper_mid"},
                                         {"subnasale", "lip_upper_mid"},
                                         {"lip_upper_mid", "stomion"},
                                         {"stomion", "lip_lower_mid"},
                                         {"lip_lower_mid", "mentolabial"},
                                         {"mentolabial", "pogonion"},
                                         {"pogonion", "menton"},
                                         {"brow_mid", "lid_upper_mid"},
                                         {"lid_upper_mid", "lid_lower_mid"},
                                         {"lid_lower_mid", "infraorbital"},
                                         {"infraorbital", "mouth_corner"},
                                         {"mouth_corner", "jaw_body"}};
/// And from the midline out.
constexpr const char* kOutwards[][2] = {{"brow_inner", "brow_mid"},
                                        {"brow_mid", "brow_outer"},
                                        {"eye_inner", "eye_outer"},
                                        {"lip_upper_lateral", "mouth_corner"},
                                        {"lip_lower_lateral", "mouth_corner"},
                                        {"mouth_corner", "jaw_hinge"}};

/// Left and right taken for one another: one doubt if most are.
void doubt_sides(const runtime::Landmarks& landmarks, std::vector<Doubt>& doubts) {
  std::vector<Doubt> wrong;
  std::size_t sided = 0;
  for (const auto& [name, p] : landmarks) {
    const char side = side_of(name);
    if (side == ' ') continue;
    ++sided;
    if (side == 'L' ? p.x >= 0.0 : p.x <= 0.0) continue;
    wrong.push_back(
        {name, fmt::format("it stands on the {}; the left is the subject's own, +x", side == 'L' ? "right" : "left")});
  }
  if (2 * wrong.size() > sided) {
    doubts.push_back({"left and right",
                      fmt::format("{} of {} landmarks stand on the other side; the left is the subject's own, and its "
                                  "vertex is given first",
                                  wrong.size(), sided)});
    return;
  }
  doubts.insert(doubts.end(), wrong.begin(), wrong.end());
}

/// Places that are not in the order in which every face has them.
void doubt_order(const runtime::Landmarks& landmarks, std::vector<Doubt>& doubts) {
  const auto each = [&](const auto& pairs, const auto& in_order, const char* how) {
    for (const auto& [first, second] : pairs) {
      for (const char* side : {"", "_L", "_R"}) {
        const auto a = landmarks.find(std::string(first) + side);
        const auto b = landmarks.find(std::string(second) + side);
        if (a == landmarks.end() || b == landmarks.end() || in_order(a->second, b->second)) continue;
        doubts.push_back({b->first, fmt::format("it stands {} {}", how, a->first)});
      }
    }
  };
  each(
      kDownwards, [](const glm::dvec3& a, const glm::dvec3& b) { return a.y > b.y; }, "above");
  each(
      kOutwards, [](const glm::dvec3& a, const glm::dvec3& b) { return std::abs(a.x) < std::abs(b.x); },
      "nearer to the midline than");
}

/// Names that no muscle asks for: slips, and sided places that are given as if there were one.
void doubt_names(const runtime::Landmarks& landmarks, const program::Program& program, std::vector<Doubt>& doubts) {
  std::set<std::string> asked;
  for (const program::Muscle& m : program.muscles)
    for (const program::StringId place : {m.attachment, m.insertion}) asked.emplace(program.string(place));
  std::map<std::string, bool> sided;
  std::vector<std::string> names;
  for (const runtime::LandmarkInfo& info : runtime::landmark_set()) {
    sided[std::string(info.name)] = info.sided;
    names.emplace_back(info.name);
  }
  std::set<std::string> doubted;
  const auto doubt = [&](const std::string& name, std::string cause) {
    if (doubted.insert(name).second) doubts.push_back({name, std::move(cause)});
  };
  for (const auto& [name, p] : landmarks) {
    const std::string base = base_of(name);
    const auto known = sided.find(base);
    if (known != sided.end() && known->second != (side_of(name) != ' ')) {
      doubt(base, known->second ? "it has two sides: landmark NAME sides, or NAME_L and NAME_R" : "it has no sides");
    } else if (known == sided.end() && !asked.contains(base)) {
      const auto close = lang::nearest(base, names);
      doubt(base, close.empty()
                      ? std::string("no muscle asks for a place of that name")
                      : fmt::format("no muscle asks for a place of that name; did you mean {}?", close.front()));
    }
  }
}

/// Places that are there and look wrong: off the skin, out of order, or on one side far from where the other says.
std::vector<Doubt> doubts_of(const runtime::Face& face, const program::Program& program,
                             const runtime::Landmarks& landmarks) {
  static const std::set<std::string> kInside = {"eye_centre", "head_pivot",        "torso_pivot", "jaw_hinge",
                                                "stomion",    "buccinator_origin", "neck_side",   "platysma_clavicle",
                                                "jaw_angle",  "masseter",          "nostril"};
  const runtime::FaceScale scale = runtime::face_scale(landmarks);
  std::vector<Doubt> doubts;
  doubt_names(landmarks, program, doubts);
  doubt_sides(landmarks, doubts);
  doubt_order(landmarks, doubts);
  for (const auto& [name, p] : landmarks) {
    const char side = side_of(name);
    if (side == 'L') {
      const auto other = landmarks.find(base_of(name) + "_R");
      if (other != landmarks.end()) {
        const glm::dvec3 d = p - glm::dvec3(-other->second.x, other->second.y, other->second.z);
        const double apart = std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z);
        if (apart > 2.0 * kOffSkin_m * scale.length)
          doubts.push_back({base_of(name), fmt::format("left and right differ by {:.0f} mm", apart * 1e3)});
      }
    } else if (side == ' ' && std::abs(p.x) > kOffSkin_m * scale.length) {
      doubts.push_back({name, fmt::format("it stands {:.0f} mm off the midline", std::abs(p.x) * 1e3)});
    }
    if (kInside.contains(base_of(name))) continue;
    double least = 1e9;
    for (const glm::dvec3& q : face.skin.points) {
      const glm::dvec3 d = p - q;
      least = std::min(least, d.x * d.x + d.y * d.y + d.z * d.z);
    }
    least = std::sqrt(least);
    if (least > kOffSkin_m * scale.length)
      doubts.push_back({name, fmt::format("it stands {:.0f} mm off the skin", least * 1e3)});
  }
  return doubts;
}

Findings look(const runtime::Face& face, const program::Program& program, const runtime::Rig& rig,
              const std::vector<runtime::RigGap>& gaps) {
  Findings found;
  found.face = program.faces.empty() ? std::string() : std::string(program.string(program.faces[0].name));
  const runtime::Landmarks landmarks = runtime::landmarks_of(face, program);
  for (const runtime::LandmarkInfo& info : runtime::landmark_set()) {
    for (const char* side : {"_L", "_R"}) {
      const std::string name = std::string(info.name) + (info.sided ? side : "");
      ++found.all;
      if (landmarks.contains(name))
        ++found.known;
      else
        found.landmarks.push_back(lack_of(face, program, name, info.where, gaps));
      if (!info.sided) break;
    }
  }
  // A place that only a face's own muscles ask for is in no list but theirs.
  for (const runtime::RigGap& gap : gaps) {
    const bool told = std::any_of(found.landmarks.begin(), found.landmarks.end(),
                                  [&](const Lack& l) { return costs(face, program, l.name, gap); });
    if (!told && !gap.is_region)
      found.landmarks.push_back(lack_of(face, program, gap.name, "a place that a muscle asks for", gaps));
  }
  found.parts = missing_parts(face, program);
  found.doubts = doubts_of(face, program, landmarks);
  found.channels = program.channels.size();
  for (std::uint32_t c = 0; c < program.channels.size(); ++c)
    found.shown += rig.actuated(program::ChannelId{c}) ? 1U : 0U;
  return found;
}

std::string text_of(const Lack& lack, bool is_landmark) {
  std::string out = fmt::format("missing {}: {}\n", lack.name, lack.where);
  if (!lack.muscles.empty()) out += fmt::format("  these do nothing: {}\n", fmt::join(lack.muscles, ", "));
  std::string whole;
  std::string partly;
  for (const UnitLoss& loss : lack.units) {
    std::string& list = loss.whole ? whole : partly;
    list += list.empty() ? "" : ", ";
    list += loss.unit;
    if (!loss.whole) list += fmt::format(" ({})", fmt::join(loss.muscles, ", "));
  }
  if (!whole.empty()) out += fmt::format("  not shown: {}\n", whole);
  if (!partly.empty()) out += fmt::format("  shown in part: {}\n", partly);
  if (is_landmark && lack.muscles.empty() && lack.units.empty()) out += "  no muscle needs it\n";
  return out;
}

std::string text_of(const Findings& found) {
  std::string out = fmt::format("{}: {} of {} landmarks; {} of {} channels can be shown\n", found.face, found.known,
                                found.all, found.shown, found.channels);
  for (const Lack& lack : found.landmarks) out += text_of(lack, true);
  for (const Lack& lack : found.parts) out += text_of(lack, false);
  for (const Doubt& doubt : found.doubts) out += fmt::format("look at {}: {}\n", doubt.landmark, doubt.cause);
  return out;
}

nlohmann::ordered_json json_of(const std::vector<Lack>& lacks) {
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  for (const Lack& lack : lacks) {
    nlohmann::ordered_json units = nlohmann::ordered_json::array();
    for (const UnitLoss& loss : lack.units)
      units.push_back({{"unit", loss.unit}, {"lost", loss.whole ? "all" : "part"}, {"muscles", loss.muscles}});
    out.push_back({{"name", lack.name}, {"where", lack.where}, {"muscles", lack.muscles}, {"units", units}});
  }
  return out;
}

std::string json_of(const Findings& found) {
  nlohmann::ordered_json doubts = nlohmann::ordered_json::array();
  for (const Doubt& d : found.doubts) doubts.push_back({{"landmark", d.landmark}, {"cause", d.cause}});
  const nlohmann::ordered_json out = {
      {"face", found.face},
      {"landmarks", {{"known", found.known}, {"all", found.all}}},
      {"channels", {{"shown", found.shown}, {"all", found.channels}}},
      {"missing_landmarks", json_of(found.landmarks)},
      {"missing_parts", json_of(found.parts)},
      {"doubts", doubts},
  };
  return out.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace

int face_check(const GlobalOptions& global, const std::string& name, bool json) {
  SourceFiles sources(global.stdlib);
  lang::Diagnostics diagnostics;
  if (const auto image = load_program(global, {}, name, sources, diagnostics)) {
    const program::Program& program = image->program();
    if (const auto face = load_face(program, name, sources, diagnostics)) {
      std::vector<runtime::RigGap> gaps;
      const auto rig = runtime::bind(*face, program, &gaps);
      if (rig) {
        const Findings found = look(*face, program, *rig, gaps);
        const std::string out = json ? json_of(found) : text_of(found);
        std::fwrite(out.data(), 1, out.size(), stdout);
      } else {
        add_failure(diagnostics, rig.error());
      }
    }
  }
  return finish(global, diagnostics);
}

}  // namespace nms::cli
