#include "poses.h"

#include <algorithm>
#include <cstddef>
#include <random>
#include <set>
#include <utility>

#include <fmt/format.h>

namespace nms::fit_face {

namespace {

// What one body cannot do at once: docs of FACS 2002, and the physical exclusions that follow from it. A unit excludes
// all units of the other list.
struct Antagonists {
  std::set<int> one, other;
};

const std::vector<Antagonists>& antagonists() {
  static const std::vector<Antagonists> all = {
      {{5}, {41, 42, 43, 44, 45, 46}},
      {{41}, {42, 43, 44, 45, 46}},
      {{42}, {43, 44, 45, 46}},
      {{43}, {44, 45, 46}},
      {{44}, {45, 46}},
      {{45}, {46}},
      {{18}, {20}},
      {{8, 24, 28}, {25, 27}},
      {{8, 24}, {26}},
      {{23}, {24, 28}},
      {{24}, {28}},
      {{26}, {27}},
      {{31}, {26, 27}},
      {{33, 34}, {35}},
      {{33, 34}, {25, 27}},
      {{19, 37, 116}, {8, 23, 24, 28, 32, 33, 34, 36}},
      {{19}, {37, 116}},
      {{37}, {116}},
      {{38}, {39}},
      {{32}, {8, 24, 28}},
  };
  return all;
}

bool compatible(int a, int b) {
  return std::none_of(antagonists().begin(), antagonists().end(), [&](const Antagonists& x) {
    return (x.one.count(a) > 0 && x.other.count(b) > 0) || (x.one.count(b) > 0 && x.other.count(a) > 0);
  });
}

// Movements of the head and the torso as a whole.
bool is_rigid(int au) { return (au >= 51 && au <= 58) || (au >= 101 && au <= 108); }

struct Unit {
  std::string name;
  int au = 0;
  std::vector<std::pair<std::size_t, float>> channels;  // and what they are at 100 %
};

std::vector<Unit> units(const program::Program& p, const runtime::Rig& rig) {
  std::vector<Unit> out;
  for (std::size_t c = 0; c < p.channels.size(); ++c) {
    const program::Channel& channel = p.channels[c];
    if (!rig.actuated(program::ChannelId{static_cast<std::uint32_t>(c)})) continue;
    if (channel.kind == program::ChannelKind::axis) {
      for (const auto& [side, sign] : {std::pair(channel.positive, 1.0F), std::pair(channel.negative, -1.0F)}) {
        const std::string unit(p.string(side));
        out.push_back({unit, std::stoi(unit.substr(2)), {{c, sign}}});
      }
      continue;
    }
    // Both sides at once, but for the jaw, which cannot go both ways.
    constexpr int kJawSideways = 30;
    const auto same = std::find_if(out.begin(), out.end(),
                                   [&](const Unit& u) { return u.au == channel.au && channel.au != kJawSideways; });
    if (same != out.end()) {
      same->channels.emplace_back(c, 1.0F);
      continue;
    }
    std::string name(p.string(channel.name));
    if (channel.side != program::Side::none && channel.au != kJawSideways) name.pop_back();
    out.push_back({name, channel.au, {{c, 1.0F}}});
  }
  return out;
}

void set(const Unit& unit, float amount, std::vector<float>& values) {
  for (const auto& [channel, sign] : unit.channels) values[channel] = sign * amount;
}

}  // namespace

std::vector<FacePose> each_unit(const program::Program& program, const runtime::Rig& rig) {
  std::vector<FacePose> out;
  for (const Unit& unit : units(program, rig)) {
    for (const float amount : {0.3F, 0.6F, 1.0F}) {
      FacePose pose{fmt::format("{:.0f} % {}", amount * 100, unit.name), std::vector<float>(program.channels.size())};
      set(unit, amount, pose.values);
      out.push_back(std::move(pose));
    }
  }
  return out;
}

std::vector<FacePose> each_pair(const program::Program& program, const runtime::Rig& rig) {
  std::vector<FacePose> out;
  const std::vector<Unit> all = units(program, rig);
  for (std::size_t a = 0; a < all.size(); ++a) {
    for (std::size_t b = a + 1; b < all.size(); ++b) {
      if (is_rigid(all[a].au) || is_rigid(all[b].au) || all[a].au == all[b].au) continue;
      if (!compatible(all[a].au, all[b].au)) continue;
      FacePose pose{all[a].name + " + " + all[b].name, std::vector<float>(program.channels.size())};
      set(all[a], 1.0F, pose.values);
      set(all[b], 1.0F, pose.values);
      out.push_back(std::move(pose));
    }
  }
  return out;
}

std::vector<FacePose> mixtures(const program::Program& program, std::uint32_t seed, int count, float least) {
  std::vector<FacePose> out;
  std::mt19937 random(seed);
  for (int i = 0; i < count; ++i) {
    FacePose pose{{}, std::vector<float>(program.channels.size())};
    std::vector<int> used;
    const auto wanted = 2 + random() % 5;
    for (int tries = 0; tries < 40 && used.size() < wanted; ++tries) {
      const std::size_t c = random() % pose.values.size();
      const program::Channel& channel = program.channels[c];
      const float amount = least + (1.0F - least) * static_cast<float>(random() % 81) / 80.0F;
      if (pose.values[c] != 0.0F || is_rigid(channel.au)) continue;
      const bool fits = std::all_of(used.begin(), used.end(), [&](int au) {
        return compatible(au, channel.au) && !(au == 30 && channel.au == 30);
      });
      if (!fits) continue;
      const bool back = channel.kind == program::ChannelKind::axis && random() % 2 == 0;
      pose.values[c] = back ? -amount : amount;
      used.push_back(channel.au);
      pose.what += fmt::format("{}{:.0f} % {}", pose.what.empty() ? "" : " + ", pose.values[c] * 100,
                               program.string(channel.name));
    }
    out.push_back(std::move(pose));
  }
  return out;
}

}  // namespace nms::fit_face
