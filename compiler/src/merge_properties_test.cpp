// What merging promises for any clip, over random clips with every operator, layer, envelope, joint, slot and
// antagonist. Each promise is a function that says whether a merger keeps it, and is shown to say no to one that does
// not: a property that nothing can break proves nothing.
#include <algorithm>
#include <functional>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "combine.h"
#include "competition.h"
#include "merge.h"
#include "profile.h"

namespace {

using namespace nms;
using namespace nms::compiler;

constexpr std::int64_t kMs = 1'000'000;
/// Products are fitted to kFitTolerance; a value may come through a profile, a slot, two antagonists, layers and a lid,
/// and two curves are compared.
constexpr double kTolerance = 12 * kFitTolerance;
constexpr std::int64_t kEnd = 5500;
constexpr std::int64_t kSample = 17;

using Merger = std::function<std::vector<MergedCurve>(const ClipDraft&, const Channels&)>;

enum Channel : std::uint32_t { brow_up, brow_down, pressed, parted, puffed, wide, shut, head, gaze, kChannels };

/// Two entries, one of which takes the brows and the lids of the other, and is left its mouth and its head.
const Declaration kYielding{}, kTaking{};

std::vector<CombineRule> rules(const Channels& channels) {
  std::vector<CombineRule> out;
  for (const std::uint32_t channel : {brow_up, shut, gaze})
    out.push_back({&kYielding, &kTaking, channels.channels[channel].track, {}});
  for (const std::uint32_t channel : {parted, head})
    out.push_back({&kTaking, &kYielding, channels.channels[channel].track, {}});
  return out;
}

std::vector<MergedCurve> merger(const ClipDraft& clip, const Channels& channels) {
  ClipDraft settled = clip;
  EXPECT_TRUE(combine(settled, rules(channels), channels));
  give_way(settled, channels);
  return merge(settled, channels);
}

/// A small face: every operator of tracks and of layers, a slot, antagonists and a lid that hides.
Channels face() {
  Channels c;
  const auto track = [&](program::MergeOperator op, LayerOperator layers, std::string slot) {
    TrackInfo t;
    t.merge = op;
    t.layers = layers;
    t.slot = std::move(slot);
    if (!t.slot.empty()) t.slot_order = {Layer::lexical, Layer::morphological};
    c.tracks.push_back(t);
    return static_cast<std::uint32_t>(c.tracks.size() - 1);
  };
  const std::uint32_t brows = track(program::MergeOperator::strongest, LayerOperator::either, "");
  const std::uint32_t mouth = track(program::MergeOperator::strongest, LayerOperator::either, "lower_face");
  const std::uint32_t cheeks = track(program::MergeOperator::sum, LayerOperator::highest, "lower_face");
  const std::uint32_t lids = track(program::MergeOperator::latest, LayerOperator::either, "");
  const std::uint32_t neck = track(program::MergeOperator::sum, LayerOperator::either, "");
  const std::uint32_t eyes = track(program::MergeOperator::latest, LayerOperator::highest, "");
  for (const std::uint32_t t : {brows, brows, mouth, mouth, cheeks, lids, lids, neck, eyes}) {
    ChannelInfo info;
    info.track = t;
    info.kind = t == neck || t == eyes ? program::ChannelKind::axis : program::ChannelKind::action_unit;
    c.channels.push_back(info);
  }
  const auto against = [&](std::uint32_t a, std::uint32_t b) {
    c.channels[a].antagonists.push_back({b, b, 0.4});
    c.channels[b].antagonists.push_back({a, a, 0.4});
  };
  against(pressed, parted);
  against(puffed, parted);
  c.channels[brow_up].contrary.push_back({brow_down, brow_down, 0.6});
  c.channels[brow_down].contrary.push_back({brow_up, brow_up, 0.6});
  c.channels[wide].hidden_by.push_back({shut, shut, 0.0});
  return c;
}

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  std::int64_t below(std::int64_t n) { return static_cast<std::int64_t>(engine_() % static_cast<std::uint64_t>(n)); }
  double share() { return static_cast<double>(engine_() >> 11U) / 9007199254740992.0; }

