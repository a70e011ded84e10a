#include "lower_utterance.h"

#include <algorithm>
#include <string>

#include <fmt/format.h>

#include <nms/compiler/diagnostic_kinds.h>

#include "ambient.h"
#include "combine.h"
#include "profile.h"

namespace nms::compiler {

using lang::NodeKind;
using lang::NodeRef;
using lang::Unit;

namespace {

/// An utterance while it is lowered.
class UtteranceLowering {
 public:
  UtteranceLowering(const Declaration& d, Evaluator& evaluator, const UtteranceSetting& setting)
      : d_(d), evaluator_(evaluator), setting_(setting) {
    scope_.file = d.file;
    scope_.places = setting.places;
  }

  std::optional<UtteranceDraft> run() {
    const OutsideTimes::InClip in(evaluator_.outside(), d_.name);
    clip_.name = d_.name;
    clip_.kind = program::ClipKind::utterance;
    if (!find_lexicon()) return std::nullopt;
    read_properties();
    tier_ = build_manual_tier(d_.node, scope_, evaluator_);
    whole_ = Span{0, 0, kUnreachable, kUnreachable};
    if (!tier_.empty()) {
      whole_ = {tier_.signs.front().start_ns, tier_.signs.front().end_ns, 0, tier_.main_count() - 1};
      for (std::uint32_t i = 0; i < tier_.main_count(); ++i)
        whole_.end_ns = std::max(whole_.end_ns, tier_.signs[i].end_ns);
    }
    find_topics();
    sign_markers();
    for (const Bracket& b : tier_.brackets) bracket(b);
    fire_for_signs();
    for (NodeRef item : d_.node.children()) this->item(item);
    if (setting_.role_shift) role_shift();
    combine(clip_, lexicon_, scope_, evaluator_);
    for (const Sign& s : tier_.signs) {
      clip_.start_ns = std::min(clip_.start_ns, s.start_ns);
      clip_.end_ns = std::max(clip_.end_ns, s.end_ns);
    }
    mark_markers(clip_, in);
    finish(clip_, scope_, evaluator_);
    if (!setting_.in_discourse) place_ambient(clip_, {d_.node}, scope_, evaluator_);
    return UtteranceDraft{std::move(clip_), std::move(tier_), whole_};
  }

  /// `by` blocks: placements as in an utterance, about signs that somebody else signs.
  std::optional<ClipDraft> run_blocks(const std::vector<NodeRef>& blocks, const ManualTier& tier, const Span& whole) {
    const OutsideTimes::InClip in(evaluator_.outside(), d_.name);
    if (!find_lexicon()) return std::nullopt;
    tier_ = tier;
    whole_ = whole;
    in_topic_.assign(tier_.signs.size(), false);
    for (NodeRef block : blocks)
      for (NodeRef item : block.children()) this->item(item);
    mark_markers(clip_, in);
    finish(clip_, scope_, evaluator_);
    return std::move(clip_);
  }

 private:
  bool find_lexicon() {
    const auto found = lexicon_in(d_, scope_, evaluator_);
    lexicon_ = found.value_or(kUnreachable);
    return found.has_value();
  }

  /// The lexicon's role shift over the whole utterance, and the quoted one's face.
  void role_shift() {
    Span span = whole_;
    if (tier_.empty()) {
      extend(clip_);
      span = {clip_.start_ns, clip_.end_ns, kUnreachable, kUnreachable};
    }
    const NodeRef role = setting_.role_shift.at(0);
    const std::string label = fmt::format("rs:{}", role.text());
    clip_.markers.push_back({span.start_ns, label, program::MarkerKind::use_start});
    clip_.markers.push_back({span.end_ns, label, program::MarkerKind::use_end});
    auto use = bind_entry(*setting_.role_shift_entry, {}, scope_, evaluator_);
    if (use) {
      for (Argument& a : use->scope.arguments) {
        if (a.quantity.unit != Unit::angle) continue;
        if (a.name == "speaker") a.quantity.value = setting_.speaker_yaw_deg;
        if (a.name == "addressee") a.quantity.value = setting_.addressee_yaw_deg;
      }
      use->node = role;
      schedule_entry(clip_, *setting_.role_shift_entry, *use, span, tier_.empty() ? nullptr : &tier_, evaluator_);
    }
    whole_ = span;
    quoting_ = true;
    for (NodeRef item : setting_.role_shift.children()) this->item(item);
  }

