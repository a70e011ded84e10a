#include "avatar_targets.h"

#include <algorithm>
#include <optional>
#include <span>
#include <utility>

#include <fmt/format.h>

namespace nms::runtime {
namespace {

struct Known {
  std::string_view name;   ///< plain; `#` stands for left or right, and for L or R in the units
  std::string_view units;  ///< "AU12# AU13#*0.5": strongest wins
};

/// ARKit's blend shapes (Apple, ARFaceAnchor.BlendShapeLocation).
constexpr Known kArkit[] = {
    {"browdown#", "AU4#"},
    {"browinnerup", "AU1L AU1R"},
    {"browouterup#", "AU2#"},
    {"cheekpuff", "AU34L AU34R AU33L*0.7 AU33R*0.7"},
    {"cheeksquint#", "AU6#"},
    {"eyeblink#", "AU43# AU45# AU46# AU42#*0.8 AU41#*0.5"},
    {"eyelookdown#", "AU64"},
    {"eyelookup#", "AU63"},
    {"eyelookoutleft", "AU61 AU65"},
    {"eyelookinright", "AU61 AU66"},
    {"eyelookinleft", "AU62 AU66"},
    {"eyelookoutright", "AU62 AU65"},
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
};

/// The names that the FACS manual gives its units (Ekman, Friesen and Hager 2002), as stdlib/facs.nms has them,
/// but for those that are ARKit's or VRM's names too: a mouthStretch is ARKit's, and no AU27.
constexpr Known kTitles[] = {
    {"innerbrowraiser#", "AU1#"},
    {"outerbrowraiser#", "AU2#"},
    {"browlowerer#", "AU4#"},
    {"upperlidraiser#", "AU5#"},
    {"cheekraiser#", "AU6#"},
    {"lidtightener#", "AU7#"},
    {"lipstogether", "AU8"},
    {"nosewrinkler#", "AU9#"},
    {"upperlipraiser#", "AU10#"},
    {"nasolabialfurrowdeepener#", "AU11#"},
    {"lipcornerpuller#", "AU12#"},
    {"sharplippuller#", "AU13#"},
    {"dimpler#", "AU14#"},
    {"lipcornerdepressor#", "AU15#"},
    {"lowerlipdepressor#", "AU16#"},
    {"chinraiser", "AU17"},
    {"lippuckerer", "AU18"},
    {"lipstretcher#", "AU20#"},
    {"necktightener", "AU21"},
    {"lipfunneler", "AU22"},
    {"liptightener", "AU23"},
    {"lippressor", "AU24"},
    {"lipspart", "AU25"},
    {"jawdrop", "AU26"},
    {"lipsuck", "AU28"},
    {"jawthrust", "AU29"},
    {"jawsideways#", "AU30#"},
    {"jawclencher", "AU31"},
    {"lipbite", "AU32"},
    {"cheekblow#", "AU33#"},
    {"cheeksuck#", "AU35#"},
    {"tonguebulge#", "AU36#"},
    {"lipwipe", "AU37"},
    {"nostrildilator#", "AU38#"},
    {"nostrilcompressor#", "AU39#"},
    {"liddroop#", "AU41#"},
    {"eyelidslit#", "AU42#"},
    {"eyesclosed#", "AU43#"},
    {"squint#", "AU44#"},
    {"wink#", "AU46#"},
    {"walleye", "AU65"},
    {"crosseye", "AU66"},
};

/// The presets of VRM 1.0 that show a movement and not a feeling (VRMC_vrm-1.0, expressions).
constexpr Known kVrm[] = {
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

/// The units of an entry that a name of `side` shows: of the other side none. Side 0: all.
std::vector<UnitShare> units_on_side(std::string_view units, char side) {
  if (units.find('#') != std::string_view::npos && side == 0) {
    std::vector<UnitShare> both = read_units(units, 'L');
    for (UnitShare& u : read_units(units, 'R')) both.push_back(std::move(u));
    return both;
  }
  std::vector<UnitShare> out = read_units(units, side);
  if (side != 0)
    out.erase(std::remove_if(out.begin(), out.end(),
                             [&](const UnitShare& u) { return u.unit.back() == (side == 'L' ? 'R' : 'L'); }),
              out.end());
  return out;
}

/// What `plain` says beyond `stem`: 'L', 'R', 0 for nothing; '?' if it says something else.
char side_beyond(std::string_view plain, std::string_view stem) {
  if (plain == stem) return 0;
  const std::size_t at = plain.find(stem);
  if (at == std::string_view::npos) return '?';
  std::string_view side;
  if (at == 0) side = plain.substr(stem.size());
  if (at != 0 && at + stem.size() == plain.size()) side = plain.substr(0, at);
  const bool letter = at == 0 && stem.size() > 3;  // "eyeBlinkL"; but "our" is no "ou"
  if (side == "left" || (letter && side == "l")) return 'L';
  if (side == "right" || (letter && side == "r")) return 'R';
  return '?';
}

std::optional<TargetName> in_table(std::span<const Known> table, std::string_view plain, NameSet sided, NameSet whole) {
  for (const Known& known : table) {
    const char side = side_beyond(plain, known.name.substr(0, known.name.find('#')));
    if (side != '?') return TargetName{side == 0 ? whole : sided, units_on_side(known.units, side)};
  }
  return std::nullopt;
}

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

/// "AU12", "au12l", "AU12_Left", "AU01_inner_brow_raiser_R", "AD19": the unit, or one side of it.
TargetName facs_units(std::string_view name) {
  const std::vector<std::string> words = words_of(name);
  std::string number;
  std::string_view side;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (words[i].front() >= '0' && words[i].front() <= '9') {
      if (!number.empty()) return {};
      if (i > 0 && (words[i - 1] == "au" || words[i - 1] == "ad")) number = words[i];
    }
    if (words[i] == "l" || words[i] == "left") side = "L";
    if (words[i] == "r" || words[i] == "right") side = "R";
  }
  number.erase(0, std::min(number.find_first_not_of('0'), number.size()));
  if (number.empty() || number.size() > 3) return {};
  // What we do not part by side moves with either of its sides: "AU18_L", "AU61_eyes_turn_left".
  if (!side.empty()) return {NameSet::facs_side, {{fmt::format("AU{}{}", number, side), 1.0F}, {"AU" + number, 1.0F}}};
  return {NameSet::facs,
          {{fmt::format("AU{}", number), 1.0F},
           {fmt::format("AU{}L", number), 1.0F},
           {fmt::format("AU{}R", number), 1.0F}}};
}

}  // namespace

/// Runs of letters and runs of digits, small; what begins large is a word: "FACS_AU12LLipCorner" is facs au 12 l lip
/// corner.
std::vector<std::string> words_of(std::string_view name) {
  enum class Kind : std::uint8_t { other, small, large, digit };
  std::vector<std::string> words;
  Kind before = Kind::other;
  for (const char c : name) {
    const Kind kind = c >= 'a' && c <= 'z'   ? Kind::small
                      : c >= 'A' && c <= 'Z' ? Kind::large
                      : c >= '0' && c <= '9' ? Kind::digit
                                             : Kind::other;
    const bool goes_on = kind == before || (before == Kind::large && kind == Kind::small);
    if (kind != Kind::other && !goes_on) words.emplace_back();
    if (goes_on && kind != before && words.back().size() > 1) {  // the "Lip" of "LLip"
      words.push_back(words.back().substr(words.back().size() - 1));
      words[words.size() - 2].pop_back();
    }
    if (kind != Kind::other) words.back() += lower(c);
    before = kind;
  }
  return words;
}

std::string plain_name(std::string_view name) {
  std::string out;
  for (const char c : name)
    if (const char small = lower(c); (small >= 'a' && small <= 'z') || (small >= '0' && small <= '9')) out += small;
  const std::size_t separator = name.find_last_of("_.- ");
  if (separator != std::string_view::npos && separator + 2 == name.size()) {
    if (out.ends_with('l')) out += "eft";
    if (out.ends_with('r')) out += "ight";
  }
  return out;
}

TargetName units_of_target(std::string_view name) {
  const std::string plain = plain_name(name);
  if (auto found = in_table(kArkit, plain, NameSet::arkit_side, NameSet::arkit)) return std::move(*found);
  if (auto found = in_table(kVrm, plain, NameSet::vrm_side, NameSet::vrm)) return std::move(*found);
  if (auto found = in_table(kTitles, plain, NameSet::facs_side, NameSet::facs)) return std::move(*found);
  return facs_units(name);
}

}  // namespace nms::runtime
