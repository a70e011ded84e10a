#include "merge.h"

#include <algorithm>
#include <array>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <utility>

#include "coarticulation.h"

namespace nms::compiler {
namespace {

/// The same motion asked for twice is one: a swing whose time lies within another's of the same name is left out.
std::vector<bool> repeats_of_another(const std::vector<const Contribution*>& all) {
  std::vector<bool> repeats(all.size(), false);
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < all.size(); ++i)
    if (!all[i]->motion.empty()) order.push_back(i);
  const auto same = [&](std::size_t a, std::size_t b) {
    return all[a]->motion == all[b]->motion && all[a]->stated == all[b]->stated;
  };
  // By motion, then by start, the longest first: whatever a swing lies within stands in front of it.
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    const Contribution &x = *all[a], &y = *all[b];
    if (x.motion != y.motion) return x.motion < y.motion;
    if (x.stated != y.stated) return y.stated;
    return x.start_ns != y.start_ns ? x.start_ns < y.start_ns : x.end_ns > y.end_ns;
  });
  std::int64_t latest_end = 0;
  for (std::size_t k = 0; k < order.size(); ++k) {
    const std::int64_t end = all[order[k]]->end_ns;
    const bool first = k == 0 || !same(order[k - 1], order[k]);
    repeats[order[k]] = !first && latest_end >= end;
    latest_end = first ? end : std::max(latest_end, end);
  }
  return repeats;
}

/// Joins neighbours pairwise until one is left: a curve is copied log n times, not n times.
template <typename Join>
Curve join_all(std::vector<Curve> curves, Join join) {
  if (curves.empty()) return {};
  while (curves.size() > 1) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < curves.size(); i += 2) {
      curves[kept] = i + 1 < curves.size() ? join(curves[i], curves[i + 1]) : std::move(curves[i]);
      simplify(curves[kept++]);
    }
    curves.resize(kept);
  }
  return std::move(curves.front());
}

/// Each takes the place of those which began before it. What lies before its start is done, and is not touched again.
Curve latest_of(const std::vector<const Contribution*>& group) {
  Curve done;
  Curve open;
  for (const Contribution* c : group) {
    const auto after = std::lower_bound(open.knots.begin(), open.knots.end(), c->start_ns,
                                        [](const CurveKnot& k, std::int64_t t) { return k.time_ns < t; });
    // One knot before the start stays: its segment reaches into what is still open.
    if (after - open.knots.begin() > 1) {
      done.knots.insert(done.knots.end(), open.knots.begin(), after - 1);
      open.knots.erase(open.knots.begin(), after - 1);
    }
    open = open.empty() ? c->curve : replaced(open, c->curve, c->envelope);
    simplify(open);
  }
  done.knots.insert(done.knots.end(), open.knots.begin(), open.knots.end());
  return done;
}

/// Keeps what is said of one channel, so that it can be told in one go though channels are merged side by side.
class Notes : public MergeObserver {
 public:
  void channel(std::uint32_t c, const std::vector<const Contribution*>& all) override {
    note([=](MergeObserver& o) { o.channel(c, all); });
  }
  void repeated(const Contribution& c) override {
    note([&c](MergeObserver& o) { o.repeated(c); });
  }
  void let_go(const Contribution& held, const Contribution& going, const Contribution& by) override {
    note([&](MergeObserver& o) { o.let_go(held, going, by); });
  }
  void joined(const Contribution& pose, const Contribution& joint) override {
    note([&](MergeObserver& o) { o.joined(pose, joint); });
  }
  void group(const std::vector<const Contribution*>& of, bool stated, program::MergeOperator op, bool sum,
             const Curve& merged) override {
    note([=](MergeObserver& o) { o.group(of, stated, op, sum, merged); });
  }
  void scaled(Layer layer, const Curve& taken, const Curve& merged) override {
    note([=](MergeObserver& o) { o.scaled(layer, taken, merged); });
  }
  void layers(Layer layer, const Curve* envelope, const Curve& merged) override {
    note([layer, by = envelope != nullptr ? std::optional(*envelope) : std::nullopt, merged](MergeObserver& o) {
      o.layers(layer, by ? &*by : nullptr, merged);
    });
  }
  void replaced(const Curve& envelope, const Curve& merged) override {
    note([=](MergeObserver& o) { o.replaced(envelope, merged); });
  }
  void hidden(const Curve& taken, const Curve& merged) override {
    note([=](MergeObserver& o) { o.hidden(taken, merged); });
  }
  void tell(MergeObserver& observer) const {
    for (const auto& said : notes_) said(observer);
  }

