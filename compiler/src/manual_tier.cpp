#include "manual_tier.h"

#include <algorithm>
#include <optional>
#include <string>
#include <unordered_map>
#include <unordered_set>

#include <fmt/format.h>

#include <nms/compiler/diagnostic_kinds.h>

namespace nms::compiler {

using lang::NodeKind;
using lang::NodeRef;

namespace {

/// Medians of ASL signs, gaps between signs, and utterance-final signs (NCSLGR corpus).
constexpr std::int64_t kSignNs = 233'000'000;
constexpr std::int64_t kGapNs = 100'000'000;
constexpr std::int64_t kFinalSignNs = 400'000'000;
/// Least room for a sign whose times nobody gives: a frame at 50 Hz.
constexpr std::int64_t kLeastSignNs = 20'000'000;

class TierBuilder {
 public:
  TierBuilder(const Scope& scope, Evaluator& evaluator) : scope_(scope), evaluator_(evaluator) {}

  ManualTier build(NodeRef utterance) {
    for (const bool non_dominant : {false, true}) {
      const std::uint32_t first = static_cast<std::uint32_t>(tier_.signs.size());
      timed_ = untimed_ = 0;
      from_outside_ = crowded_ = false;
      for (NodeRef child : utterance.children()) {
        if (!child.is(NodeKind::signs) || child.has(lang::kFlagNonDominant) != non_dominant) continue;
        for (NodeRef item : child.children()) add(item, non_dominant);
      }
      name_signs(first);
      time_from_outside(first, non_dominant);
      if (untimed_ != 0 && timed_ != 0 && !from_outside_) refuse_mixture(first);
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
      bracket.label = label ? gloss_text(label) : std::string_view();
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
    if (const NodeRef gloss = item.child(NodeKind::gloss)) sign.gloss = gloss_text(gloss);
    if (const NodeRef tag = item.child(NodeKind::tag)) sign.tag = tag.child(NodeKind::name).text();
    sign.cycles = cycles_of(item, sign.gloss);
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
      sign.timed = true;
    } else {
      ++untimed_;
    }
    tier_.signs.push_back(sign);
  }

  std::uint32_t cycles_of(NodeRef sign, std::string_view gloss) {
    const NodeRef tag = sign.child(NodeKind::tag);
    const NodeRef node = tag ? tag.child(NodeKind::quantity) : NodeRef();
    if (!node) {
      const std::size_t more = gloss.size() - stem(gloss).size();
      if (more < kMaxSignCycles) return static_cast<std::uint32_t>(more) + 1;
      evaluator_.report(scope_, sign, TooLarge{"the cycles of one sign", fmt::format("{}", kMaxSignCycles)});
      return 1;
    }
    const auto q = evaluator_.quantity(node, lang::Unit::count, scope_);
    if (!q) return 1;
    const auto whole = q->value >= 1.0 && q->value <= kMaxSignCycles ? static_cast<std::uint32_t>(q->value) : 0U;
    if (whole != 0 && static_cast<double>(whole) == q->value) return whole;
    evaluator_.report(scope_, node,
                      OutOfRange{std::string(node.text()), fmt::format("1x to {}x, in whole cycles", kMaxSignCycles)});
    return 1;
  }

  void name_signs(std::uint32_t first) {
    for (std::size_t i = first; i < tier_.signs.size(); ++i) {
      const Sign& s = tier_.signs[i];
      if (!s.alias.empty() && !aliases_.emplace(s.alias).second)
        evaluator_.report(scope_, s.node.child(NodeKind::alias), DuplicateName{"sign", std::string(s.alias)});
    }
  }

