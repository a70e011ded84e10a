#include "competition.h"

#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include <nms/compiler/diagnostic_kinds.h>

#include "curve_course.h"
#include "lower_entry.h"

namespace nms::compiler {

using lang::NodeKind;
using lang::NodeRef;

namespace {

std::string seconds(std::int64_t ns) { return fmt::format("{:.4g}s", static_cast<double>(ns) / 1e9); }

/// Whether the second is over a span that comes after the first one's.
bool follows(const DraftCause& first, const DraftCause& second) { return first.span.end_ns <= second.span.start_ns; }

/// A cause that a sentence type or a topic brings about: two of them cannot want contrary things of one face.
bool clause_level(const DraftCause& cause, Layer layer) {
  if (cause.entry == nullptr || layer != Layer::syntactic) return false;
  const std::string_view spreads = spreading_of(*cause.entry);
  return spreads == "clause" || spreads == "topic";
}

/// Poses by channel and layer, and in order of the spans they are over.
class PosesInOrder {
 public:
  explicit PosesInOrder(const ClipDraft& clip) : clip_(clip) {
    for (std::uint32_t i = 0; i < clip.contributions.size(); ++i)
      if (clip.contributions[i].joins() && clip.contributions[i].cause != kUnreachable) order_.push_back(i);
    std::sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) {
      return std::tuple(key(clip_.contributions[a]), a) < std::tuple(key(clip_.contributions[b]), b);
    });
  }

  /// The next pose of a channel in a layer whose span begins at or after a time. Null: there is none.
  const Contribution* next(std::uint32_t channel, Layer layer, bool stated, std::int64_t time_ns) const {
    constexpr std::int64_t kFirst = std::numeric_limits<std::int64_t>::min();
    const std::tuple wanted(channel, layer, stated, time_ns, kFirst, kFirst);
    const auto it = std::lower_bound(order_.begin(), order_.end(), wanted,
                                     [&](std::uint32_t i, const auto& w) { return key(clip_.contributions[i]) < w; });
    if (it == order_.end()) return nullptr;
    const Contribution& c = clip_.contributions[*it];
    return c.channel == channel && c.layer == layer && c.stated == stated ? &c : nullptr;
  }

 private:
  std::tuple<std::uint32_t, Layer, bool, std::int64_t, std::int64_t, std::int64_t> key(const Contribution& c) const {
    return {c.channel, c.layer, c.stated, clip_.causes[c.cause].span.start_ns, c.start_ns, c.apex_ns};
  }
  const ClipDraft& clip_;
  std::vector<std::uint32_t> order_;
};

/// When a pose is to let go, and when it is to be at rest.
struct LetGo {
  std::int64_t release_ns;
  std::int64_t end_ns;
};

void let_go(Contribution& c, const LetGo& times, ClipDraft& clip) {
  for (Curve* curve : {&c.curve, &c.envelope}) {
    *curve = until(*curve, times.release_ns);
    if (!curve->empty())
      ease_to(*curve, times.end_ns, 0.0, curve == &c.envelope ? settled(c.easing) : c.easing,
              curve->knots.back().source);
  }
  c.release_ns = times.release_ns;
  c.end_ns = times.end_ns;
  if (c.marker == kUnreachable) return;
  clip.markers[c.marker + 2].time_ns = times.release_ns;
  clip.markers[c.marker + 3].time_ns = times.end_ns;
}

}  // namespace

