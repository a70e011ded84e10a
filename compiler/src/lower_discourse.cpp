#include "lower_discourse.h"

#include <algorithm>
#include <string>
#include <unordered_set>

#include <fmt/format.h>

#include <nms/compiler/diagnostic_kinds.h>

#include "ambient.h"

namespace nms::compiler {

using lang::NodeKind;
using lang::NodeRef;
using lang::Unit;

namespace {

/// From the last sign of an utterance, with its hold, to the first of the next: the median in ASL narratives (NCSLGR
/// corpus: 167 ms, quartiles 67 and 367, n = 483).
constexpr std::int64_t kPauseNs = 167'000'000;
/// What a direction without an angle means: engineering defaults.
constexpr double kSideDeg = 30.0;
constexpr double kHeightDeg = 15.0;
constexpr double kFarthestDeg = 90.0;
constexpr std::size_t kMaxUtterances = 10'000;
constexpr std::size_t kMaxPlaces = 1'000;
/// Signs and contributions of all that discourses play in one compilation: a few seconds of work.
constexpr std::size_t kMaxPlayed = 600'000;

constexpr const char* kDirection = "a direction: left, right, up, down or ahead, with an angle in front: 30deg left";

/// Reads `30deg left 10deg down` from the children of a role or a locus, and stops at `to`.
class DirectionReader {
 public:
  DirectionReader(Evaluator& evaluator, const Scope& scope) : evaluator_(evaluator), scope_(scope) {}

  /// @param next  the first word or angle of it; afterwards what follows it
  bool read(const std::vector<NodeRef>& words, std::size_t& next, std::string_view of, Place& place) {
    bool any = false;
    for (; next < words.size(); ++next) {
      double angle = -1.0;
      if (words[next].is(NodeKind::quantity)) {
        const auto q = evaluator_.quantity(words[next], Unit::angle, scope_);
        if (!q) return false;
        if (q->value < 0.0 || q->value > kFarthestDeg) {
          evaluator_.report(scope_, words[next],
                            OutOfRange{std::string(words[next].text()), fmt::format("0deg to {}deg", kFarthestDeg)});
          return false;
        }
        angle = q->value;
        if (++next == words.size()) return fail(words[next - 1], of);
      } else if (words[next].text() == "to") {
        break;
      }
      if (!turn(words[next], angle, place)) return fail(words[next], of);
      any = true;
    }
    return any || fail(words.empty() ? place.node : words.back(), of);
  }

 private:
  bool fail(NodeRef at, std::string_view of) {
    evaluator_.report(scope_, at, BadProperty{std::string(of), std::string(at.text()), kDirection});
    return false;
  }

  /// Each way once: what is 30deg left is not right as well.
  static bool turn(NodeRef word, double angle, Place& place) {
    const std::string_view text = word.text();
    if ((text == "left" || text == "right") && place.yaw_deg == 0.0) {
      place.yaw_deg = (angle < 0.0 ? kSideDeg : angle) * (text == "left" ? 1.0 : -1.0);
      return true;
    }
    if ((text == "up" || text == "down") && place.pitch_deg == 0.0) {
      place.pitch_deg = (angle < 0.0 ? kHeightDeg : angle) * (text == "up" ? 1.0 : -1.0);
      return true;
    }
    return text == "ahead" && angle < 0.0;
  }

  Evaluator& evaluator_;
  const Scope& scope_;
};

/// The name and then the words and angles of a role or a locus.
std::vector<NodeRef> words_of(NodeRef node) {
  std::vector<NodeRef> words;
  for (NodeRef child : node.children())
    if (child.is(NodeKind::name) || child.is(NodeKind::quantity)) words.push_back(child);
  return words;
}

/// `role NAME at DIRECTION [to NAME]`, `locus NAME DIRECTION`.
class PlaceReader {
 public:
  PlaceReader(Evaluator& evaluator, const Scope& scope, Places& places)
      : evaluator_(evaluator), scope_(scope), places_(places) {}

