#include "placement.h"

#include <algorithm>
#include <string>

#include <fmt/format.h>

#include <nms/compiler/diagnostic_kinds.h>

namespace nms::compiler {

using lang::NodeKind;
using lang::NodeRef;

namespace {

/// Most signs of one name that a message lists.
constexpr std::size_t kMostCandidates = 10;

std::string seconds(std::int64_t ns) { return fmt::format("{:.6g}s", static_cast<double>(ns) / 1e9); }

/// `else` of a span's end, or one that does not exist.
NodeRef alternative(NodeRef span_end) {
  const NodeRef e = span_end.child(NodeKind::else_);
  return e ? e.child(NodeKind::span_end) : NodeRef();
}

}  // namespace

std::optional<std::uint32_t> Placer::tagged(std::string_view tag) const {
  if (context_.tier == nullptr || !context_.whole.has_signs()) return std::nullopt;
  for (std::uint32_t i = context_.whole.first_sign; i <= context_.whole.last_sign; ++i)
    if (context_.tier->signs[i].tag == tag) return i;
  return std::nullopt;
}

std::optional<std::uint32_t> Placer::sign(NodeRef name) {
  const std::string_view text = gloss_text(name);
  if (context_.tier == nullptr || context_.tier->signs.empty()) {
    evaluator_.report(scope_, name, NoSigns{std::string(text)});
    return std::nullopt;
  }
  std::vector<std::uint32_t> found;
  for (std::uint32_t i = 0; i < context_.tier->signs.size(); ++i) {
    const Sign& s = context_.tier->signs[i];
    if (!s.alias.empty() && s.alias == text) return i;
    if (s.gloss == text) found.push_back(i);
  }
  if (found.size() == 1) return found[0];
  if (found.empty()) {
    std::vector<std::string> names;
    for (const Sign& s : context_.tier->signs) {
      names.emplace_back(s.gloss);
      if (!s.alias.empty()) names.emplace_back(s.alias);
    }
    auto nearest = lang::nearest(text, names);
    evaluator_.report(scope_, name, UnknownSign{std::string(text), std::move(nearest), std::move(names)});
    return std::nullopt;
  }
  AmbiguousSign kind{std::string(text), {}};
  if (found.size() > kMostCandidates) found.resize(kMostCandidates);
  for (const std::uint32_t i : found) kind.candidates.push_back(seconds(context_.tier->signs[i].start_ns));
  auto& d = evaluator_.report(scope_, name, kind);
  for (const std::uint32_t i : found)
    d.labels.push_back({d.source, context_.tier->signs[i].node.range(), "signed here"});
  return std::nullopt;
}

const Sign* Placer::named(NodeRef name) {
  const std::string text = unquoted(name);
  if (context_.tier != nullptr && !context_.tier->utterances.empty() && !signed_here(text)) {
    const std::vector<Sign>& all = context_.tier->utterances;
    std::vector<const Sign*> found;
    for (const Sign& u : all)
      if (u.gloss == text) found.push_back(&u);
    if (found.size() == 1) return found.front();
    if (!found.empty()) {
      if (found.size() > kMostCandidates) found.resize(kMostCandidates);
      AmbiguousSign kind{std::string(text), {}, true};
      for (const Sign* u : found) kind.candidates.push_back(seconds(u->start_ns));
      auto& d = evaluator_.report(scope_, name, kind);
      for (const Sign* u : found) d.labels.push_back({d.source, u->node.range(), "played here"});
      return nullptr;
    }
  }
  const auto index = sign(name);
  return index ? &context_.tier->signs[*index] : nullptr;
}

bool Placer::signed_here(std::string_view gloss) const {
  if (context_.tier == nullptr) return false;
  return std::any_of(context_.tier->signs.begin(), context_.tier->signs.end(),
                     [&](const Sign& s) { return s.gloss == gloss || s.alias == gloss; });
}

std::optional<std::int64_t> Placer::edge(NodeRef at, bool start) {
  if (start) return context_.whole.start_ns;
  if (context_.whole.end_ns > context_.whole.start_ns) return context_.whole.end_ns;
  evaluator_.report(scope_, at,
                    WrongKind{std::string(at.text()), "nowhere: nothing says when this ends", "a time",
                              "give the timeline a length, timeline NAME 3s { }, or the utterance its signs"});
  return std::nullopt;
}

std::optional<std::int64_t> Placer::point(NodeRef node) {
  std::int64_t time = 0;
  bool have = false;
  for (NodeRef part : node.children()) {
    switch (part.kind()) {
      case NodeKind::quantity: {
        const auto q = evaluator_.quantity(part, lang::Unit::time, scope_);
        if (!q) return std::nullopt;
        time = q->nanoseconds;
        have = true;
        break;
      }
      case NodeKind::anchor: {
        const std::string_view text = part.text();
        const NodeRef name = part.at(0);
        if (text.starts_with("mark")) {
          const auto given = name ? evaluator_.outside().mark(name.text()) : std::nullopt;
          if (name && !given)
            evaluator_.report(
                scope_, name,
                UnknownMark{std::string(name.text()), std::string(evaluator_.outside().clip()),
                            evaluator_.similar(name.text(), [&] { return evaluator_.outside().mark_names(); })});
          if (!given) return std::nullopt;
          time = *given;
          have = true;
          break;
        }
        if (!name) {  // `at start`, `end - 30ms`: of what surrounds it
          const auto of_whole = edge(part, text.starts_with("start"));
          if (!of_whole) return std::nullopt;
          time = *of_whole;
          have = true;
          break;
        }
        const Sign* s = named(name);
        if (s == nullptr) return std::nullopt;
        const Sign& at = *s;
        time = text.starts_with("start") ? at.start_ns : text.starts_with("stroke") ? at.stroke_end_ns : at.end_ns;
        have = true;
        break;
      }
      case NodeKind::edge_sign: {
        const auto of_whole = edge(part, part.text() == "start");
        if (!of_whole) return std::nullopt;
        time = *of_whole;
        have = true;
        break;
      }
      case NodeKind::offset: {
        const NodeRef amount = part.child(NodeKind::quantity);
        const auto q = amount ? evaluator_.quantity(amount, lang::Unit::time, scope_) : std::nullopt;
        if (!q) return std::nullopt;
        time += part.has(lang::kFlagMinus) ? -q->nanoseconds : q->nanoseconds;
        break;
      }
      default:
        break;
    }
  }
  if (!have) return std::nullopt;
  return time;
}

std::optional<Span> Placer::own_span(NodeRef node) {
  const NodeRef what = node.at(0);
  const auto of_sign = [this](std::uint32_t i) {
    const Sign& s = context_.tier->signs[i];
    return Span{s.start_ns, s.end_ns, i, i};
  };
  if (!what) return std::nullopt;
  switch (what.kind()) {
    case NodeKind::tagged_sign: {
      const NodeRef tag = what.at(0);
      if (const auto s = tagged(tag.text())) return of_sign(*s);
      if (const NodeRef other = alternative(node)) return own_span(other);
      std::vector<std::string> tags;
      if (context_.tier != nullptr)
        for (const Sign& s : context_.tier->signs)
          if (!s.tag.empty()) tags.push_back(fmt::format("{}{{{}}}", s.gloss, s.tag));
      evaluator_.report(scope_, what,
                        UnknownSign{fmt::format("a sign with the tag {{{}}}", tag.text()), {}, std::move(tags)});
      return std::nullopt;
    }
    case NodeKind::edge_sign: {
      const std::string_view text = what.text();
      if (text == "start" || text == "end") {
        const auto t = edge(what, text == "start");
        if (!t) return std::nullopt;
        return Span{*t, *t, kUnreachable, kUnreachable};
      }
      if (!context_.whole.has_signs() && !context_.entry) {
        evaluator_.report(scope_, what, NoSigns{std::string(text)});
        return std::nullopt;
      }
      // An entry played alone has no signs: its whole span stands for its only one.
      if (!context_.whole.has_signs()) return context_.whole;
      return of_sign(text.starts_with("first") ? context_.whole.first_sign : context_.whole.last_sign);
    }
    case NodeKind::point: {
      const auto t = point(what);
      if (!t) return std::nullopt;
      return Span{*t, *t, kUnreachable, kUnreachable};
    }
    default: {
      const std::string_view text = what.text();
      if ((text == "clause" || text == "phrase") && !signed_here(text)) return context_.whole;
      const Sign* s = named(what);
      if (s == nullptr) return std::nullopt;
      const std::vector<Sign>& signs = context_.tier->signs;
      if (s >= signs.data() && s < signs.data() + signs.size())
        return of_sign(static_cast<std::uint32_t>(s - signs.data()));
      return Span{s->start_ns, s->end_ns, kUnreachable, kUnreachable};
    }
  }
}

std::optional<Placer::Place> Placer::span_end(NodeRef node, End which) {
  const auto span = own_span(node);
  if (!span) return std::nullopt;
  if (which == End::start) return Place{span->start_ns, span->first_sign};
  return Place{span->end_ns, span->last_sign};
}

std::optional<Span> Placer::over(NodeRef over) {
  const NodeRef span = over.child(NodeKind::span);
  if (!span) return std::nullopt;
  const NodeRef first = span.at(0);
  const NodeRef second = span.at(1);
  if (!first) return std::nullopt;
  if (!second) {
    const auto own = own_span(first);
    if (own && own->start_ns == own->end_ns) {
      evaluator_.report(scope_, first,
                        WrongKind{std::string(first.text()), "a point", "a span", "write A..B, or `at` with `for`"});
      return std::nullopt;
    }
    return own;
  }
  const auto start = span_end(first, End::start);
  const auto end = span_end(second, End::end);
  if (!start || !end) return std::nullopt;
  if (end->time_ns <= start->time_ns) {
    evaluator_.report(scope_, span,
                      SpanBackwards{std::string(first.text()) + " (" + seconds(start->time_ns) + ")",
                                    std::string(second.text()) + " (" + seconds(end->time_ns) + ")"});
    return std::nullopt;
  }
  Span out{start->time_ns, end->time_ns, kUnreachable, kUnreachable};
  if (context_.tier != nullptr)
    for (std::uint32_t i = 0; i < context_.tier->main_count(); ++i) {
      const Sign& s = context_.tier->signs[i];
      if (s.start_ns < out.start_ns || s.end_ns > out.end_ns) continue;
      if (out.first_sign == kUnreachable) out.first_sign = i;
      out.last_sign = i;
    }
  return out;
}

}  // namespace nms::compiler