void give_way(ClipDraft& clip, const Channels& channels) {
  if (clip.causes.size() < 2) return;
  const PosesInOrder poses(clip);
  std::vector<std::pair<std::uint32_t, LetGo>> found;
  for (std::uint32_t i = 0; i < clip.contributions.size(); ++i) {
    const Contribution& c = clip.contributions[i];
    if (!c.joins() || c.held || c.cause == kUnreachable) continue;
    const DraftCause& cause = clip.causes[c.cause];
    LetGo times{c.release_ns, c.end_ns};
    const auto consider = [&](const std::vector<Related>& all, bool entries_only) {
      if (entries_only && cause.entry == nullptr) return;
      for (const Related& r : all)
        for (std::uint32_t channel = r.first; channel <= r.last; ++channel) {
          const Contribution* next = poses.next(channel, c.layer, c.stated, cause.span.end_ns);
          if (next == nullptr || next->start_ns >= c.end_ns || next->apex_ns <= c.apex_ns) continue;
          if (entries_only && clip.causes[next->cause].entry == nullptr) continue;
          times.release_ns = std::min(times.release_ns, std::max(c.apex_ns, next->start_ns));
          times.end_ns = std::min(times.end_ns, next->apex_ns);
        }
    };
    const ChannelInfo& channel = channels.channels[c.channel];
    consider(channel.antagonists, false);
    consider(channel.contrary, true);
    if (times.end_ns < c.end_ns || times.release_ns < c.release_ns) found.emplace_back(i, times);
  }
  for (const auto& [i, times] : found)
    let_go(clip.contributions[i], {std::min(times.release_ns, times.end_ns), times.end_ns}, clip);
}

namespace {

class Competition {
 public:
  Competition(const ClipDraft& clip, const Scope& scope, Evaluator& evaluator)
      : clip_(clip), scope_(scope), evaluator_(evaluator), channels_(evaluator.channels().channels) {}

  void check() {
    for (const Contribution& c : clip_.contributions) lasts(c);
    if (clip_.causes.size() < 2) return;
    for (std::uint32_t c = 0; c < clip_.contributions.size(); ++c)
      of_channel_[clip_.contributions[c].channel].push_back(c);
    for (const auto& [channel, own] : of_channel_) {
      for (const Related& r : channels_[channel].antagonists) related(channel, r, false);
      for (const Related& r : channels_[channel].contrary) related(channel, r, true);
    }
    classes();
    order();
    exclusions();
  }

 private:
  /// One cause's unit, where it is as strong as meant.
  struct Held {
    TimeRange range;
    std::uint32_t contribution;
    bool other;
  };

  void collect(std::uint32_t channel, double least, bool other, bool clause_only, std::vector<Held>& into) const {
    const auto it = of_channel_.find(channel);
    if (it == of_channel_.end()) return;
    for (const std::uint32_t i : it->second) {
      const Contribution& c = clip_.contributions[i];
      if (c.cause == kUnreachable || (clause_only && !clause_level(clip_.causes[c.cause], c.layer))) continue;
      for (const TimeRange& range : ranges_at_least(c.curve, least)) into.push_back({range, i, other});
    }
  }

  /// Each pair of causes that hold a unit and its counterpart at once; each relation is looked at from one side.
  void related(std::uint32_t channel, const Related& r, bool clause_only) {
    if (r.first < channel) return;
    std::vector<Held> all;
    collect(channel, r.least, false, clause_only, all);
    if (all.empty()) return;
    for (std::uint32_t c = r.first; c <= r.last; ++c) collect(c, r.least, true, clause_only, all);
    // Layer by layer, in order of time; those still held are found by when they end.
    const auto layer = [&](const Held& h) {
      const Contribution& c = clip_.contributions[h.contribution];
      return std::pair(c.layer, c.stated);
    };
    std::stable_sort(all.begin(), all.end(), [&](const Held& a, const Held& b) {
      return std::pair(layer(a), a.range.start_ns) < std::pair(layer(b), b.range.start_ns);
    });
    std::multimap<std::int64_t, Held> open[2];
    for (std::size_t i = 0; i < all.size(); ++i) {
      const Held& now = all[i];
      for (auto& side : open)
        if (i > 0 && layer(all[i - 1]) != layer(now))
          side.clear();
        else
          side.erase(side.begin(), side.upper_bound(now.range.start_ns));
      for (const auto& [end, h] : open[now.other ? 0 : 1]) {
        if (++examined_ > kMostExamined || said_.size() >= kMostSaid) return;
        against(h, now, clause_only);
      }
      open[now.other ? 1 : 0].emplace(now.range.end_ns, now);
    }
  }