  void read_properties() {
    for (NodeRef p : d_.node.children()) {
      if (p.is(NodeKind::profile))
        evaluator_.report(scope_, p,
                          UnknownProperty{"profile", "an utterance", {"signer", "optional", "source", "meaning"}});
      if (!is_property(p)) continue;
      const std::string_view name = p.at(0).text();
      const NodeRef value = p.at(1);
      if (name == "signer") {
        const std::string_view word = value ? value.text() : std::string_view();
        if (word == "left_handed")
          scope_.left_handed = true;
        else if (word != "right_handed")
          evaluator_.report(scope_, value ? value : p,
                            BadProperty{"signer", std::string(word), "left_handed or right_handed"});
      } else if (name == "optional") {
        optional_ = optional_plays(p, optional_, scope_, evaluator_);
      } else if (name != "source" && name != "meaning") {
        evaluator_.report(
            scope_, p.at(0),
            UnknownProperty{std::string(name), "an utterance", {"signer", "optional", "source", "meaning"}});
      }
    }
  }

  Span bracket_span(const Bracket& b) const {
    Span s{tier_.signs[b.first].start_ns, tier_.signs[b.first].end_ns, b.first, b.last};
    for (std::uint32_t i = b.first; i <= b.last; ++i) s.end_ns = std::max(s.end_ns, tier_.signs[i].end_ns);
    return s;
  }

  const Declaration* entry(std::string_view name) const {
    return lexicon_ == kUnreachable ? nullptr : evaluator_.declarations().find_entry(name, lexicon_);
  }

  /// Signs that are a topic: in a bracket `topic[ ]` or one whose entry spreads over topics, or under `topic over
  /// SPAN`.
  void find_topics() {
    in_topic_.assign(tier_.signs.size(), false);
    for (const Bracket& b : tier_.brackets) {
      if (b.empty) continue;
      const Declaration* e = entry(b.label);
      if (b.label == "topic" || (e != nullptr && spreading_of(*e) == "topic"))
        for (std::uint32_t i = b.first; i <= b.last; ++i) in_topic_[i] = true;
    }
    find_topics(d_.node);
  }

  void find_topics(NodeRef parent) {
    const PlacementContext context{&tier_, whole_};
    for (NodeRef item : parent.children()) {
      if (item.is(NodeKind::when) && holds(item, context, scope_, evaluator_).value_or(false)) find_topics(item);
      if (!item.is(NodeKind::placement)) continue;
      const NodeRef over = item.child(NodeKind::over);
      const Declaration* e = over ? used_entry(item).entry : nullptr;
      if (e == nullptr || spreading_of(*e) != "topic") continue;
      Placer placer(evaluator_, scope_, context);
      const auto span = placer.over(over);
      if (span && span->has_signs())
        for (std::uint32_t i = span->first_sign; i <= span->last_sign; ++i) in_topic_[i] = true;
    }
  }

  /// How a placement names an entry.
  struct Use {
    const Declaration* entry = nullptr;
    NodeRef word;  ///< its name
    NodeRef call;  ///< none without arguments
  };

  /// The entry that a placement uses, if its sum is nothing but one entry's name or call, with degrees in front.
  Use used_entry(NodeRef item) const {
    const NodeRef sum = item.child(NodeKind::sum);
    const NodeRef term = sum ? sum.at(0) : NodeRef();
    if (!term || sum.at(1) || term.has(lang::kFlagMinus)) return {};
    NodeRef primary;
    for (NodeRef part : term.children()) {
      if (!part.is(NodeKind::factor))
        primary = part;
      else if (part.has(lang::kFlagStar) || !part.at(0).is(NodeKind::name))
        return {};
    }
    if (primary.is(NodeKind::name)) return {entry(primary.text()), primary, {}};
    if (primary.is(NodeKind::call) && primary.at(0)) return {entry(primary.at(0).text()), primary.at(0), primary};
    return {};
  }

  /// `slightly neg`: what the words in front come to. Nothing: one is no degree, which has been reported.
  std::optional<double> degree_in_front(NodeRef sum) {
    double degree = 1.0;
    for (NodeRef part : sum.at(0).children()) {
      if (!part.is(NodeKind::factor)) continue;
      const auto factor = evaluator_.degree_in_front(part, scope_);
      if (!factor) return std::nullopt;
      degree *= *factor;
    }
    return degree;
  }