 private:
  std::mt19937_64 engine_;
};

/// What a random clip is made of, so that it can be made again with more of one cause.
struct Seed {
  Contribution what;
  double value = 0.0;
  std::int64_t times_ns[4] = {};
  bool profiled = false;
};

Curve course(const Seed& s, double value) {
  Curve curve;
  const double values[4] = {0.0, value, value, 0.0};
  for (int i = 0; i < (s.what.held ? 3 : 4); ++i) ease_to(curve, s.times_ns[i], values[i], s.what.easing, 0);
  return curve;
}

Contribution grown(const Seed& s, double more) {
  Contribution c = s.what;
  c.curve = course(s, s.value + more);
  c.envelope = course(s, 1.0);
  if (s.profiled) {
    Curve profile;
    ease_to(profile, s.times_ns[0], 1.0, Easing::linear, 0);
    ease_to(profile, s.times_ns[3], 0.4, Easing::linear, 0);
    c.curve = profiled(c.curve, profile);
  }
  return c;
}

struct World {
  std::vector<Seed> seeds;
  std::vector<DraftCause> causes;
};

World world(Random& random) {
  static constexpr std::string_view kMotions[] = {"", "", "", "shake", "nod"};
  World w;
  // Few channels and layers in one world, so that causes meet.
  const std::int64_t first_channel = random.below(kChannels);
  const std::int64_t channels = 1 + random.below(kChannels);
  const std::int64_t layers = 1 + random.below(kLayerCount);
  const bool train = random.below(2) == 0;  // each begins about where the one before goes
  for (std::int64_t n = 1 + random.below(10); n > 0; --n) {
    Seed s;
    s.what.channel = static_cast<std::uint32_t>((first_channel + random.below(channels)) % kChannels);
    s.what.layer = static_cast<Layer>(random.below(layers));
    s.what.stated = random.below(5) == 0;
    s.what.easing = static_cast<Easing>(random.below(3));
    const std::int64_t begin =
        train && !w.seeds.empty() ? w.seeds.back().times_ns[2] - random.below(150) * kMs : random.below(3000) * kMs;
    s.times_ns[0] = begin + n;  // n: of two that start at once the later declared counts
    s.times_ns[1] = s.times_ns[0] + (1 + random.below(300)) * kMs;
    s.times_ns[2] = s.times_ns[1] + (1 + random.below(train ? 300 : 1200)) * kMs;
    s.times_ns[3] = s.times_ns[2] + (1 + random.below(300)) * kMs;
    s.profiled = random.below(4) == 0;
    const bool axis = s.what.channel >= head;
    s.value = axis ? 2.0 * random.share() - 1.0 : random.share();
    s.what.start_ns = s.times_ns[0];
    s.what.motion = kMotions[random.below(std::size(kMotions))];
    s.what.pose = s.what.motion.empty() && random.below(4) != 0;
    s.what.held = s.what.pose && random.below(6) == 0;
    s.what.apex_ns = s.times_ns[1];
    s.what.release_ns = s.times_ns[2];
    s.what.end_ns = s.what.held ? s.times_ns[2] : s.times_ns[3];
    s.what.cause = static_cast<std::uint32_t>(w.causes.size());
    const std::int64_t lead = random.below(200) * kMs;
    const Declaration* entries[] = {nullptr, nullptr, &kYielding, &kTaking};
    w.causes.push_back(
        {"", {}, {s.times_ns[0] + lead, std::max(s.times_ns[2], s.times_ns[0] + lead)}, entries[random.below(4)]});
    w.seeds.push_back(s);
  }
  return w;
}

ClipDraft clip_of(const World& w, std::size_t grown_one = std::numeric_limits<std::size_t>::max()) {
  ClipDraft clip;
  clip.causes = w.causes;
  for (std::size_t i = 0; i < w.seeds.size(); ++i)
    clip.contributions.push_back(grown(w.seeds[i], i == grown_one ? 0.35 : 0.0));
  return clip;
}