  void read(NodeRef node) {
    if (node.has(lang::kFlagError)) return;
    const std::vector<NodeRef> words = words_of(node);
    if (words.empty()) return;
    Place place;
    place.name = words[0].text();
    place.node = node;
    if (places_.known.size() == kMaxPlaces) {
      evaluator_.report(scope_, words[0],
                        TooLarge{"the number of places in one discourse", fmt::format("{}", kMaxPlaces)});
      return;
    }
    for (const std::string_view word : {"left", "right", "up", "down", "ahead", "addressee"})
      if (place.name == word) {
        evaluator_.report(scope_, words[0],
                          BadProperty{std::string(lang::describe(node.kind())), std::string(word),
                                      "a name that does not mean a direction already"});
        return;
      }
    if (const Place* first = places_.find(place.name)) {
      lang::Diagnostic& d = evaluator_.report(scope_, words[0], DuplicateName{"place", std::string(place.name)});
      d.labels.push_back({first->node.tree().source_pointer(), first->node.range(), "first declared here"});
      return;
    }
    const bool role = node.is(NodeKind::role);
    const std::string_view of = role ? "role" : "locus";
    std::size_t next = 1;
    if (role) {
      if (words.size() < 2 || words[1].text() != "at") {
        const NodeRef at = words.size() < 2 ? words[0] : words[1];
        evaluator_.report(
            scope_, at, BadProperty{"role", std::string(at.text()), "`at` and where it is: role NAME at 30deg right"});
        return;
      }
      next = 2;
    }
    DirectionReader direction(evaluator_, scope_);
    if (next == words.size()) {
      evaluator_.report(scope_, words.back(),
                        BadProperty{std::string(of), std::string(words.back().text()), kDirection});
      return;
    }
    if (!direction.read(words, next, of, place)) return;
    if (next != words.size() && !role) {
      evaluator_.report(scope_, words[next], BadProperty{"locus", "to", kDirection});
      return;
    }
    place.addressee_yaw_deg = -place.yaw_deg;  // whom a role speaks to is opposite, unless the role says
    places_.known.push_back(place);
  }

  /// Once all places are known: whom the roles speak to, `role mary at left to j`.
  void find_addressees() {
    for (Place& place : places_.known) {
      if (!place.node.is(NodeKind::role)) continue;
      const std::vector<NodeRef> words = words_of(place.node);
      std::size_t to = 2;
      while (to < words.size() && words[to].text() != "to") ++to;
      if (to == words.size()) continue;
      if (to + 2 != words.size()) {
        const NodeRef at = to + 1 == words.size() ? words[to] : words[to + 2];
        evaluator_.report(scope_, at, BadProperty{"role", std::string(at.text()), "one role or locus after `to`"});
      } else if (const Place* addressee = places_.find(words[to + 1].text())) {
        place.addressee_yaw_deg = addressee->yaw_deg;
        place.addressee_pitch_deg = addressee->pitch_deg;
      } else {
        const auto known = [this] { return names(); };
        evaluator_.report(scope_, words[to + 1],
                          UnknownName{"role or locus", std::string(words[to + 1].text()),
                                      evaluator_.similar(words[to + 1].text(), known)});
      }
    }
  }

 private:
  std::vector<std::string> names() const {
    std::vector<std::string> out;
    for (const Place& p : places_.known) out.emplace_back(p.name);
    return out;
  }

  Evaluator& evaluator_;
  const Scope& scope_;
  Places& places_;
};

/// One discourse while it is lowered.
class DiscourseLowering {
 public:
  DiscourseLowering(const Declaration& d, const Places& places, std::size_t& spent, Evaluator& evaluator)
      : d_(d), places_(places), spent_(spent), evaluator_(evaluator) {
    scope_.file = d.file;
  }

  std::optional<DiscourseDraft> run() {
    out_.clip.name = d_.name;
    out_.clip.kind = program::ClipKind::discourse;
    for (NodeRef item : d_.node.children()) {
      if (item.has(lang::kFlagError)) continue;
      if (item.is(NodeKind::pause))
        pause(item);
      else if (item.is(NodeKind::role_shift))
        shift(item);
      else if (item.is(NodeKind::name) && item != d_.node.child(NodeKind::name))
        play(item, {});
      if (full_) break;
    }
    gather_signs();
    finish(out_.clip, scope_, evaluator_);
    out_.clip.end_ns = std::max(out_.clip.end_ns, end_ns_ + std::max<std::int64_t>(stated_pause_ns_, 0));
    participants();
    place_ambient(out_.clip, {d_.node}, scope_, evaluator_);
    return std::move(out_);
  }