  void sign_markers() {
    for (const Sign& s : tier_.signs) {
      const std::string name(s.gloss);  // an alias only tells signs apart in the source
      const program::Hand hand = s.non_dominant ? program::Hand::other : program::Hand::signing;
      clip_.markers.push_back({s.start_ns, name, program::MarkerKind::sign_start, hand});
      if (s.stroke_end_ns != s.end_ns)
        clip_.markers.push_back({s.stroke_end_ns, name, program::MarkerKind::stroke_end, hand});
      clip_.markers.push_back({s.end_ns, name, program::MarkerKind::sign_end, hand});
    }
  }

  /// @param label  what the author calls the entry here
  /// @param here  the word that says so, or the sign that it comes with
  void use(const Declaration& e, std::string_view label, NodeRef here, NodeRef call, const Span& span, NodeRef options,
           double degree = 1.0) {
    clip_.markers.push_back({span.start_ns, std::string(label), program::MarkerKind::use_start});
    clip_.markers.push_back({span.end_ns, std::string(label), program::MarkerKind::use_end});
    auto use = bind_entry(e, call, scope_, evaluator_, degree);
    if (!use) return;
    use->choices = Choices::of_use(e, options, optional_, scope_, evaluator_);
    use->timing = read_timing(options, scope_, evaluator_, PropertyOwner::use);
    use->timing.profile = read_profile(options, span, {tier_.empty() ? nullptr : &tier_, whole_}, scope_, evaluator_);
    use->node = here;
    schedule_entry(clip_, e, *use, span, tier_.empty() ? nullptr : &tier_, evaluator_);
  }

  /// Whether a word means one entry. It means several where a lexicon has them share a label, which is reported.
  bool means_one(NodeRef word) {
    const auto found = evaluator_.declarations().find_entries(gloss_text(word), lexicon_);
    if (found.size() < 2) return true;
    AmbiguousLabel kind{std::string(gloss_text(word)), {}};
    for (const Declaration* e : found) kind.candidates.emplace_back(e->name);
    auto& d = evaluator_.report(scope_, word, kind);
    for (const Declaration* e : found)
      d.labels.push_back({e->node.tree().source_pointer(), e->node.child(NodeKind::name).range(), "has this label"});
    return false;
  }

  void bracket(const Bracket& b) {
    if (b.empty) return;
    const bool structural = b.label == "clause" || b.label == "phrase" || b.label == "topic";
    const Declaration* e = entry(b.label);
    if (e == nullptr) {
      if (structural) return;
      if (lexicon_ == kUnreachable) {
        evaluator_.report(scope_, b.node.at(0), MissingLexicon{"", {}, std::string(b.label)});
        return;
      }
      const auto known = [&] {
        auto names = evaluator_.declarations().entry_names(lexicon_);
        names.insert(names.end(), {"clause", "phrase", "topic"});
        return names;
      };
      evaluator_.report(scope_, b.node.at(0),
                        UnknownName{"entry", std::string(b.label), evaluator_.similar(b.label, known)});
      return;
    }
    if (means_one(b.node.at(0)))
      use(*e, b.label, b.node.at(0), b.node, bracket_span(b), b.node.child(NodeKind::options));
  }

  /// `for sign DIFFERENT` is for DIFFERENT with and without `+`, `for sign DIFFERENT+` for that which is repeated.
  [[nodiscard]] static bool comes_with(std::string_view word, const Sign& sign) {
    if (sign.gloss == word) return true;
    return stem(sign.gloss) == stem(word) && (word == stem(word) || sign.cycles > 1);
  }

  void fire_for_signs() {
    if (lexicon_ == kUnreachable) return;
    for (const Declaration* e : evaluator_.declarations().entries_of(lexicon_)) {
      const NodeRef for_sign = e->node.child(NodeKind::for_sign);
      const NodeRef gloss = for_sign ? for_sign.at(0) : NodeRef();
      if (!gloss) continue;
      const std::string word = unquoted(gloss);
      for (std::uint32_t i = 0; i < tier_.main_count(); ++i)
        if (comes_with(word, tier_.signs[i]))
          use(*e, e->name, tier_.signs[i].node, {}, {tier_.signs[i].start_ns, tier_.signs[i].end_ns, i, i}, {});
    }
  }

  /// What the signing hand signs while the other hand signs this: the sign that shares most time with it.
  std::optional<std::uint32_t> signed_beside(std::uint32_t other) const {
    std::optional<std::uint32_t> best;
    std::int64_t most_ns = 0;
    for (std::uint32_t i = 0; i < tier_.main_count(); ++i) {
      const std::int64_t shared_ns = std::min(tier_.signs[i].end_ns, tier_.signs[other].end_ns) -
                                     std::max(tier_.signs[i].start_ns, tier_.signs[other].start_ns);
      if (shared_ns <= most_ns) continue;
      most_ns = shared_ns;
      best = i;
    }
    return best;
  }

