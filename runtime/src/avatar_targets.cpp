#include "avatar_targets.h"

#include <algorithm>

#include <fmt/format.h>

namespace nms::runtime {
namespace {

struct Known {
  std::string_view name;   ///< plain; `#` stands for left or right, and for L or R in the units
  std::string_view units;  ///< "AU12# AU13#*0.5": strongest wins
};

/// ARKit's blend shapes (Apple, ARFaceAnchor.BlendShapeLocation), then the presets of VRM 1.0.
constexpr Known kKnown[] = {
    {"browdown#", "AU4#"},
    {"browinnerup", "AU1L AU1R"},
    {"browouterup#", "AU2#"},
    {"cheekpuff", "AU34L AU34R AU33L*0.7 AU33R*0.7"},
    {"cheeksquint#", "AU6#"},
    {"eyeblink#", "AU43# AU45# AU46# AU42#*0.8 AU41#*0.5"},
    {"eyelookdown#", "AU64"},
    {"eyelookup#", "AU63"},
    {"eyelookoutleft", "AU61"},
    {"eyelookinright", "AU61"},
    {"eyelookinleft", "AU62"},
    {"eyelookoutright", "AU62"},
    {"eyesquint#", "AU7# AU44# AU6#*0.3"},
    {"eyewide#", "AU5#"},
    {"jawforward", "AU29"},
    {"jawleft", "AU30L"},
    {"jawright", "AU30R"},
    {"jawopen", "AU27 AU26*0.7"},
    {"mouthdimple#", "AU14#"},
    {"mouthfrown#", "AU15#"},
    {"mouthfunnel", "AU22"},
    {"mouthlowerdown#", "AU16# AU25*0.4"},
    {"mouthpress#", "AU24 AU23*0.6"},
    {"mouthpucker", "AU18"},
    {"mouthrolllower", "AU28 AU32"},
    {"mouthrollupper", "AU28"},
    {"mouthshruglower", "AU17"},
    {"mouthshrugupper", "AU17*0.5"},
    {"mouthsmile#", "AU12# AU13#*0.8"},
    {"mouthstretch#", "AU20#"},
    {"mouthupperup#", "AU10# AU25*0.2"},
    {"nosesneer#", "AU9# AU11#*0.4"},
    {"tongueout", "AU19"},
    {"blink#", "AU43# AU45# AU46# AU42#*0.8 AU41#*0.5"},
    {"lookup", "AU63"},
    {"lookdown", "AU64"},
    {"lookleft", "AU61"},
    {"lookright", "AU62"},
    {"aa", "AU27 AU26*0.7"},
    {"ou", "AU18"},
    {"oh", "AU22"},
};

std::vector<UnitShare> read_units(std::string_view units, char side) {
  std::vector<UnitShare> out;
  while (!units.empty()) {
    const std::size_t blank = std::min(units.find(' '), units.size());
    std::string_view one = units.substr(0, blank);
    units.remove_prefix(std::min(blank + 1, units.size()));
    UnitShare u;
    const std::size_t star = one.find('*');
    if (star != std::string_view::npos) {
      u.share = static_cast<float>(one[star + 3] - '0') / 10.0F;  // every share is written 0.x
      one = one.substr(0, star);
    }
    u.unit = one;
    std::replace(u.unit.begin(), u.unit.end(), '#', side);
    out.push_back(std::move(u));
  }
  return out;
}

/// "au12", "au12l", "au12left": the unit by its own name, or both of its sides. "fix..." names nothing.
std::vector<UnitShare> facs_units(std::string_view plain) {
  if (!plain.starts_with("au")) return {};
  std::size_t end = 2;
  while (end < plain.size() && plain[end] >= '0' && plain[end] <= '9') ++end;
  if (end == 2 || end > 5) return {};
  const std::string number(plain.substr(2, end - 2));
  const std::string_view side = plain.substr(end);
  if (side == "l" || side == "left") return {{fmt::format("AU{}L", number), 1.0F}};
  if (side == "r" || side == "right") return {{fmt::format("AU{}R", number), 1.0F}};
  // A FACS name may go on in words, as in "AU12_lip_corner_puller".
  return {
      {fmt::format("AU{}", number), 1.0F}, {fmt::format("AU{}L", number), 1.0F}, {fmt::format("AU{}R", number), 1.0F}};
}

}  // namespace

std::string plain_name(std::string_view name) {
  std::string out;
  for (const char c : name) {
    if (c >= 'A' && c <= 'Z') out += static_cast<char>(c - 'A' + 'a');
    if ((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9')) out += c;
  }
  const std::size_t separator = name.find_last_of("_.-");
  if (separator != std::string_view::npos && separator + 2 == name.size()) {
    if (out.ends_with('l')) out += "eft";
    if (out.ends_with('r')) out += "ight";
  }
  return out;
}

std::vector<UnitShare> units_of_target(std::string_view name) {
  const std::string plain = plain_name(name);
  for (const Known& known : kKnown) {
    const std::size_t hash = known.name.find('#');
    if (hash == std::string_view::npos) {
      if (plain == known.name) return read_units(known.units, 'L');
      continue;
    }
    const std::string_view stem = known.name.substr(0, hash);
    if (plain == fmt::format("{}left", stem)) return read_units(known.units, 'L');
    if (plain == fmt::format("{}right", stem)) return read_units(known.units, 'R');
    if (plain == stem) {  // one target for both sides
      std::vector<UnitShare> both = read_units(known.units, 'L');
      for (UnitShare& u : read_units(known.units, 'R')) both.push_back(std::move(u));
      return both;
    }
  }
  return facs_units(plain);
}

}  // namespace nms::runtime