double value(const std::vector<MergedCurve>& all, std::uint32_t channel, std::int64_t t) {
  for (const MergedCurve& m : all)
    if (m.channel == channel) return m.curve.value(t * kMs);
  return 0.0;
}

bool nothing_leaves_its_range(const Merger& merge_all, int rounds) {
  Random random(101);
  const Channels channels = face();
  for (int i = 0; i < rounds; ++i)
    for (const MergedCurve& m : merge_all(clip_of(world(random)), channels)) {
      const double low = channels.channels[m.channel].low();
      for (std::size_t k = 1; k < m.curve.knots.size(); ++k)
        if (m.curve.knots[k - 1].time_ns > m.curve.knots[k].time_ns) return false;
      for (std::int64_t t = -300; t < kEnd; t += kSample)
        if (m.curve.value(t * kMs) < low - kFitTolerance || m.curve.value(t * kMs) > 1.0 + kFitTolerance) return false;
    }
  return true;
}

bool more_of_a_cause_is_never_less_of_its_effect(const Merger& merge_all, int rounds) {
  Random random(102);
  const Channels channels = face();
  for (int i = 0; i < rounds; ++i) {
    const World w = world(random);
    const auto one = static_cast<std::size_t>(random.below(static_cast<std::int64_t>(w.seeds.size())));
    const std::uint32_t channel = w.seeds[one].what.channel;
    const auto before = merge_all(clip_of(w), channels);
    const auto after = merge_all(clip_of(w, one), channels);
    for (std::int64_t t = -300; t < kEnd; t += kSample)
      if (value(after, channel, t) < value(before, channel, t) - kTolerance) return false;
  }
  return true;
}

bool the_order_of_declaration_does_not_matter(const Merger& merge_all, int rounds) {
  Random random(103);
  const Channels channels = face();
  for (int i = 0; i < rounds; ++i) {
    ClipDraft clip = clip_of(world(random));
    const auto before = merge_all(clip, channels);
    std::reverse(clip.contributions.begin(), clip.contributions.end());
    const auto after = merge_all(clip, channels);
    for (std::uint32_t c = 0; c < kChannels; ++c)
      for (std::int64_t t = -300; t < kEnd; t += kSample) {
        const double difference = value(before, c, t) - value(after, c, t);
        if (difference > kTolerance || difference < -kTolerance) return false;
      }
  }
  return true;
}

bool a_higher_layer_is_not_lowered_by_what_lies_below(const Merger& merge_all, int rounds) {
  Random random(104);
  const Channels channels = face();
  for (int i = 0; i < rounds; ++i) {
    World w = world(random);
    for (Seed& s : w.seeds) {
      s.what.stated = false;
      // What is held goes when anything comes, and of one motion asked for twice the longer is kept, in any layer.
      s.what.held = false;
      s.what.end_ns = s.times_ns[3];
      s.what.motion = {};
    }
    for (DraftCause& c : w.causes) c.entry = nullptr;  // a combination asks no layer
    const auto above = static_cast<std::size_t>(random.below(static_cast<std::int64_t>(w.seeds.size())));
    const std::uint32_t channel = w.seeds[above].what.channel;
    w.seeds[above].what.layer = Layer::discourse;
    if (channel == wide || channels.channels[channel].is_axis()) continue;  // lids hide, axes pull both ways
    World alone = w;
    std::erase_if(alone.seeds, [](const Seed& s) { return s.what.layer != Layer::discourse; });
    const auto with = merge_all(clip_of(w), channels);
    const auto without = merge_all(clip_of(alone), channels);
    for (std::int64_t t = -300; t < kEnd; t += kSample)
      if (value(with, channel, t) < value(without, channel, t) - kTolerance) return false;
  }
  return true;
}

// ---- Mergers with one fault each.

/// Merges each channel by `rule` of all its curves, in the order they are declared.
template <typename Rule>
Merger each_channel(Rule rule) {
  return [rule](const ClipDraft& clip, const Channels&) {
    std::vector<MergedCurve> out;
    for (std::uint32_t channel = 0; channel < kChannels; ++channel) {
      std::vector<const Curve*> curves;
      for (const Contribution& c : clip.contributions)
        if (c.channel == channel) curves.push_back(&c.curve);
      if (!curves.empty()) out.push_back({channel, rule(curves)});
    }
    return out;
  };
}