 private:
  void pause(NodeRef node) {
    const NodeRef amount = node.child(NodeKind::quantity);
    const auto q = amount ? evaluator_.quantity(amount, Unit::time, scope_) : std::nullopt;
    if (!q) return;
    if (q->nanoseconds < 0) {
      evaluator_.report(scope_, amount, OutOfRange{std::string(amount.text()), "0s and above"});
      return;
    }
    stated_pause_ns_ = std::max<std::int64_t>(stated_pause_ns_, 0) + q->nanoseconds;
  }

  /// The utterance of that name; anything else is refused.
  const Declaration* utterance(NodeRef name) {
    const Declaration* found = evaluator_.declarations().find_clip(name.text(), d_.file);
    if (found != nullptr && found->node.is(NodeKind::utterance)) return found;
    if (found != nullptr) {
      evaluator_.report(
          scope_, name,
          WrongKind{std::string(name.text()), found->node.is(NodeKind::timeline) ? "a timeline" : "a discourse",
                    "an utterance", "a discourse is made of utterances"});
      return nullptr;
    }
    const auto known = [&] {
      std::vector<std::string> names;
      for (const Declaration& d : evaluator_.declarations().clips)
        if (d.node.is(NodeKind::utterance) && evaluator_.files()[d_.file].distance[d.file] != kUnreachable)
          names.emplace_back(d.name);
      return names;
    };
    evaluator_.report(scope_, name,
                      UnknownName{"utterance", std::string(name.text()), evaluator_.similar(name.text(), known)});
    return nullptr;
  }

  /// `rs(ROLE)[ UTTERANCE ] { ... }`
  void shift(NodeRef node) {
    const NodeRef role_name = node.at(0);
    const NodeRef name = node.at(1);
    if (!role_name || !name) return;
    const Place* role = places_.find(role_name.text());
    if (role == nullptr || !role->node.is(NodeKind::role)) {
      const auto known = [&] {
        std::vector<std::string> names;
        for (const Place& p : places_.known)
          if (p.node.is(NodeKind::role)) names.emplace_back(p.name);
        return names;
      };
      evaluator_.report(
          scope_, role_name,
          UnknownName{"role", std::string(role_name.text()), evaluator_.similar(role_name.text(), known)});
      return;
    }
    const Declaration* entry = role_shift_entry(node);
    if (entry == nullptr) return;
    // Inside, `addressee` is the quoted one's, and places are seen from the turned head.
    Places inside = places_;
    Place addressee;
    addressee.name = "addressee";
    addressee.yaw_deg = role->addressee_yaw_deg;
    addressee.pitch_deg = role->addressee_pitch_deg;
    inside.known.insert(inside.known.begin(), addressee);
    inside.addressee_yaw_deg = addressee.yaw_deg;
    UtteranceSetting setting;
    setting.places = &inside;
    setting.role_shift = node;
    setting.role_shift_entry = entry;
    setting.speaker_yaw_deg = role->yaw_deg;
    setting.addressee_yaw_deg = role->addressee_yaw_deg;
    play(name, setting);
  }

  /// The lexicon's own entry says what a role shift looks like.
  const Declaration* role_shift_entry(NodeRef node) {
    const auto lexicon = lexicon_in(d_, scope_, evaluator_);
    if (!lexicon) return nullptr;
    if (*lexicon == kUnreachable) {
      evaluator_.report(scope_, node.at(0), MissingLexicon{"", {}, "rs"});
      return nullptr;
    }
    const Declaration* entry = evaluator_.declarations().find_entry("rs", *lexicon);
    if (entry == nullptr) {
      evaluator_.report(scope_, node.at(0), UnknownName{"entry", "rs", {}});
      return nullptr;
    }
    const NodeRef params = entry->node.child(NodeKind::params);
    if (params)
      for (NodeRef p : params.children())
        if (p.at(0) && (p.at(0).text() == "speaker" || p.at(0).text() == "addressee")) return entry;
    // It would not care where anybody is.
    evaluator_.report(scope_, node.at(0), MissingArgument{std::string(entry->name), "speaker or addressee"});
    return nullptr;
  }

