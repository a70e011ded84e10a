#include "combine.h"

#include <algorithm>
#include <set>
#include <string>
#include <utility>

#include <fmt/format.h>

#include <nms/compiler/diagnostic_kinds.h>

#include "merge.h"

namespace nms::compiler {

using lang::NodeKind;
using lang::NodeRef;

namespace {

/// Knots that rules may add to one clip: no two entries meet that often.
constexpr std::size_t kMaxKnots = 2'000'000;

/// The two names of a `combine`.
std::pair<NodeRef, NodeRef> pair_of(NodeRef combine) {
  NodeRef first;
  for (NodeRef c : combine.children()) {
    if (!c.is(NodeKind::name)) continue;
    if (first) return {first, c};
    first = c;
  }
  return {first, {}};
}

std::uint32_t find_track(const Channels& channels, std::string_view name) {
  for (std::uint32_t i = 0; i < channels.tracks.size(); ++i)
    if (channels.tracks[i].name == name) return i;
  return kUnreachable;
}

/// The rules of a `combine` whose names are sound: others are reported where they are declared.
void rules_of(NodeRef combine, const Declaration& a, const Declaration& b, const Channels& channels,
              const Declarations& all, std::uint32_t lexicon, std::vector<CombineRule>& out) {
  for (NodeRef r : combine.children()) {
    if (!r.is(NodeKind::combine_rule) || r.has(lang::kFlagError)) continue;
    const Declaration* from = all.find_entry(r.at(1).text(), lexicon);
    const std::uint32_t track = find_track(channels, r.at(0).text());
    if (track == kUnreachable || (from != &a && from != &b)) continue;
    out.push_back({from == &a ? &b : &a, from, track, r});
  }
}

std::vector<CombineRule> rules(std::uint32_t lexicon, const Channels& channels, const Declarations& all) {
  std::vector<CombineRule> out;
  std::set<std::pair<const Declaration*, const Declaration*>> seen;
  for (std::uint32_t at = lexicon; at != kUnreachable; at = all.lexicons[at].extends)
    for (const NodeRef combine : all.lexicons[at].combinations) {
      if (combine.has(lang::kFlagError)) continue;
      const auto [first, second] = pair_of(combine);
      const Declaration* a = all.find_entry(first.text(), lexicon);
      const Declaration* b = all.find_entry(second.text(), lexicon);
      if (a == nullptr || b == nullptr || a == b) continue;  // one of them has been removed
      if (!seen.insert(std::minmax(a, b)).second) continue;  // a nearer lexicon says otherwise
      rules_of(combine, *a, *b, channels, all, lexicon, out);
    }
  return out;
}

/// `w` as far as it touches the time from `begin` to `end`: outside its knots the first and the last value hold.
Curve part_of(const Curve& w, std::int64_t begin, std::int64_t end) {
  const auto before = [](const CurveKnot& k, std::int64_t t) { return k.time_ns < t; };
  const auto after = [](std::int64_t t, const CurveKnot& k) { return t < k.time_ns; };
  auto first = std::upper_bound(w.knots.begin(), w.knots.end(), begin, after);
  auto last = std::lower_bound(w.knots.begin(), w.knots.end(), end, before);
  if (first != w.knots.begin()) --first;
  if (last != w.knots.end()) ++last;
  return {{first, last}};
}

/// `w` over the apex of what gives way; its ends hold through onset and offset, as a profile's do.
Curve over_apex(const Curve& w, const Contribution& c) {
  if (!c.pose || c.apex_ns > c.release_ns) return w;
  const Curve ended = c.held ? w : until(w, c.release_ns);
  return ended.empty() ? Curve{{w.knots.front()}} : since(ended, c.apex_ns);
}

/// c (1 - w), no longer than c.
Curve without(const Curve& c, const Curve& w, bool held) {
  if (c.empty()) return c;
  const std::int64_t begin = c.knots.front().time_ns;
  const std::int64_t end = held ? std::max(c.knots.back().time_ns, w.knots.back().time_ns) : c.knots.back().time_ns;
  Curve out = replaced(c, {}, part_of(w, begin, end));
  std::erase_if(out.knots, [&](const CurveKnot& k) { return k.time_ns < begin || k.time_ns > end; });
  return out;
}

}  // namespace

bool combine(ClipDraft& clip, const std::vector<CombineRule>& rules, const Channels& channels) {
  const auto meant = [&](const Contribution& c, const Declaration* entry, std::uint32_t track) {
    const bool of_it = c.cause < clip.causes.size() && clip.causes[c.cause].entry == entry;
    return of_it && channels.channels[c.channel].track == track && !c.curve.empty();
  };
  /// What gives way, and to what; applied once all are known.
  struct Pair {
    std::size_t contribution;
    std::size_t taking;
    const CombineRule* rule;
  };
  std::vector<Pair> pairs;
  std::vector<Curve> takings;
  for (const CombineRule& rule : rules) {
    std::vector<Curve> envelopes;
    for (const Contribution& c : clip.contributions)
      if (meant(c, rule.takes, rule.track)) envelopes.push_back(c.envelope);
    if (envelopes.empty()) continue;
    takings.push_back(strongest_of(std::move(envelopes)));
    const Curve& w = takings.back();
    for (std::size_t i = 0; i < clip.contributions.size(); ++i) {
      const Contribution& c = clip.contributions[i];
      if (!meant(c, rule.yields, rule.track)) continue;
      const bool meets = w.knots.front().time_ns < c.end_ns && c.start_ns < w.knots.back().time_ns;
      if (meets || (c.held && c.start_ns < w.knots.back().time_ns)) pairs.push_back({i, takings.size() - 1, &rule});
    }
  }
  std::size_t knots = 0;
  for (const Pair& p : pairs) {
    Contribution& c = clip.contributions[p.contribution];
    Curve w = over_apex(takings[p.taking], c);
    c.curve = without(c.curve, w, c.held);
    c.envelope = without(c.envelope, w, c.held);
    knots += c.curve.knots.size() + c.envelope.knots.size() + w.knots.size();
    clip.givings.push_back({p.rule->node, p.rule->takes, std::move(w), c.gave_way});
    c.gave_way = static_cast<std::uint32_t>(clip.givings.size() - 1);
    if (knots > kMaxKnots) return false;
  }
  return true;
}

void combine(ClipDraft& clip, std::uint32_t lexicon, const Scope& scope, Evaluator& evaluator) {
  if (lexicon == kUnreachable) return;
  const Channels& channels = evaluator.channels();
  if (!combine(clip, rules(lexicon, channels, evaluator.declarations()), channels))
    evaluator.report(scope, clip.givings.back().rule,
                     TooLarge{"the number of knots in one clip", fmt::format("{}", kMaxKnots)});
}

void check_combinations(Evaluator& evaluator) {
  const Declarations& all = evaluator.declarations();
  const Channels& channels = evaluator.channels();
  std::vector<std::string> tracks;
  for (const TrackInfo& t : channels.tracks) tracks.push_back(t.name);
  for (std::uint32_t l = 0; l < all.lexicons.size(); ++l) {
    Scope scope;
    scope.file = all.lexicons[l].declaration.file;
    if (!evaluator.files()[scope.file].root) continue;
    std::set<std::pair<const Declaration*, const Declaration*>> seen;
    const auto entry = [&](NodeRef name) {
      const Declaration* e = all.find_entry(name.text(), l);
      if (e == nullptr)
        evaluator.report(scope, name,
                         UnknownName{"entry", std::string(name.text()),
                                     evaluator.similar(name.text(), [&] { return all.entry_names(l); })});
      return e;
    };
    for (const NodeRef combine : all.lexicons[l].combinations) {
      if (combine.has(lang::kFlagError)) continue;
      const auto [first, second] = pair_of(combine);
      const Declaration* a = entry(first);
      const Declaration* b = entry(second);
      if (a != nullptr && a == b)
        evaluator.report(scope, second,
                         WrongKind{std::string(second.text()), "the same entry", "another",
                                   "uses of one entry are merged by the operators of their tracks"});
      else if (a != nullptr && b != nullptr && !seen.insert(std::minmax(a, b)).second)
        evaluator.report(scope, second,
                         DuplicateName{"combination", fmt::format("{} with {}", first.text(), second.text())});
      std::set<std::string_view> said;
      for (NodeRef r : combine.children()) {
        if (!r.is(NodeKind::combine_rule) || r.has(lang::kFlagError)) continue;
        const std::string_view track = r.at(0).text();
        if (find_track(channels, track) == kUnreachable)
          evaluator.report(scope, r.at(0), UnknownName{"track", std::string(track), lang::nearest(track, tracks)});
        else if (!said.insert(track).second)
          evaluator.report(scope, r.at(0), DuplicateName{"rule", std::string(track)});
        const Declaration* from = all.find_entry(r.at(1).text(), l);
        if (a != nullptr && b != nullptr && (from == nullptr || (from != a && from != b)))
          evaluator.report(
              scope, r.at(1),
              UnknownName{"entry in this pair", std::string(r.at(1).text()),
                          lang::nearest(r.at(1).text(), {std::string(first.text()), std::string(second.text())})});
      }
    }
  }
}

}  // namespace nms::compiler
