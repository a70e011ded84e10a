#include "merge.h"

#include <algorithm>
#include <deque>

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

Curve merge_group(std::vector<const Contribution*> group, const ChannelInfo& channel, program::MergeOperator op,
                  std::deque<Contribution>& made, MergeObserver* observer) {
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

Curve merge_channel(const std::vector<const Contribution*>& all, const ChannelInfo& channel, program::MergeOperator op,
                    std::deque<Contribution>& made, MergeObserver* observer) {
  std::vector<const Contribution*> layer[kLayerCount];
  std::vector<const Contribution*> stated;
  const std::vector<bool> repeats = repeats_of_another(all);
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (repeats[i]) {
      if (observer != nullptr) observer->repeated(*all[i]);
      continue;
    }
    if (all[i]->stated)
      stated.push_back(all[i]);
    else
      layer[static_cast<int>(all[i]->layer)].push_back(all[i]);
  }
  Curve base;
  for (const auto& group : layer) {
    if (group.empty()) continue;
    const Curve c = merge_group(group, channel, op, made, observer);
    if (base.empty())
      base = c;
    else
      base = channel.is_axis() ? add(base, c) : either(base, c);
    if (observer != nullptr) observer->layers(group.front()->layer, base);
  }
  if (!stated.empty()) {
    const Curve over = merge_group(stated, channel, op, made, observer);
    if (base.empty()) {
      base = over;
    } else {
      std::vector<Curve> envelopes;
      envelopes.reserve(stated.size());
      for (const Contribution* c : stated) envelopes.push_back(c->envelope);
      const Curve envelope = join_all(std::move(envelopes), maximum);
      base = replaced(base, over, envelope);
      if (observer != nullptr) observer->replaced(envelope, base);
    }
  }
  return clamped(base, channel.low(), 1.0);
}

}  // namespace

std::vector<MergedCurve> merge(const ClipDraft& clip, const Channels& channels, MergeObserver* observer) {
  std::vector<const Contribution*> order;
  order.reserve(clip.contributions.size());
  for (const Contribution& c : clip.contributions) order.push_back(&c);
  std::stable_sort(order.begin(), order.end(),
                   [](const Contribution* a, const Contribution* b) { return a->channel < b->channel; });
  std::vector<MergedCurve> out;
  for (std::size_t i = 0; i < order.size();) {
    std::size_t j = i;
    while (j < order.size() && order[j]->channel == order[i]->channel) ++j;
    const ChannelInfo& channel = channels.channels[order[i]->channel];
    const program::MergeOperator op = channels.tracks[channel.track].merge;
    MergedCurve merged{order[i]->channel, {}};
    if (j - i == 1 && observer == nullptr) {
      merged.curve = clamped(order[i]->curve, channel.low(), 1.0);
    } else {
      std::vector<const Contribution*> all(order.begin() + static_cast<std::ptrdiff_t>(i),
                                           order.begin() + static_cast<std::ptrdiff_t>(j));
      if (observer != nullptr) observer->channel(merged.channel, all);
      std::deque<Contribution> made;
      end_held(all, made, observer);
      merged.curve = merge_channel(all, channel, op, made, observer);
    }
    simplify(merged.curve);
    out.push_back(std::move(merged));
    i = j;
  }
  return out;
}

}  // namespace nms::compiler