  void play(NodeRef name, UtteranceSetting setting) {
    const Declaration* d = utterance(name);
    if (d == nullptr) return;
    if (played_.size() == kMaxUtterances) {
      too_large(name, "the number of utterances in one discourse", kMaxUtterances);
      return;
    }
    // Where something is wrong nothing is made of it: an utterance has said what is wrong with it the first time.
    if (!tried_.insert(d).second && evaluator_.diagnostics().error_count() != 0) return;
    if (setting.places == nullptr) setting.places = &places_;
    setting.in_discourse = true;
    auto part = lower_utterance(*d, evaluator_, setting);
    if (!part) return;
    spent_ += part->clip.contributions.size() + part->tier.signs.size() + part->clip.markers.size();
    if (spent_ > kMaxPlayed) {
      too_large(name, "what discourses play", kMaxPlayed);
      return;
    }
    Span own = part->whole;
    if (part->tier.empty()) own = {part->clip.start_ns, part->clip.end_ns, kUnreachable, kUnreachable};
    std::int64_t by = std::max<std::int64_t>(stated_pause_ns_, 0);
    if (!played_.empty()) by = end_ns_ + (stated_pause_ns_ < 0 ? kPauseNs : stated_pause_ns_) - own.start_ns;
    stated_pause_ns_ = -1;
    own.start_ns += by;
    own.end_ns += by;
    append(std::move(part->clip), by);
    Sign span;
    span.gloss = d->name;
    span.start_ns = own.start_ns;
    span.stroke_end_ns = span.end_ns = own.end_ns;
    span.node = name;
    out_.tier.utterances.push_back(span);
    out_.clip.markers.push_back({own.start_ns, std::string(d->name), program::MarkerKind::utterance_start});
    out_.clip.markers.push_back({own.end_ns, std::string(d->name), program::MarkerKind::utterance_end});
    end_ns_ = std::max(end_ns_, own.end_ns);
    played_.push_back({std::move(part->tier), by});
  }

  void too_large(NodeRef at, std::string what, std::size_t limit) {
    evaluator_.report(scope_, at, TooLarge{std::move(what), fmt::format("{}", limit)});
    full_ = true;
  }

  void append(ClipDraft&& part, std::int64_t by) {
    const auto base = static_cast<std::uint32_t>(out_.clip.sources.size());
    const auto count = static_cast<std::uint32_t>(part.sources.size());
    out_.clip.sources.insert(out_.clip.sources.end(), part.sources.begin(), part.sources.end());
    const auto first_cause = static_cast<std::uint32_t>(out_.clip.causes.size());
    const auto first_marker = static_cast<std::uint32_t>(out_.clip.markers.size());
    for (DraftCause cause : part.causes) {
      cause.span.start_ns += by;
      cause.span.end_ns += by;
      cause.utterance = static_cast<std::uint32_t>(played_.size());
      out_.clip.causes.push_back(cause);
    }
    for (Contribution& c : part.contributions) {
      shift_in_time(c, by);
      if (c.cause != kUnreachable) c.cause += first_cause;
      if (c.marker != kUnreachable) c.marker += first_marker;
      for (Curve* curve : {&c.curve, &c.envelope})
        for (CurveKnot& k : curve->knots)
          if (k.source < count) k.source += base;
      out_.clip.contributions.push_back(std::move(c));
    }
    for (DraftMarker& m : part.markers) {
      m.time_ns += by;
      out_.clip.markers.push_back(std::move(m));
    }
    out_.clip.start_ns = std::min(out_.clip.start_ns, part.start_ns + by);
    out_.clip.end_ns = std::max(out_.clip.end_ns, part.end_ns + by);
  }

  /// The signs of all utterances: those of the hand that each is made of, then all others.
  void gather_signs() {
    ManualTier& all = out_.tier;
    for (const bool main : {true, false}) {
      for (const Played& p : played_)
        for (std::uint32_t i = 0; i < p.tier.signs.size(); ++i) {
          if ((i < p.tier.main_count()) != main) continue;
          Sign s = p.tier.signs[i];
          s.start_ns += p.by_ns;
          s.stroke_end_ns += p.by_ns;
          s.end_ns += p.by_ns;
          all.signs.push_back(s);
        }
      if (main) all.dominant_count = static_cast<std::uint32_t>(all.signs.size());
    }
    out_.whole = {0, end_ns_, kUnreachable, kUnreachable};
    if (!all.utterances.empty()) out_.whole.start_ns = all.utterances.front().start_ns;
    if (all.dominant_count != 0) {
      out_.whole.first_sign = 0;
      out_.whole.last_sign = all.dominant_count - 1;
    }
  }