  void against(const Held& earlier, const Held& later, bool clause_only) {
    const Contribution& a = clip_.contributions[earlier.contribution];
    const Contribution& b = clip_.contributions[later.contribution];
    if (a.cause == b.cause) return;
    const DraftCause& first = clip_.causes[a.cause];
    const DraftCause& second = clip_.causes[b.cause];
    if (follows(first, second) || follows(second, first)) return;
    const auto said = std::minmax(a.cause, b.cause);
    if (!said_.insert({said.first, said.second, clause_only}).second) return;
    const std::string from = seconds(later.range.start_ns);
    const std::string to = seconds(std::min(earlier.range.end_ns, later.range.end_ns));
    // Sides say nothing where the units differ: it is the same one.
    const ChannelInfo &x = channels_[a.channel], &y = channels_[b.channel];
    const std::string unit = x.au == y.au ? x.name : fmt::format("AU{}", x.au);
    const std::string other = x.au == y.au ? y.name : fmt::format("AU{}", y.au);
    if (clause_only)
      report(first, second,
             CompetingMarkers{std::string(first.name), std::string(second.name), fmt::format("{} and {}", unit, other),
                              from, to},
             fmt::format("{} holds {}", first.name, unit));
    else
      report(first, second, Antagonists{std::string(first.name), unit, std::string(second.name), other, from, to},
             fmt::format("{} holds {}", first.name, unit));
  }

  template <typename Kind>
  void report(const DraftCause& first, const DraftCause& second, const Kind& kind, std::string label) {
    if (!second.node) return;
    lang::Diagnostic& d = evaluator_.report(scope_, second.node, kind);
    if (first.node) d.labels = {{first.node.tree().source_pointer(), first.node.range(), std::move(label)}};
  }

  void lasts(const Contribution& c) {
    const ChannelInfo& channel = channels_[c.channel];
    if (channel.longest_ns == 0) return;
    for (const TimeRange& range : ranges_at_least(c.curve, kTrace)) {
      if (range.end_ns - range.start_ns <= channel.longest_ns) continue;
      NodeRef node = c.cause == kUnreachable ? NodeRef() : clip_.causes[c.cause].node;
      const std::uint32_t source = c.curve.knots.front().source;
      if (!node && source < clip_.sources.size()) node = clip_.sources[source].node;
      evaluator_.report(scope_, node,
                        LastsTooLong{fmt::format("AU{}", channel.au), seconds(range.end_ns - range.start_ns),
                                     seconds(channel.longest_ns), channel.beyond_longest});
      return;
    }
  }

  /// What an entry says of others beside it, read once however often it is used.
  struct Company {
    struct Class {
      std::string_view name;
      std::size_t most = 0;  ///< 0: not at once
    };
    std::vector<Class> competes;
    std::vector<std::string_view> before;
    std::vector<std::string_view> excludes;
  };

  const Company& company(const Declaration& entry) {
    const auto [it, added] = companies_.try_emplace(&entry);
    if (!added) return it->second;
    for (NodeRef p : entry.node.children()) {
      if (!is_property(p)) continue;
      const std::string_view name = p.at(0).text();
      if (name == "competes" && p.at(1)) {
        const auto most = p.at(2) ? lang::read_quantity(p.at(2).text()) : std::nullopt;
        it->second.competes.push_back({p.at(1).text(), most ? static_cast<std::size_t>(most->value) : 0});
      }
      const bool excludes = name == "excludes" && p.at(1) && p.at(1).text() != "sign";  // signs: schedule_entry
      if (name != "before" && !excludes) continue;
      bool first = true;
      for (NodeRef other : p.children())
        if (!std::exchange(first, false)) (excludes ? it->second.excludes : it->second.before).push_back(other.text());
    }
    return it->second;
  }

