#include "lower_clip.h"

#include <algorithm>
#include <string>

#include <fmt/format.h>

#include <nms/compiler/diagnostic_kinds.h>

#include "ambient.h"
#include "combine.h"
#include "competition.h"
#include "lower_entry.h"
#include "profile.h"

namespace nms::compiler {

using lang::NodeKind;
using lang::NodeRef;
using lang::Unit;

namespace {

Scope default_scope(const Declaration& d, Evaluator& evaluator, bool& good) {
  Scope outer;
  outer.file = d.file;
  auto bound = evaluator.bind({}, false, d.name, evaluator.declarations().params(d), d.file, outer);
  good = bound.has_value();
  return good ? *bound : outer;
}

/// A clip is as long as all that is in it.
void extend(ClipDraft& clip) {
  for (const Contribution& c : clip.contributions) {
    clip.start_ns = std::min(clip.start_ns, c.curve.knots.empty() ? c.start_ns : c.curve.knots.front().time_ns);
    clip.end_ns = std::max(clip.end_ns, c.curve.knots.empty() ? c.end_ns : c.curve.knots.back().time_ns);
  }
}

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
      clip_.markers.push_back({s.start_ns, name, program::MarkerKind::sign_start});
      if (s.stroke_end_ns != s.end_ns)
        clip_.markers.push_back({s.stroke_end_ns, name, program::MarkerKind::stroke_end});
      clip_.markers.push_back({s.end_ns, name, program::MarkerKind::sign_end});
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