  void time_from_outside(std::uint32_t first, bool non_dominant) {
    const auto rows = evaluator_.outside().sign_rows(non_dominant);
    if (rows.empty()) return;
    std::unordered_map<std::string_view, std::vector<std::uint32_t>> named;
    for (std::uint32_t i = first; i < tier_.signs.size(); ++i) {
      const Sign& s = tier_.signs[i];
      named[s.gloss].push_back(i);
      if (!s.alias.empty() && s.alias != s.gloss) named[s.alias].push_back(i);
    }
    std::unordered_map<std::uint32_t, const OutsideTimes::SignRow*> given;
    for (OutsideTimes::SignRow* row : rows) {
      const bool again = row->used;  // an utterance may be worked out twice; what is wrong is said once
      row->used = true;
      const auto index = sign_of(*row, first, named, again);
      if (!index) continue;
      const SignTiming& t = *row->timing;
      Sign& s = tier_.signs[*index];
      const auto [it, added] = given.emplace(*index, row);
      if (!added) {
        if (again) continue;
        lang::Diagnostic& d = evaluator_.diagnostics().report(row->table->source, t.range,
                                                              SignTimes{std::string(s.gloss), "are given twice"});
        d.labels.push_back({it->second->table->source, it->second->timing->range, "first given here"});
        continue;
      }
      if (t.stroke_end_ns <= t.start_ns || t.end_ns < t.stroke_end_ns) {
        if (!again)
          evaluator_.diagnostics().report(
              row->table->source, t.range,
              SignTimes{std::string(s.gloss), t.stroke_end_ns <= t.start_ns ? "end before they start"
                                                                            : "hold the sign until before it ends"});
        continue;
      }
      from_outside_ = true;
      timed_ += s.timed ? 0 : 1;
      untimed_ -= s.timed ? 0 : 1;
      s.timed = true;
      s.start_ns = t.start_ns;
      s.stroke_end_ns = t.stroke_end_ns;
      s.end_ns = t.end_ns;
    }
  }

  /// The sign that a row of a table speaks of.
  std::optional<std::uint32_t> sign_of(const OutsideTimes::SignRow& row, std::uint32_t first,
                                       const std::unordered_map<std::string_view, std::vector<std::uint32_t>>& named,
                                       bool again) {
    const SignTiming& t = *row.timing;
    const auto size = static_cast<std::uint32_t>(tier_.signs.size());
    const auto report = [&](const auto& kind) -> lang::Diagnostic* {
      return again ? nullptr : &evaluator_.diagnostics().report(row.table->source, t.range, kind);
    };
    const auto nth = [](std::uint32_t n) { return fmt::format("sign {}", n); };
    if (t.index != 0) {
      if (t.index > size - first) {
        report(UnknownSign{fmt::format("{} of {}", nth(t.index), size - first), {}, {}});
        return std::nullopt;
      }
      const std::uint32_t i = first + t.index - 1;
      const Sign& s = tier_.signs[i];
      if (t.sign.empty() || t.sign == s.gloss || t.sign == s.alias) return i;
      report(UnknownSign{fmt::format("{}, as {},", t.sign, nth(t.index)), {std::string(s.gloss)}, {}});
      return std::nullopt;
    }
    const auto it = named.find(t.sign);
    if (it == named.end()) {
      std::vector<std::string> names;
      for (std::uint32_t i = first; i < size; ++i) names.emplace_back(tier_.signs[i].gloss);
      auto nearest = evaluator_.similar(t.sign, [&] { return names; });
      report(UnknownSign{t.sign, std::move(nearest), std::move(names)});
      return std::nullopt;
    }
    if (it->second.size() == 1) return it->second.front();
    std::vector<std::uint32_t> found = it->second;
    constexpr std::size_t kMostCandidates = 10;
    if (found.size() > kMostCandidates) found.resize(kMostCandidates);
    AmbiguousSign kind{t.sign, {}};
    for (const std::uint32_t i : found) kind.candidates.push_back(fmt::format("index {}", i - first + 1));
    if (lang::Diagnostic* d = report(kind))
      for (const std::uint32_t i : found)
        d->labels.push_back({tier_.signs[i].node.tree().source_pointer(), tier_.signs[i].node.range(), "signed here"});
    return std::nullopt;
  }