 private:
  void note(std::function<void(MergeObserver&)> said) { notes_.push_back(std::move(said)); }
  std::vector<std::function<void(MergeObserver&)>> notes_;
};

/// One channel while it is merged: what each layer makes of it, and what the utterance states, before they meet.
struct Layered {
  static constexpr int kStated = kLayerCount;  ///< above all layers
  static constexpr int kFirst = kStated + 1;   ///< notes of what comes before the layers
  static constexpr int kLast = kFirst + 1;     ///< and after them
  std::uint32_t channel = 0;
  std::array<std::vector<const Contribution*>, kLayerCount + 1> causes;
  std::array<Curve, kLayerCount + 1> value;
  std::unique_ptr<std::array<Notes, kLast + 1>>
      notes;  ///< of each layer, of what is stated, and of the rest; none: nobody listens

  /// Where to say what is done to a layer. Null: nobody listens.
  [[nodiscard]] Notes* notes_of(std::size_t layer) { return notes == nullptr ? nullptr : &(*notes)[layer]; }
};

Curve merge_group(std::vector<const Contribution*>& group, const ChannelInfo& channel, program::MergeOperator op,
                  std::deque<Contribution>& made, MergeObserver* observer) {
  if (group.size() == 1 && observer == nullptr) return clamped(group.front()->curve, channel.low(), 1.0);
  coarticulate(group, op, made, observer);
  const bool latest = op == program::MergeOperator::latest;
  const bool sum = !latest && (op == program::MergeOperator::sum || channel.is_axis());
  Curve out;
  if (latest) {
    std::stable_sort(group.begin(), group.end(),
                     [](const Contribution* a, const Contribution* b) { return a->start_ns < b->start_ns; });
    out = latest_of(group);
  } else {
    std::vector<Curve> curves;
    curves.reserve(group.size());
    for (const Contribution* c : group) curves.push_back(c->curve);
    out = join_all(std::move(curves), sum ? add : maximum);
  }
  out = clamped(out, channel.low(), 1.0);
  if (observer != nullptr) observer->group(group, group.front()->stated, op, sum, out);
  return out;
}

/// How far a layer takes a channel: the largest envelope.
Curve claim(const std::vector<const Contribution*>& causes) {
  std::vector<Curve> envelopes;
  envelopes.reserve(causes.size());
  for (const Contribution* c : causes) envelopes.push_back(c->envelope);
  return join_all(std::move(envelopes), maximum);
}

/// Within layers: contributions by channel, and each layer's value of it.
std::vector<Layered> merge_within_layers(const ClipDraft& clip, const Channels& channels,
                                         std::deque<Contribution>& made, bool listened) {
  std::vector<const Contribution*> order;
  order.reserve(clip.contributions.size());
  for (const Contribution& c : clip.contributions) order.push_back(&c);
  std::stable_sort(order.begin(), order.end(),
                   [](const Contribution* a, const Contribution* b) { return a->channel < b->channel; });
  std::vector<Layered> out;
  std::vector<const Contribution*> all;
  for (std::size_t i = 0; i < order.size();) {
    all.clear();
    Layered& layered = out.emplace_back();
    layered.channel = order[i]->channel;
    for (; i < order.size() && order[i]->channel == layered.channel; ++i) all.push_back(order[i]);
    if (listened) layered.notes = std::make_unique<std::array<Notes, Layered::kLast + 1>>();
    Notes* const notes = layered.notes_of(Layered::kFirst);
    if (notes != nullptr) notes->channel(layered.channel, all);
    std::vector<bool> repeats(all.size(), false);
    if (all.size() > 1) {
      end_held(all, made, notes);
      repeats = repeats_of_another(all);
    }
    for (std::size_t k = 0; k < all.size(); ++k)
      if (!repeats[k])
        layered.causes[all[k]->stated ? Layered::kStated : static_cast<int>(all[k]->layer)].push_back(all[k]);
      else if (notes != nullptr)
        notes->repeated(*all[k]);
    const ChannelInfo& channel = channels.channels[layered.channel];
    for (std::size_t l = 0; l < layered.causes.size(); ++l)
      if (!layered.causes[l].empty())
        layered.value[l] =
            merge_group(layered.causes[l], channel, channels.tracks[channel.track].merge, made, layered.notes_of(l));
  }
  return out;
}