  /// `by NAME { ... }`: blocks of one name are one clip.
  void participants() {
    std::vector<std::string_view> names;
    std::unordered_map<std::string_view, std::vector<NodeRef>> blocks;
    std::vector<std::vector<NodeRef>> blocks_of_participants;
    for (NodeRef item : d_.node.children()) {
      if (!item.is(NodeKind::by) || item.has(lang::kFlagError) || !item.at(0)) continue;
      std::vector<NodeRef>& own = blocks[item.at(0).text()];
      if (own.empty()) names.push_back(item.at(0).text());
      own.push_back(item);
    }
    for (const std::string_view name : names) {
      auto clip = lower_participant(d_, blocks[name], out_.tier, out_.whole, places_, evaluator_);
      if (!clip) continue;
      clip->name = fmt::format("{}.{}", d_.name, name);
      clip->kind = program::ClipKind::discourse;
      blocks_of_participants.push_back(std::move(blocks[name]));
      out_.participants.push_back(std::move(*clip));
    }
    // One clock: they begin and end together.
    ClipDraft& first = out_.clip;
    for (const ClipDraft& c : out_.participants) {
      first.start_ns = std::min(first.start_ns, c.start_ns);
      first.end_ns = std::max(first.end_ns, c.end_ns);
    }
    for (std::size_t i = 0; i < out_.participants.size(); ++i) {
      ClipDraft& c = out_.participants[i];
      c.start_ns = first.start_ns;
      c.end_ns = first.end_ns;
      place_ambient(c, blocks_of_participants[i], scope_, evaluator_);
      spent_ += c.contributions.size();
      if (spent_ <= kMaxPlayed) continue;
      too_large(blocks_of_participants[i].front(), "what discourses play", kMaxPlayed);
      break;
    }
  }

  struct Played {
    ManualTier tier;
    std::int64_t by_ns = 0;
  };

  const Declaration& d_;
  const Places& places_;
  std::size_t& spent_;
  Evaluator& evaluator_;
  Scope scope_;
  DiscourseDraft out_;
  std::vector<Played> played_;
  std::unordered_set<const Declaration*> tried_;
  std::int64_t end_ns_ = 0;            ///< of the last sign so far
  std::int64_t stated_pause_ns_ = -1;  ///< before the next utterance; -1: none is stated
  bool full_ = false;
};

}  // namespace

Discourses::Discourses(Evaluator& evaluator) : evaluator_(evaluator) {
  const Declarations& all = evaluator.declarations();
  for (const Declaration& d : all.clips) {
    if (!d.node.is(NodeKind::discourse)) continue;
    const NodeRef own_name = d.node.child(NodeKind::name);
    for (NodeRef item : d.node.children()) {
      const NodeRef name = item.is(NodeKind::role_shift) ? item.at(1) : item;
      if (!name || !name.is(NodeKind::name) || name == own_name) continue;
      const Declaration* utterance = all.find_clip(name.text(), d.file);
      if (utterance != nullptr) part_of_.emplace(utterance, &d);
    }
  }
}

const Places& Discourses::places_in(const Declaration& discourse) {
  std::unique_ptr<Places>& places = places_[&discourse];
  if (!places) {
    places = std::make_unique<Places>();
    Scope scope;
    scope.file = discourse.file;
    PlaceReader reader(evaluator_, scope, *places);
    for (NodeRef item : discourse.node.children())
      if (item.is(NodeKind::role) || item.is(NodeKind::locus)) reader.read(item);
    reader.find_addressees();
  }
  return *places;
}

const Places* Discourses::places_of(const Declaration& utterance) {
  const auto it = part_of_.find(&utterance);
  return it == part_of_.end() ? nullptr : &places_in(*it->second);
}

std::optional<DiscourseDraft> Discourses::lower(const Declaration& discourse) {
  if (discourse.node.has(lang::kFlagError)) return std::nullopt;
  return DiscourseLowering(discourse, places_in(discourse), spent_, evaluator_).run();
}

}  // namespace nms::compiler
