#include "manual_tier.h"

#include <algorithm>
#include <string>
#include <unordered_set>

#include <nms/compiler/diagnostic_kinds.h>

namespace nms::compiler {

using lang::NodeKind;
using lang::NodeRef;

namespace {

/// Medians of ASL signs, gaps between signs, and utterance-final signs (NCSLGR corpus).
constexpr std::int64_t kSignNs = 233'000'000;
constexpr std::int64_t kGapNs = 100'000'000;
constexpr std::int64_t kFinalSignNs = 400'000'000;

class TierBuilder {
 public:
  TierBuilder(const Scope& scope, Evaluator& evaluator) : scope_(scope), evaluator_(evaluator) {}

  ManualTier build(NodeRef utterance) {
    for (const bool non_dominant : {false, true}) {
      const std::uint32_t first = static_cast<std::uint32_t>(tier_.signs.size());
      timed_ = untimed_ = 0;
      for (NodeRef child : utterance.children()) {
        if (!child.is(NodeKind::signs) || child.has(lang::kFlagNonDominant) != non_dominant) continue;
        for (NodeRef item : child.children()) add(item, non_dominant);
      }
      place(first);
      check(first);
      if (!non_dominant) tier_.dominant_count = static_cast<std::uint32_t>(tier_.signs.size());
    }
    return std::move(tier_);
  }

 private:
  void add(NodeRef item, bool non_dominant) {
    if (item.is(NodeKind::bracket)) {
      Bracket bracket;
      bracket.node = item;
      const NodeRef label = item.at(0);
      bracket.label = label ? unquoted(label) : std::string_view();
      bracket.first = static_cast<std::uint32_t>(tier_.signs.size());
      const std::size_t index = tier_.brackets.size();
      tier_.brackets.push_back(bracket);
      for (NodeRef inner : item.children())
        if (inner.is(NodeKind::bracket) || inner.is(NodeKind::sign)) add(inner, non_dominant);
      if (tier_.signs.size() > tier_.brackets[index].first) {
        tier_.brackets[index].last = static_cast<std::uint32_t>(tier_.signs.size()) - 1;
        tier_.brackets[index].empty = false;
      } else {
        evaluator_.report(scope_, item, NoSigns{std::string(bracket.label)});
      }
      return;
    }
    if (!item.is(NodeKind::sign)) return;
    Sign sign;
    sign.node = item;
    sign.non_dominant = non_dominant;
    if (const NodeRef gloss = item.child(NodeKind::gloss)) sign.gloss = unquoted(gloss);
    if (const NodeRef tag = item.child(NodeKind::tag); tag && tag.at(0)) sign.tag = tag.at(0).text();
    if (const NodeRef alias = item.child(NodeKind::alias); alias && alias.at(0)) sign.alias = alias.at(0).text();
    if (const NodeRef time = item.child(NodeKind::sign_time)) {
      ++timed_;
      std::int64_t value[3] = {0, 0, 0};
      int count = 0;
      for (NodeRef q : time.children()) {
        if (!q.is(NodeKind::quantity) || count == 3) continue;
        const auto quantity = evaluator_.quantity(q, lang::Unit::time, scope_);
        value[count++] = quantity ? quantity->nanoseconds : 0;
      }
      sign.start_ns = value[0];
      sign.stroke_end_ns = value[1];
      sign.end_ns = count == 3 ? value[2] : value[1];
    } else {
      ++untimed_;
    }
    tier_.signs.push_back(sign);
  }

  void place(std::uint32_t first) {
    if (timed_ != 0) return;
    std::int64_t at = 0;
    for (std::size_t i = first; i < tier_.signs.size(); ++i) {
      Sign& s = tier_.signs[i];
      s.start_ns = at;
      s.stroke_end_ns = s.end_ns = at + (i + 1 == tier_.signs.size() ? kFinalSignNs : kSignNs);
      at = s.end_ns + kGapNs;
    }
  }

  void check(std::uint32_t first) {
    if (timed_ != 0 && untimed_ != 0) {
      for (std::size_t i = first; i < tier_.signs.size(); ++i)
        if (!tier_.signs[i].node.child(NodeKind::sign_time)) {
          evaluator_.report(scope_, tier_.signs[i].node,
                            SignTimes{std::string(tier_.signs[i].gloss), "are missing, and other signs have theirs"});
          break;
        }
      timed_ = 0;
      place(first);
      return;
    }
    for (std::size_t i = first; i < tier_.signs.size(); ++i) {
      Sign& s = tier_.signs[i];
      if (!s.alias.empty() && !aliases_.emplace(s.alias).second)
        evaluator_.report(scope_, s.node.child(NodeKind::alias), DuplicateName{"sign", std::string(s.alias)});
      const char* reason = nullptr;
      if (s.stroke_end_ns <= s.start_ns)
        reason = "end before they start";
      else if (s.end_ns < s.stroke_end_ns)
        reason = "hold the sign until before it ends";
      else if (i > first && s.start_ns < tier_.signs[i - 1].start_ns)
        reason = "are before those of the sign in front of it";
      if (reason == nullptr) continue;
      evaluator_.report(scope_, s.node, SignTimes{std::string(s.gloss), reason});
      // In order from here on, so that nothing placed by this sign is complained of too.
      if (i > first) s.start_ns = std::max(s.start_ns, tier_.signs[i - 1].start_ns);
      if (s.stroke_end_ns <= s.start_ns) s.stroke_end_ns = s.start_ns + kFinalSignNs;
      s.end_ns = std::max(s.end_ns, s.stroke_end_ns);
    }
  }

  const Scope& scope_;
  Evaluator& evaluator_;
  ManualTier tier_;
  std::unordered_set<std::string_view> aliases_;
  int timed_ = 0;
  int untimed_ = 0;
};

}  // namespace

ManualTier build_manual_tier(NodeRef utterance, const Scope& scope, Evaluator& evaluator) {
  return TierBuilder(scope, evaluator).build(utterance);
}

}  // namespace nms::compiler