Curve less(const Curve& value, const Curve& taken) { return replaced(value, {}, taken); }

void scale(Layered& l, std::size_t layer, const Curve& taken) {
  if (taken.empty() || l.value[layer].empty()) return;
  l.value[layer] = less(l.value[layer], taken);
  if (Notes* const notes = l.notes_of(layer)) notes->scaled(static_cast<Layer>(layer), taken, l.value[layer]);
}

/// What a face does by itself is left what language does not claim on any channel of its track.
void yield_to_language(std::vector<Layered>& all, const Channels& channels) {
  constexpr auto kAmbient = static_cast<std::size_t>(Layer::ambient);
  const auto track_of = [&](const Layered& l) { return channels.channels[l.channel].track; };
  std::vector<std::optional<Curve>> taken(channels.tracks.size());
  for (Layered& l : all) {
    if (l.causes[kAmbient].empty()) continue;
    std::optional<Curve>& claimed = taken[track_of(l)];
    if (!claimed) {
      std::vector<Curve> claims;
      for (const Layered& other : all)
        for (std::size_t layer = 0; track_of(other) == track_of(l) && layer <= Layered::kStated; ++layer)
          if ((layer == Layered::kStated || linguistic(static_cast<Layer>(layer))) && !other.causes[layer].empty())
            claims.push_back(claim(other.causes[layer]));
      claimed = join_all(std::move(claims), maximum);
    }
    scale(l, kAmbient, *claimed);
    simplify(l.value[kAmbient]);  // where nothing is left of it, it splits no segment of what is said
  }
}

/// Of the layers that share a slot, one moves it at a time: a later one in the slot's order is left what the earlier
/// ones do not claim on any of the slot's channels.
void share_slots(std::vector<Layered>& all, const Channels& channels) {
  const auto track_of = [&](const Layered& l) -> const TrackInfo& {
    return channels.tracks[channels.channels[l.channel].track];
  };
  for (std::size_t first = 0; first < all.size(); ++first) {
    const std::string& slot = track_of(all[first]).slot;
    if (slot.empty()) continue;
    if (std::any_of(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(first),
                    [&](const Layered& l) { return track_of(l).slot == slot; }))
      continue;  // done with its first channel
    Curve taken;
    for (const Layer layer : track_of(all[first]).slot_order) {
      const auto at = static_cast<std::size_t>(layer);
      std::vector<Curve> claims;
      for (Layered& l : all) {
        if (track_of(l).slot != slot || l.causes[at].empty()) continue;
        claims.push_back(claim(l.causes[at]));
        scale(l, at, taken);
      }
      const Curve own = join_all(std::move(claims), maximum);
      taken = taken.empty() ? own : maximum(taken, own);
    }
  }
}

const Layered* find(const std::vector<Layered>& all, std::uint32_t channel) {
  const auto it = std::lower_bound(all.begin(), all.end(), channel,
                                   [](const Layered& l, std::uint32_t c) { return l.channel < c; });
  return it != all.end() && it->channel == channel ? &*it : nullptr;
}

/// A higher layer scales the antagonists below it by (1 - its own value).
void scale_antagonists(std::vector<Layered>& all, const Channels& channels) {
  std::vector<std::array<Curve, kLayerCount>> taken(all.size());
  for (std::size_t i = 0; i < all.size(); ++i)
    for (const Related& r : channels.channels[all[i].channel].antagonists) {
      Curve above;  // of the layers higher than the one looked at
      for (std::size_t layer = kLayerCount; layer-- > 0;) {
        Curve own;
        for (std::uint32_t c = r.first; c <= r.last; ++c)
          if (const Layered* other = find(all, c); other != nullptr && !other->value[layer + 1].empty())
            own = own.empty() ? other->value[layer + 1] : maximum(own, other->value[layer + 1]);
        if (!own.empty()) above = above.empty() ? own : either(above, own);
        if (above.empty() || all[i].value[layer].empty()) continue;
        taken[i][layer] = taken[i][layer].empty() ? above : either(taken[i][layer], above);
      }
    }
  for (std::size_t i = 0; i < all.size(); ++i)
    for (std::size_t layer = 0; layer < kLayerCount; ++layer) scale(all[i], layer, taken[i][layer]);
}