  /// `competes stance`: not at once. `competes topics 2x`: not more than that in one utterance.
  void classes() {
    struct Class {
      std::size_t most = 0;
      std::vector<std::uint32_t> causes;
    };
    std::map<std::pair<std::uint32_t, std::string_view>, Class> all;  // of one utterance
    for (std::uint32_t i = 0; i < clip_.causes.size(); ++i) {
      if (clip_.causes[i].entry == nullptr) continue;
      for (const Company::Class& own : company(*clip_.causes[i].entry).competes) {
        if (++examined_ > kMostExamined) return;
        Class& c = all[{clip_.causes[i].utterance, own.name}];
        c.causes.push_back(i);
        if (own.most > 0) c.most = own.most;
      }
    }
    for (auto& [where, c] : all) {
      const std::string name(where.second);
      std::stable_sort(c.causes.begin(), c.causes.end(), [&](std::uint32_t a, std::uint32_t b) {
        return clip_.causes[a].span.start_ns < clip_.causes[b].span.start_ns;
      });
      if (c.most > 0) {
        if (c.causes.size() > c.most)
          report(clip_.causes[c.causes.front()], clip_.causes[c.causes[c.most]],
                 TooManyUses{name, fmt::format("{}", c.causes.size()), fmt::format("{}", c.most)}, "the first of them");
        continue;
      }
      const DraftCause* longest = nullptr;
      for (const std::uint32_t i : c.causes) {
        const DraftCause& now = clip_.causes[i];
        if (longest != nullptr && now.span.start_ns < longest->span.end_ns)
          report(*longest, now,
                 CompetingMarkers{std::string(longest->name), std::string(now.name), name, seconds(now.span.start_ns),
                                  seconds(std::min(now.span.end_ns, longest->span.end_ns))},
                 "over this too");
        if (longest == nullptr || now.span.end_ns > longest->span.end_ns) longest = &now;
      }
    }
  }

  /// `before topic`: wherever both are, this one is the first.
  void order() {
    std::map<std::pair<std::uint32_t, std::string_view>, const DraftCause*> earliest;
    for (const DraftCause& c : clip_.causes) {
      if (c.entry == nullptr) continue;
      const DraftCause*& first = earliest[{c.utterance, c.entry->name}];
      if (first == nullptr || c.span.start_ns < first->span.start_ns) first = &c;
    }
    for (const DraftCause& c : clip_.causes) {
      if (c.entry == nullptr) continue;
      for (const std::string_view other : company(*c.entry).before) {
        if (++examined_ > kMostExamined) return;
        const auto it = earliest.find({c.utterance, other});
        if (it == earliest.end() || it->second == &c || it->second->span.start_ns >= c.span.start_ns) continue;
        report(*it->second, c, OutOfOrder{std::string(c.name), std::string(it->second->name)}, "this stands first");
      }
    }
  }

  /// `excludes neg`: not while this one is there. Of several that are, the first is named.
  void exclusions() {
    std::map<std::pair<std::uint32_t, std::string_view>, std::vector<const DraftCause*>> uses;
    bool any = false;
    for (const DraftCause& c : clip_.causes) {
      if (c.entry == nullptr) continue;
      uses[{c.utterance, c.entry->name}].push_back(&c);
      any = any || !company(*c.entry).excludes.empty();
    }
    if (!any) return;
    for (const DraftCause& c : clip_.causes) {
      if (c.entry == nullptr) continue;
      for (const std::string_view other : company(*c.entry).excludes) {
        const auto it = uses.find({c.utterance, other});
        if (it == uses.end()) continue;
        for (const DraftCause* use : it->second) {
          if (++examined_ > kMostExamined) return;
          const std::int64_t from = std::max(use->span.start_ns, c.span.start_ns);
          const std::int64_t to = std::min(use->span.end_ns, c.span.end_ns);
          if (use == &c || from >= to) continue;
          report(c, *use, ExcludedEntry{std::string(use->name), std::string(c.name), seconds(from), seconds(to)},
                 "this excludes it");
          break;
        }
      }
    }
  }

  /// What counts as seen at all: half of FACS A.
  static constexpr double kTrace = 0.1;
  /// Pairs and names that are looked at in one clip: what is past that is not reported, so that no source takes
  /// minutes.
  static constexpr std::size_t kMostExamined = 1'000'000;
  static constexpr std::size_t kMostSaid = 1'000;

  const ClipDraft& clip_;
  const Scope& scope_;
  Evaluator& evaluator_;
  const std::vector<ChannelInfo>& channels_;
  std::map<std::uint32_t, std::vector<std::uint32_t>> of_channel_;
  std::set<std::tuple<std::uint32_t, std::uint32_t, bool>> said_;
  std::map<const Declaration*, Company> companies_;
  std::size_t examined_ = 0;
};

}  // namespace

void check_competition(const ClipDraft& clip, const Scope& scope, Evaluator& evaluator) {
  Competition(clip, scope, evaluator).check();
}

}  // namespace nms::compiler