  /// The entry's own domain round a sign: the innermost bracket of its kind; else the signs about it that are no topic,
  /// of the signing hand if it signs at the time.
  Span spread(const Declaration& e, std::uint32_t sign) const {
    const std::string_view domain = spreading_of(e);
    const Bracket* best = nullptr;
    for (const Bracket& b : tier_.brackets) {
      if (b.empty || b.first > sign || b.last < sign) continue;
      const Declaration* own = entry(b.label);
      if (b.label == domain || (own != nullptr && spreading_of(*own) == domain)) best = &b;
    }
    if (best != nullptr) return bracket_span(*best);
    if (domain == "sign") {
      const Sign& s = tier_.signs[sign];
      return {s.start_ns, s.end_ns, sign, sign};
    }
    if (sign >= tier_.main_count())
      if (const auto beside = signed_beside(sign)) return spread(e, *beside);
    const std::uint32_t first = sign < tier_.main_count() ? 0 : tier_.main_count();
    const auto end = static_cast<std::uint32_t>(first == 0 ? tier_.main_count() : tier_.signs.size());
    Span out{tier_.signs[sign].start_ns, tier_.signs[sign].end_ns, sign, sign};
    const bool topic = in_topic_[sign];
    while (out.first_sign > first && in_topic_[out.first_sign - 1] == topic) --out.first_sign;
    while (out.last_sign + 1 < end && in_topic_[out.last_sign + 1] == topic) ++out.last_sign;
    out.start_ns = tier_.signs[out.first_sign].start_ns;
    for (std::uint32_t i = out.first_sign; i <= out.last_sign; ++i)
      out.end_ns = std::max(out.end_ns, tier_.signs[i].end_ns);
    return out;
  }

  void item(NodeRef item) {
    switch (item.kind()) {
      case NodeKind::placement:
        placement(item);
        break;
      case NodeKind::when: {
        if (item.has(lang::kFlagError)) break;
        const auto active = holds(item, {tier_.empty() ? nullptr : &tier_, whole_}, scope_, evaluator_);
        for (NodeRef inner : item.children()) {
          if (inner.is(NodeKind::property) || inner.is(NodeKind::profile))
            evaluator_.report(scope_, inner,
                              UnknownProperty{inner.is(NodeKind::profile) ? "profile" : std::string(inner.at(0).text()),
                                              "a condition of an utterance",
                                              {}});
          else if (active.value_or(false))
            this->item(inner);
        }
        break;
      }
      case NodeKind::optional:
      case NodeKind::one_of:
        evaluator_.report(scope_, item,
                          WrongKind{std::string(lang::describe(item.kind())), "a choice for those who use an entry",
                                    "what is signed", "write what this utterance shows, and leave the rest out"});
        break;
      default:
        break;
    }
  }

  void placement(NodeRef item) {
    if (item.has(lang::kFlagError)) return;
    const auto [e, word, call] = used_entry(item);
    PlacementContext context{tier_.empty() ? nullptr : &tier_, whole_};
    if (e == nullptr) {
      component(item, context);
      return;
    }
    if (!means_one(word)) return;
    Placer placer(evaluator_, scope_, context);
    Span span;
    if (const NodeRef over = item.child(NodeKind::over)) {
      const auto s = placer.over(over);
      if (!s) return;
      span = *s;
    } else if (const NodeRef on = item.child(NodeKind::on)) {
      const auto s = on.at(0) ? placer.sign(on.at(0)) : std::nullopt;
      if (!s) return;
      span = spread(*e, *s);
    } else if (const NodeRef at = item.child(NodeKind::at)) {
      const NodeRef point = at.child(NodeKind::point);
      const auto time = point ? placer.point(point) : std::nullopt;
      if (!time) return;
      const NodeRef duration = at.child(NodeKind::duration);
      const NodeRef amount = duration ? duration.child(NodeKind::quantity) : NodeRef();
      const auto length = amount ? evaluator_.quantity(amount, Unit::time, scope_) : std::nullopt;
      if (amount && !length) return;
      if (length && length->nanoseconds <= 0) {
        evaluator_.report(scope_, amount, OutOfRange{std::string(amount.text()), "times above 0s"});
        return;
      }
      span = {*time, *time + (length ? length->nanoseconds : carrier_ns(*e)), kUnreachable, kUnreachable};
    } else if (tier_.empty()) {
      evaluator_.report(scope_, item, NoSigns{std::string(e->name)});
      return;
    } else {
      std::uint32_t sign = tier_.main_count() - 1;
      while (sign > 0 && in_topic_[sign]) --sign;
      span = spread(*e, sign);
    }
    if (const NodeRef fill = item.child(NodeKind::fill))
      evaluator_.report(scope_, fill, UnknownProperty{"fill", "the use of an entry", {}});
    const auto degree = degree_in_front(item.child(NodeKind::sum));
    if (degree) use(*e, word.text(), word, call, span, item.child(NodeKind::options), *degree);
  }

