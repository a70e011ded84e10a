#include "merge.h"

#include <algorithm>

namespace nms::compiler {
namespace {

/// The same motion asked for twice is one: a swing whose time lies within another's of the same name is left out.
bool repeats_another(const std::vector<const Contribution*>& all, std::size_t index) {
  const Contribution& c = *all[index];
  if (c.motion.empty()) return false;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Contribution& other = *all[i];
    if (i == index || other.motion != c.motion || other.stated != c.stated) continue;
    if (other.start_ns > c.start_ns || other.end_ns < c.end_ns) continue;
    if (other.start_ns == c.start_ns && other.end_ns == c.end_ns && i > index) continue;
    return true;
  }
  return false;
}

Curve merge_group(std::vector<const Contribution*> group, const ChannelInfo& channel, program::MergeOperator op) {
  Curve out;
  if (op == program::MergeOperator::latest) {
    std::stable_sort(group.begin(), group.end(),
                     [](const Contribution* a, const Contribution* b) { return a->start_ns < b->start_ns; });
    for (const Contribution* c : group) out = out.empty() ? c->curve : replaced(out, c->curve, c->envelope);
  } else if (op == program::MergeOperator::sum || channel.is_axis()) {
    for (const Contribution* c : group) out = add(out, c->curve);
  } else {
    for (const Contribution* c : group) out = maximum(out, c->curve);
  }
  return clamped(out, channel.low(), 1.0);
}

Curve merge_channel(const std::vector<const Contribution*>& all, const ChannelInfo& channel, program::MergeOperator op) {
  std::vector<const Contribution*> layer[kLayerCount];
  std::vector<const Contribution*> stated;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (repeats_another(all, i)) continue;
    if (all[i]->stated) stated.push_back(all[i]);
    else layer[static_cast<int>(all[i]->layer)].push_back(all[i]);
  }
  Curve base;
  for (const auto& group : layer) {
    if (group.empty()) continue;
    const Curve c = merge_group(group, channel, op);
    if (base.empty()) base = c;
    else base = channel.is_axis() ? add(base, c) : either(base, c);
  }
  if (!stated.empty()) {
    const Curve over = merge_group(stated, channel, op);
    if (base.empty()) {
      base = over;
    } else {
      Curve weight;
      for (const Contribution* c : stated) weight = maximum(weight, c->envelope);
      base = replaced(base, over, weight);
    }
  }
  return clamped(base, channel.low(), 1.0);
}

}  // namespace

std::vector<MergedCurve> merge(const ClipDraft& clip, const Channels& channels) {
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
    MergedCurve merged{order[i]->channel, {}};
    if (j - i == 1) {
      merged.curve = clamped(order[i]->curve, channel.low(), 1.0);
    } else {
      merged.curve = merge_channel({order.begin() + static_cast<std::ptrdiff_t>(i), order.begin() + static_cast<std::ptrdiff_t>(j)},
                                   channel, channels.tracks[channel.track].merge);
    }
    simplify(merged.curve);
    out.push_back(std::move(merged));
    i = j;
  }
  return out;
}

}  // namespace nms::compiler