  /// The entry's own domain round a sign: the innermost bracket of its kind; else the signs about it that are no topic.
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
    Span out{tier_.signs[sign].start_ns, tier_.signs[sign].end_ns, sign, sign};
    const bool topic = in_topic_[sign];
    while (out.first_sign > 0 && in_topic_[out.first_sign - 1] == topic) --out.first_sign;
    while (out.last_sign + 1 < tier_.main_count() && in_topic_[out.last_sign + 1] == topic) ++out.last_sign;
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
      if (*s >= tier_.main_count()) {
        evaluator_.report(scope_, on, NotCompiled{"spreading from a sign of the other hand"});
        return;
      }
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

std::optional<std::uint32_t> lexicon_in(const Declaration& d, const Scope& scope, Evaluator& evaluator) {
  const NodeRef in = d.node.child(NodeKind::in);
  const NodeRef name = in ? in.child(NodeKind::name) : NodeRef();
  if (!name) return kUnreachable;
  const std::uint32_t found = evaluator.declarations().find_lexicon(name.text());
  if (found != kUnreachable) return found;
  std::vector<std::string> known;
  for (const LexiconDeclaration& l : evaluator.declarations().lexicons) known.emplace_back(l.declaration.name);
  evaluator.report(scope, name, MissingLexicon{std::string(name.text()), lang::nearest(name.text(), known), ""});
  return std::nullopt;
}

void finish(ClipDraft& clip, const Scope& scope, Evaluator& evaluator) {
  give_way(clip, evaluator.channels());
  check_competition(clip, scope, evaluator);
  extend(clip);
}

void mark_markers(ClipDraft& clip, const OutsideTimes::InClip& in) {
  for (const OutsideTimes::Used& mark : in.used())
    clip.markers.push_back({mark.time_ns, std::string(mark.name), program::MarkerKind::mark});
}

std::int64_t carrier_ns(const Declaration& entry) {
  // Median lengths of what entries spread over (NCSLGR corpus): content questions 1300 ms, negated phrases 1033 ms,
  // topics 633 ms, utterance-final signs 400 ms.
  const std::string_view spreads = spreading_of(entry);
  if (spreads == "clause") return 1'300'000'000;
  if (spreads == "phrase") return 1'033'000'000;
  if (spreads == "topic") return 633'000'000;
  return 400'000'000;
}

namespace {

/// The one share that an entry without parameters takes, neg(60%). Nothing: it is wrong, which has been reported.
std::optional<double> intensity_of(const Declaration& e, NodeRef call, const Scope& scope, Evaluator& evaluator) {
  std::optional<double> out;
  for (NodeRef a : call.children()) {
    // A bracket is a call too, and its signs come after its arguments.
    if (!a.is(NodeKind::argument) || evaluator.degree(a, scope)) continue;
    const NodeRef given = a.at(a.has(lang::kFlagNamed) ? 1 : 0);
    const auto value = given && !out ? evaluator.arithmetic(given, scope) : std::nullopt;
    if (!value || !value->word.empty() || value->quantity.unit != Unit::percent ||
        (a.has(lang::kFlagNamed) && a.at(0).text() != "intensity")) {
      evaluator.report(scope, a, UnexpectedArgument{std::string(e.name), std::string(a.text()), {"intensity"}});
      return std::nullopt;
    }
    if (value->quantity.value < 0.0) {
      evaluator.report(scope, a, OutOfRange{std::string(a.text()), "0% and above"});
      return std::nullopt;
    }
    out = value->quantity.value;
  }
  return out.value_or(1.0);
}

/// A parameter that a condition asks is one of the words that some condition or its default knows.
bool known_words(const Declaration& e, NodeRef call, const Scope& bound, const Scope& scope, Evaluator& evaluator) {
  bool good = true;
  for (const Argument& a : bound.arguments) {
    if (a.word.empty()) continue;
    std::vector<std::string> known;
    for (std::uint32_t i = e.node.index() + 1; i < e.node.node().next; ++i) {
      const NodeRef n(&e.node.tree(), i);
      if (!n.is(NodeKind::condition) || n.at(0).text() != a.name || n.range().begin != n.at(0).range().begin) continue;
      if (n.at(1))
        known.emplace_back(n.at(1).text());
      else
        known.insert(known.end(), {"yes", "no"});
    }
    if (known.empty()) continue;  // no condition asks it
    for (NodeRef p : e.node.child(NodeKind::params).children())
      if (p.at(0).text() == a.name && p.at(1).is(NodeKind::name)) known.emplace_back(p.at(1).text());
    if (std::find(known.begin(), known.end(), a.word) != known.end()) continue;
    std::sort(known.begin(), known.end());
    known.erase(std::unique(known.begin(), known.end()), known.end());
    std::string words = known.front();
    for (std::size_t i = 1; i < known.size(); ++i) words += (i + 1 == known.size() ? " or " : ", ") + known[i];
    evaluator.report(scope, call ? call : e.node.child(NodeKind::params),
                     BadProperty{std::string(a.name), std::string(a.word), std::move(words)});
    good = false;
  }
  return good;
}

}  // namespace

std::optional<EntryUse> bind_entry(const Declaration& e, NodeRef call, const Scope& scope, Evaluator& evaluator,
                                   double degree) {
  const NodeRef params = e.node.child(NodeKind::params);
  if (call)
    for (NodeRef a : call.children())
      if (a.is(NodeKind::argument)) degree *= evaluator.degree(a, scope).value_or(1.0);
  EntryUse use;
  std::optional<Scope> inner;
  if (!params && call && call.child(NodeKind::argument)) {
    const auto intensity = intensity_of(e, call, scope, evaluator);
    if (!intensity) return std::nullopt;
    use.intensity = *intensity;
    inner = Scope{e.file, {}, scope.left_handed, scope.places};
  } else {
    inner = evaluator.bind(call, false, e.name, params, e.file, scope, true);
  }
  if (!inner || !known_words(e, call, *inner, scope, evaluator)) return std::nullopt;
  use.scope = std::move(*inner);
  // A degree scales what the entry itself calls its intensity; where it declares none, all of it.
  bool declared = false;
  for (Argument& a : use.scope.arguments) {
    if (a.name != "intensity" || !a.word.empty() || !is_scalar(a.quantity.unit)) continue;
    a.quantity.value *= degree;
    declared = true;
  }
  if (!declared) use.intensity *= degree;
  use.choices = Choices::of_use(e, {}, true, scope, evaluator);
  return use;
}

std::optional<ClipDraft> lower_expression(const Declaration& d, Evaluator& evaluator) {
  bool good = true;
  const Scope scope = default_scope(d, evaluator, good);
  if (!good) return std::nullopt;
  const auto movement = evaluator.declaration(d, scope);
  if (!movement || movement->sequences.empty()) return std::nullopt;
  const Sequence& s = movement->sequences.front();
  if (s.steps.empty()) return std::nullopt;
  if (s.duration_ns < 0) return std::nullopt;  // the placement gives the length: nothing to play alone
  ClipDraft clip;
  clip.name = d.name;
  clip.kind = program::ClipKind::expression;
  clip.end_ns = s.duration_ns;
  Placed placed;
  placed.entry = d.name;
  play_sequence(clip, s, 0, s.duration_ns, false, placed, evaluator);
  finish(clip, scope, evaluator);
  return clip;
}

std::optional<ClipDraft> lower_timeline(const Declaration& d, Evaluator& evaluator) {
  if (d.node.has(lang::kFlagError)) return std::nullopt;
  bool good = true;
  const Scope scope = default_scope(d, evaluator, good);
  if (!good) return std::nullopt;
  return lower_timeline(d, scope, evaluator);
}

std::optional<ClipDraft> lower_timeline(const Declaration& d, const Scope& scope, Evaluator& evaluator) {
  const OutsideTimes::InClip in(evaluator.outside(), d.name);
  ClipDraft clip;
  clip.name = d.name;
  clip.kind = program::ClipKind::timeline;
  std::int64_t length = 0;
  const NodeRef stated = d.node.child(NodeKind::quantity);
  if (stated) {
    const auto q = evaluator.quantity(stated, Unit::time, scope);
    if (!q) return std::nullopt;
    if (q->nanoseconds <= 0) {
      evaluator.report(scope, stated, OutOfRange{std::string(stated.text()), "times above 0s"});
      return std::nullopt;
    }
    length = q->nanoseconds;
  }
  PlacementContext context{nullptr, {0, length, kUnreachable, kUnreachable}};
  for (NodeRef item : d.node.children()) {
    if (item.is(NodeKind::when) || item.is(NodeKind::optional) || item.is(NodeKind::one_of)) {
      evaluator.report(scope, item, NotCompiled{std::string(lang::describe(item.kind()))});
      continue;
    }
    if (!item.is(NodeKind::placement)) continue;
    const bool placed = item.child(NodeKind::over) || item.child(NodeKind::at) || item.child(NodeKind::on);
    if (!placed && !stated) {
      evaluator.report(scope, item, MissingDuration{std::string(item.text())});
      continue;
    }
    Placed base;
    base.span = context.whole;
    base.extent = Extent::natural;
    const std::size_t before = clip.contributions.size();
    schedule_component(clip, item, base, 1.0, scope, context, evaluator);
    std::int64_t end = 0;
    for (std::size_t i = before; i < clip.contributions.size(); ++i) end = std::max(end, clip.contributions[i].end_ns);
    // The way back to rest may lie past the end of what the author timed; a second of it is nobody's mistake.
    if (stated && end > length + 1'000'000'000)
      evaluator.report(
          scope, item,
          OutlastsTimeline{fmt::format("{:.6g}s", static_cast<double>(end) / 1e9), std::string(stated.text())});
  }
  clip.end_ns = length;
  mark_markers(clip, in);
  finish(clip, scope, evaluator);
  place_ambient(clip, {d.node}, scope, evaluator);
  return clip;
}

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

std::optional<ClipDraft> lower_entry(const Declaration& d, Evaluator& evaluator) {
  Scope outer;
  outer.file = d.file;
  const auto use = bind_entry(d, {}, outer, evaluator);
  if (!use) return std::nullopt;
  return lower_entry(d, *use, carrier_ns(d), evaluator);
}

std::optional<ClipDraft> lower_entry(const Declaration& d, const EntryUse& use, std::int64_t length_ns,
                                     Evaluator& evaluator) {
  const OutsideTimes::InClip in(evaluator.outside(), d.name);
  ClipDraft clip;
  clip.name = d.name;
  clip.kind = program::ClipKind::entry;
  const Span span{0, length_ns, kUnreachable, kUnreachable};
  clip.end_ns = span.end_ns;
  schedule_entry(clip, d, use, span, nullptr, evaluator);
  mark_markers(clip, in);
  finish(clip, use.scope, evaluator);
  return clip;
}

}  // namespace nms::compiler