  void component(NodeRef item, const PlacementContext& context) {
    const NodeRef sum = item.child(NodeKind::sum);
    if (names_an_entry(sum)) return;
    // A name that is neither an entry nor a movement: say so with both kinds of name at hand.
    const NodeRef term = sum ? sum.at(0) : NodeRef();
    NodeRef primary = term && !sum.at(1) && !term.at(1) ? term.at(0) : NodeRef();
    if (primary && primary.is(NodeKind::call)) primary = NodeRef();
    if (primary && primary.is(NodeKind::name) &&
        evaluator_.declarations().find_movement(primary.text(), scope_.file) == nullptr) {
      const auto known = [&] {
        auto names = evaluator_.declarations().movement_names(scope_.file);
        if (lexicon_ == kUnreachable) return names;
        const auto entries = evaluator_.declarations().entry_names(lexicon_);
        names.insert(names.end(), entries.begin(), entries.end());
        return names;
      };
      evaluator_.report(scope_, primary,
                        UnknownName{"entry, pose, expression or motion", std::string(primary.text()),
                                    evaluator_.similar(primary.text(), known)});
      return;
    }
    const bool placed = item.child(NodeKind::over) || item.child(NodeKind::at) || item.child(NodeKind::on);
    if (!placed && tier_.empty() && !quoting_) {
      evaluator_.report(scope_, item, NoSigns{sum ? std::string(sum.text()) : std::string()});
      return;
    }
    Placed base;
    base.span = whole_;
    base.extent = Extent::natural;
    base.stated = !quoting_;
    if (quoting_) base.layer = Layer::discourse;
    schedule_component(clip_, item, base, 1.0, scope_, context, evaluator_);
  }

  /// An entry inside a sum, `50% neg`: it is no pose, and there is another way to say it.
  bool names_an_entry(NodeRef sum) {
    if (!sum) return false;
    for (NodeRef term : sum.children())
      for (NodeRef part : term.children()) {
        const NodeRef name = part.is(NodeKind::call) ? part.at(0) : part;
        if (!name.is(NodeKind::name) || entry(name.text()) == nullptr ||
            evaluator_.declarations().find_movement(name.text(), scope_.file) != nullptr)
          continue;
        evaluator_.report(scope_, name,
                          WrongKind{std::string(name.text()), "an entry", "a pose, expression or motion",
                                    fmt::format("an entry stands alone in its placement; its intensity is an argument: "
                                                "{}(60%) over SIGN",
                                                name.text())});
        return true;
      }
    return false;
  }

  const Declaration& d_;
  Evaluator& evaluator_;
  const UtteranceSetting& setting_;
  Scope scope_;
  ClipDraft clip_;
  bool quoting_ = false;  ///< inside the braces of a role shift: what is placed is the quoted one's face
  std::uint32_t lexicon_ = kUnreachable;
  ManualTier tier_;
  Span whole_;
  std::vector<bool> in_topic_;
  bool optional_ = true;  ///< optional components play where their use says nothing
};

}  // namespace

std::optional<UtteranceDraft> lower_utterance(const Declaration& d, Evaluator& evaluator,
                                              const UtteranceSetting& setting) {
  if (d.node.has(lang::kFlagError)) return std::nullopt;
  return UtteranceLowering(d, evaluator, setting).run();
}

std::optional<ClipDraft> lower_participant(const Declaration& discourse, const std::vector<NodeRef>& blocks,
                                           const ManualTier& tier, const Span& whole, const Places& places,
                                           Evaluator& evaluator) {
  UtteranceSetting setting;
  setting.places = &places;
  return UtteranceLowering(discourse, evaluator, setting).run_blocks(blocks, tier, whole);
}

}  // namespace nms::compiler