/// Between layers, low to high, and what the utterance states.
Curve join_layers(Layered& l, const ChannelInfo& channel, LayerOperator op) {
  Curve out;
  for (std::size_t layer = 0; layer < kLayerCount; ++layer) {
    const Curve& own = l.value[layer];
    if (own.empty()) continue;
    std::optional<Curve> envelope;
    if (out.empty()) {
      out = own;
    } else if (op == LayerOperator::highest) {
      envelope = claim(l.causes[layer]);
      out = replaced(out, own, *envelope);
    } else {
      out = channel.is_axis() ? add(out, own) : either(out, own);
    }
    if (Notes* const notes = l.notes_of(layer))
      notes->layers(static_cast<Layer>(layer), envelope ? &*envelope : nullptr, out);
  }
  const Curve& stated = l.value[Layered::kStated];
  if (out.empty()) {
    out = stated;
  } else if (!stated.empty()) {
    const Curve envelope = claim(l.causes[Layered::kStated]);
    out = replaced(out, stated, envelope);
    if (Notes* const notes = l.notes_of(Layered::kStated)) notes->replaced(envelope, out);
  }
  return clamped(out, channel.low(), 1.0);
}

/// What is hidden is scaled by (1 - what hides it).
void hide(std::vector<MergedCurve>& all, std::vector<Layered>& layered, const Channels& channels) {
  std::vector<std::pair<std::size_t, Curve>> hidden;
  for (std::size_t i = 0; i < all.size(); ++i) {
    Curve taken;
    for (const Related& r : channels.channels[all[i].channel].hidden_by) {
      Curve own;  // the larger side
      for (const MergedCurve& m : all)
        if (m.channel >= r.first && m.channel <= r.last) own = own.empty() ? m.curve : maximum(own, m.curve);
      if (!own.empty()) taken = taken.empty() ? own : either(taken, own);
    }
    if (taken.empty()) continue;
    hidden.emplace_back(i, less(all[i].curve, taken));
    if (Notes* const notes = layered[i].notes_of(Layered::kLast)) notes->hidden(taken, hidden.back().second);
  }
  for (auto& [i, curve] : hidden) {  // what hides may be hidden itself: that changes nothing
    all[i].curve = std::move(curve);
    simplify(all[i].curve);
  }
}

}  // namespace

Curve strongest_of(std::vector<Curve> curves) { return join_all(std::move(curves), maximum); }

std::vector<MergedCurve> merge(const ClipDraft& clip, const Channels& channels, MergeObserver* observer) {
  std::deque<Contribution> made;
  std::vector<Layered> all = merge_within_layers(clip, channels, made, observer != nullptr);
  const bool several = std::any_of(clip.contributions.begin(), clip.contributions.end(), [&](const Contribution& c) {
    return c.layer != clip.contributions.front().layer || c.stated != clip.contributions.front().stated;
  });
  if (several) {
    yield_to_language(all, channels);
    share_slots(all, channels);
    scale_antagonists(all, channels);
  }
  std::vector<MergedCurve> out;
  out.reserve(all.size());
  for (Layered& l : all) {
    const ChannelInfo& channel = channels.channels[l.channel];
    out.push_back({l.channel, join_layers(l, channel, channels.tracks[channel.track].layers)});
    simplify(out.back().curve);
  }
  hide(out, all, channels);
  if (observer != nullptr)
    for (const Layered& l : all) {
      (*l.notes)[Layered::kFirst].tell(*observer);
      for (std::size_t layer = 0; layer <= kLayerCount; ++layer) (*l.notes)[layer].tell(*observer);
      (*l.notes)[Layered::kLast].tell(*observer);
    }
  return out;
}

}  // namespace nms::compiler