  /// Times for the signs that have none, run by run.
  void place(std::uint32_t first) {
    const auto size = static_cast<std::uint32_t>(tier_.signs.size());
    for (std::uint32_t i = first; i < size;) {
      if (tier_.signs[i].timed) {
        ++i;
        continue;
      }
      std::uint32_t end = i;
      while (end < size && !tier_.signs[end].timed) ++end;
      place_run(first, i, end);
      i = end;
    }
  }

  void place_run(std::uint32_t first, std::uint32_t begin, std::uint32_t end) {
    const bool after = begin != first;
    const bool before = end != tier_.signs.size();
    const std::int64_t count = end - begin;
    std::int64_t total = count * kSignNs + (count - 1) * kGapNs + (before ? 0 : kFinalSignNs - kSignNs);
    std::int64_t from = 0;
    double scale = 1.0;
    if (after) {
      const std::int64_t left = tier_.signs[begin - 1].end_ns;
      from = left + kGapNs;
      if (before) {
        total += 2 * kGapNs;
        const std::int64_t room = tier_.signs[end].start_ns - left;
        if (room < count * kLeastSignNs) {
          crowded_ = true;
          evaluator_.report(
              scope_, tier_.signs[begin].node,
              SignTimes{std::string(tier_.signs[begin].gloss), "are not given, and the signs about it leave no room"});
        } else if (room < total) {
          scale = static_cast<double>(room) / static_cast<double>(total);
          from = left + scaled(kGapNs, scale);
        }
      }
    } else if (before) {
      from = tier_.signs[end].start_ns - kGapNs - total;
    }
    std::int64_t at = 0;
    for (std::uint32_t i = begin; i < end; ++i) {
      Sign& s = tier_.signs[i];
      s.start_ns = from + scaled(at, scale);
      at += i + 1 == tier_.signs.size() ? kFinalSignNs : kSignNs;
      s.stroke_end_ns = s.end_ns = from + scaled(at, scale);
      at += kGapNs;
    }
  }

  static std::int64_t scaled(std::int64_t ns, double scale) {
    return static_cast<std::int64_t>(static_cast<double>(ns) * scale + 0.5);
  }

  /// In a source all signs of a hand have times or none; then none count.
  void refuse_mixture(std::uint32_t first) {
    const Sign* missing = nullptr;
    for (std::size_t i = first; i < tier_.signs.size(); ++i) {
      Sign& s = tier_.signs[i];
      if (missing == nullptr && !s.timed) missing = &s;
      s.timed = false;
    }
    evaluator_.report(scope_, missing->node,
                      SignTimes{std::string(missing->gloss), "are missing, and other signs have theirs"});
  }

  void check(std::uint32_t first) {
    for (std::size_t i = first; i < tier_.signs.size(); ++i) {
      Sign& s = tier_.signs[i];
      const char* reason = nullptr;
      if (s.stroke_end_ns <= s.start_ns)
        reason = "end before they start";
      else if (s.end_ns < s.stroke_end_ns)
        reason = "hold the sign until before it ends";
      else if (i > first && s.start_ns < tier_.signs[i - 1].start_ns)
        reason = "are before those of the sign in front of it";
      if (reason == nullptr) continue;
      if (!crowded_) evaluator_.report(scope_, s.node, SignTimes{std::string(s.gloss), reason});
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
  bool crowded_ = false;       ///< signs do not find room between others, and that has been said
  bool from_outside_ = false;  ///< a table gives the times of signs of this hand
};

}  // namespace

std::string_view stem(std::string_view gloss) {
  const std::size_t end = gloss.find_last_not_of('+');
  return end == std::string_view::npos ? gloss : gloss.substr(0, end + 1);
}

bool is_called(const Sign& sign, std::string_view tag_or_gloss) {
  return sign.tag == tag_or_gloss || sign.gloss == tag_or_gloss || stem(sign.gloss) == tag_or_gloss;
}

ManualTier build_manual_tier(NodeRef utterance, const Scope& scope, Evaluator& evaluator) {
  return TierBuilder(scope, evaluator).build(utterance);
}

}  // namespace nms::compiler