/// Forgets to hold a sum within its range.
Curve sum_without_limit(const std::vector<const Curve*>& curves) {
  Curve out;
  for (const Curve* c : curves) out = out.empty() ? *c : add(out, *c);
  return out;
}

Curve last_declared(const std::vector<const Curve*>& curves) { return *curves.back(); }

/// Takes a unit for its own antagonist.
std::vector<MergedCurve> scales_by_itself(const ClipDraft& clip, const Channels& channels) {
  auto out = merger(clip, channels);
  for (MergedCurve& m : out)
    if (!channels.channels[m.channel].is_axis()) m.curve = replaced(m.curve, {}, m.curve);
  return out;
}

/// Lets what gives way give way to itself.
std::vector<MergedCurve> yields_to_itself(const ClipDraft& clip, const Channels& channels) {
  ClipDraft less = clip;
  for (Contribution& c : less.contributions)
    if (clip.causes[c.cause].entry == &kYielding && c.channel == brow_up) c.curve = replaced(c.curve, {}, c.curve);
  return merger(less, channels);
}

/// Lets layers scale antagonists upwards: the highest is the lowest.
std::vector<MergedCurve> layers_upside_down(const ClipDraft& clip, const Channels& channels) {
  ClipDraft turned = clip;
  for (Contribution& c : turned.contributions)
    c.layer = static_cast<Layer>(kLayerCount - 1 - static_cast<int>(c.layer));
  return merger(turned, channels);
}

/// Joins two that are about as strong and leaves out the weaker: whether it does depends on values.
std::vector<MergedCurve> joins_what_is_alike(const ClipDraft& clip, const Channels& channels) {
  const auto peak = [](const Contribution& c) {
    double most = 0.0;
    for (const CurveKnot& k : c.curve.knots) most = std::max(most, k.value);
    return most;
  };
  ClipDraft fewer = clip;
  fewer.contributions.clear();
  for (const Contribution& c : clip.contributions) {
    const bool left_out = std::any_of(clip.contributions.begin(), clip.contributions.end(), [&](const Contribution& o) {
      return &o != &c && o.channel == c.channel && peak(o) > peak(c) && peak(o) < peak(c) + 0.3;
    });
    if (!left_out) fewer.contributions.push_back(c);
  }
  return merger(fewer, channels);
}

constexpr int kRounds = 4000;

TEST(MergeProperties, nothing_leaves_its_range) {
  EXPECT_TRUE(nothing_leaves_its_range(merger, kRounds));
  EXPECT_FALSE(nothing_leaves_its_range(each_channel(sum_without_limit), kRounds));
}

TEST(MergeProperties, more_of_a_cause_is_never_less_of_its_effect) {
  EXPECT_TRUE(more_of_a_cause_is_never_less_of_its_effect(merger, kRounds));
  EXPECT_FALSE(more_of_a_cause_is_never_less_of_its_effect(scales_by_itself, kRounds));
  EXPECT_FALSE(more_of_a_cause_is_never_less_of_its_effect(yields_to_itself, kRounds));
  EXPECT_FALSE(more_of_a_cause_is_never_less_of_its_effect(joins_what_is_alike, kRounds));
}

TEST(MergeProperties, the_order_of_declaration_does_not_matter) {
  EXPECT_TRUE(the_order_of_declaration_does_not_matter(merger, kRounds));
  EXPECT_FALSE(the_order_of_declaration_does_not_matter(each_channel(last_declared), kRounds));
}

TEST(MergeProperties, a_higher_layer_is_not_lowered_by_what_lies_below) {
  EXPECT_TRUE(a_higher_layer_is_not_lowered_by_what_lies_below(merger, kRounds));
  EXPECT_FALSE(a_higher_layer_is_not_lowered_by_what_lies_below(layers_upside_down, kRounds));
}

}  // namespace
