#include "movement.h"

#include <algorithm>
#include <limits>

#include <fmt/format.h>

#include <nms/compiler/diagnostic_kinds.h>

#include "action_unit.h"

namespace nms::compiler {

using lang::NodeKind;
using lang::NodeRef;
using lang::Quantity;
using lang::Unit;

namespace {

constexpr std::size_t kMaxDepth = 64;
constexpr std::size_t kMaxSequences = 1'000;
/// Brackets open at once, over all definitions on the way: the stack is finite.
constexpr std::uint32_t kMaxBrackets = 300;

void scale_pose(Pose& pose, double factor) {
  for (Amount& a : pose) a.value *= factor;
}

void keep_side(Pose& pose, const Channels& channels, program::Side side) {
  pose.erase(std::remove_if(pose.begin(), pose.end(),
                            [&](const Amount& a) {
                              const program::Side s = channels.channels[a.channel].side;
                              return s != program::Side::none && s != side;
                            }),
             pose.end());
}

bool moves_any(const Sequence& sequence, const std::vector<Related>& channels) {
  for (const Step& step : sequence.steps)
    for (const Amount& a : step.pose)
      for (const Related& r : channels)
        if (a.channel >= r.first && a.channel <= r.last) return true;
  return false;
}

}  // namespace

PoseRules::PoseRules(const Channels& channels) : by_channel_(channels.channels.size()) {
  for (std::size_t c = 0; c < channels.channels.size(); ++c) {
    const ChannelInfo& channel = channels.channels[c];
    if (channel.longest_ns != 0) by_channel_[c] |= kBrief;
    if (!channel.hidden_by.empty()) by_channel_[c] |= kHidden;
    for (const Related& by : channel.hidden_by)
      for (std::uint32_t h = by.first; h <= by.last; ++h) by_channel_[h] |= kHides;
  }
}

std::uint8_t PoseRules::of(const Pose& pose, const Channels& channels) const {
  std::uint8_t rules = 0;
  for (const Amount& a : pose) {
    rules |= by_channel_[a.channel];
    if (!(a.value <= 1.0 && a.value >= channels.channels[a.channel].low())) rules |= kCutOff;
  }
  return rules;
}

bool Evaluator::fresh(NodeRef at, std::string_view kind) {
  return reported_.try_emplace({&at.tree(), at.index(), kind}, diagnostics_.all().size()).second;
}

void Evaluator::label_reported(NodeRef at, std::string_view kind, lang::Label label) {
  const auto it = reported_.find({&at.tree(), at.index(), kind});
  if (it != reported_.end()) diagnostics_.add_label(it->second, std::move(label));
}

bool Evaluator::overspend(NodeRef at, const Scope& scope) {
  if (spent_in_all_ > kMaxWorkInAll) {
    if (!overspent_in_all_)
      report(scope, at, TooLarge{"the work that all definitions take", fmt::format("{} steps", kMaxWorkInAll)});
    overspent_in_all_ = true;
    return false;
  }
  if (!overspent_)
    report(scope, at, TooLarge{"the work that this definition takes", fmt::format("{} steps", kMaxWork)});
  overspent_ = true;
  return false;
}

bool Evaluator::add_unit(std::string_view text, std::uint32_t number, program::Side side, double value,
                         const Scale& scale, NodeRef at, const Scope& scope, Pose& into) {
  const UnitInfo* unit = channels_.find_unit(number);
  if (unit == nullptr) {
    report(scope, at,
           UnknownActionUnit{fmt::format("AU{}", number),
                             lang::nearest(fmt::format("AU{}", number), channels_.unit_names())});
    return false;
  }
  const ChannelInfo& channel = channels_.channels[unit->channel];
  value *= scale.factor;
  if (scale.unit != Unit::none) {
    if (!channel.is_axis() || channel.unit != scale.unit) {
      report(scope, scale.node,
             UnitMismatch{std::string(scale.node.text()), std::string(lang::describe(scale.unit)),
                          channel.is_axis() ? std::string(lang::describe(channel.unit)) + " or a share"
                                            : std::string("a share")});
      return false;
    }
    const double full = channel.full_scale < 0.0 ? -channel.full_scale : channel.full_scale;
    value *= scale.absolute / full;
  }
  value *= unit->sign;
  if (side != program::Side::none && !unit->sided) {
    report(scope, at, UnknownSide{std::string(text), fmt::format("AU{}", number)});
    return false;
  }
  if (!unit->sided || side != program::Side::right) add_amount(into, unit->channel, value);
  if (unit->sided && side != program::Side::left) add_amount(into, unit->channel + 1, value);
  return true;
}

bool Evaluator::action_unit(NodeRef token, const Scale& scale, const Scope& scope, Movement& into) {
  const auto unit = read_action_unit(token.text());
  if (!unit) {
    report(scope, token, UnknownActionUnit{std::string(token.text()), {}});
    return false;
  }
  return add_unit(token.text(), unit->number, unit->side, unit->intensity, scale, token, scope, into.pose);
}

bool Evaluator::scales_without_unit(const Scale& scale, const Scope& scope) {
  if (scale.unit == Unit::none) return true;
  report(scope, scale.node,
         UnitMismatch{std::string(scale.node.text()), std::string(lang::describe(scale.unit)),
                      "a share or a plain number"});
  return false;
}

bool Evaluator::take(Movement&& part, const Scale& scale, NodeRef at, const Scope& scope, Movement& into) {
  if (!scales_without_unit(scale, scope)) return false;
  // A long sequence costs what it weighs, wherever it is copied to.
  for (const Sequence& s : part.sequences)
    if (!spend(at, scope, s.steps.size())) return false;
  for (const Amount& a : part.pose) add_amount(into.pose, a.channel, a.value * scale.factor);
  for (Sequence& s : part.sequences) {
    for (Step& step : s.steps) scale_pose(step.pose, scale.factor);
    into.sequences.push_back(std::move(s));
  }
  for (Oscillation& o : part.oscillations) {
    o.by *= scale.factor;
    into.oscillations.push_back(o);
  }
  if (into.sequences.size() > kMaxSequences || into.oscillations.size() > kMaxSequences) {
    report(scope, at, TooLarge{"the number of movements in one sum", fmt::format("{}", kMaxSequences)});
    return false;
  }
  return true;
}

bool Evaluator::named(NodeRef name, NodeRef call, const Scale& scale, const Scope& scope, Movement& into) {
  const std::string_view word = name.text();
  if (call) {
    if (word == "oscillate") return oscillate(call, scale, scope, into);
    if (word == "left" || word == "right" || word == "dominant" || word == "contra") {
      const NodeRef a = call.child(NodeKind::argument);
      const NodeRef inner = a ? a.at(0) : NodeRef();
      if (!inner || a.node().next != call.node().next) {
        report(scope, call, MissingArgument{std::string(word), ""});
        return false;
      }
      auto part = sum(inner, scope);
      if (!part) return false;
      const bool left =
          word == "left" || (word == "dominant" && scope.left_handed) || (word == "contra" && !scope.left_handed);
      const program::Side side = left ? program::Side::left : program::Side::right;
      keep_side(part->pose, channels_, side);
      for (Sequence& s : part->sequences)
        for (Step& step : s.steps) keep_side(step.pose, channels_, side);
      return take(std::move(*part), scale, name, scope, into);
    }
  }
  bool skip_first = false;
  const Declaration* d = declarations_.find_movement(word, scope.file);
  std::string variant;
  if (call) {
    // A first argument that is a bare word picks the variant `name_word`: jut(forward, 60%) is jut_forward(60%).
    const NodeRef a = call.child(NodeKind::argument);
    if (a && !a.has(lang::kFlagNamed)) {
      NodeRef w = a.at(0);
      if (w && w.is(NodeKind::sum) && w.at(0) && w.at(0).is(NodeKind::term) && !w.at(1) && !w.at(0).at(1))
        w = w.at(0).at(0);
      if (w && w.is(NodeKind::name) && argument(w.text(), scope) == nullptr) {
        variant = fmt::format("{}_{}", word, w.text());
        const Place* place = scope.places != nullptr ? scope.places->find(w.text()) : nullptr;
        // A variant goes before a place: names of places mean nothing to the library. But inside a role shift the
        // addressee is the quoted one's.
        const bool quoted = place != nullptr && w.text() == "addressee";
        if (place != nullptr && (quoted || declarations_.find_movement(variant, scope.file) == nullptr))
          return towards(name, call, *place, scale, scope, into);
        if (const Declaration* v = declarations_.find_movement(variant, scope.file)) {
          d = v;
          skip_first = true;
        } else if (d == nullptr && scope.places != nullptr) {
          report(scope, w,
                 UnknownName{fmt::format("place in this discourse, and no pose {},", variant), std::string(w.text()),
                             similar(w.text(), [&] {
                               std::vector<std::string> names;
                               for (const Place& p : scope.places->known) names.emplace_back(p.name);
                               return names;
                             })});
          return false;
        } else if (d == nullptr) {
          report(scope, w, UnknownName{"pose, expression or motion", variant, similar(variant, [&] {
                                         return declarations_.movement_names(scope.file);
                                       })});
          return false;
        }
      }
    }
  }
  if (d == nullptr) {
    const Argument* a = argument(word, scope);
    if (a != nullptr) {
      report(scope, name,
             WrongKind{std::string(word), "a number", "a pose, expression or motion",
                       fmt::format("to scale by it, write {} * P", word)});
      return false;
    }
    auto& missing = report(scope, name, UnknownName{"pose, expression or motion", std::string(word), similar(word, [&] {
                                                      return declarations_.movement_names(scope.file);
                                                    })});
    if (const LexiconDeclaration* l = declarations_.lexicon_with(word))
      missing.helps.push_back(fmt::format(
          "it is an entry of {0}, which belongs in an utterance: utterance NAME in {0} {{ }}", l->declaration.name));
    return false;
  }
  auto inner = bind(call, skip_first, d->name, declarations_.params(*d), d->file, scope);
  if (!inner) return false;
  if (const Known* k = known(*d, *inner); k != nullptr && k->state == Known::State::pose) {
    if (!scales_without_unit(scale, scope)) return false;
    poses_.add_to(into.pose, k->at, scale.factor);
    return true;
  }
  auto part = declaration(*d, *inner);
  if (!part) return false;
  return take(std::move(*part), scale, name, scope, into);
}

bool Evaluator::towards(NodeRef name, NodeRef call, const Place& place, const Scale& scale, const Scope& scope,
                        Movement& into) {
  const std::string wanted = fmt::format("{}_towards", name.text());
  const Declaration* d = declarations_.find_movement(wanted, scope.file);
  if (d == nullptr) {
    report(scope, name, UnknownName{"pose, expression or motion", wanted, similar(wanted, [&] {
                                      return declarations_.movement_names(scope.file);
                                    })});
    return false;
  }
  auto inner = bind(call, true, d->name, d->node.child(NodeKind::params), d->file, scope);
  if (!inner) return false;
  // Which way the place is, for those of these parameters that the movement has.
  for (Argument& a : inner->arguments) {
    if (a.quantity.unit != Unit::angle) continue;
    if (a.name == "yaw") a.quantity.value = place.yaw_deg;
    if (a.name == "pitch") a.quantity.value = place.pitch_deg;
    if (a.name == "addressee") a.quantity.value = scope.places->addressee_yaw_deg;
  }
  auto part = declaration(*d, *inner);
  if (!part) return false;
  return take(std::move(*part), scale, name, scope, into);
}

bool Evaluator::term(NodeRef node, const Scope& scope, Movement& into) {
  if (!spend(node, scope)) return false;
  Scale scale;
  if (node.has(lang::kFlagMinus)) scale.factor = -1.0;
  for (NodeRef part : node.children()) {
    if (part.is(NodeKind::factor)) {
      if (!multiply_by(part, scope, scale)) return false;
      continue;
    }
    switch (part.kind()) {
      case NodeKind::au_token:
        return action_unit(part, scale, scope, into);
      case NodeKind::facs:
        return facs(part, scale, scope, into);
      case NodeKind::mouthing:
        return mouthing(part, scale, scope, into);
      case NodeKind::name:
        return named(part, {}, scale, scope, into);
      case NodeKind::call:
        return named(part.at(0), part, scale, scope, into);
      case NodeKind::group: {
        auto inner = sum(part.at(0), scope);
        return inner && take(std::move(*inner), scale, part, scope, into);
      }
      case NodeKind::steps: {
        auto s = sequence(part, "", std::nullopt, scope);
        if (!s) return false;
        Movement m;
        m.sequences.push_back(std::move(*s));
        return take(std::move(m), scale, part, scope, into);
      }
      case NodeKind::quantity:
        report(scope, part,
               WrongKind{std::string(part.text()), "a number", "a pose, expression or motion",
                         "write what it scales after it: 60% AU12"});
        return false;
      default:
        return false;
    }
  }
  return false;
}

std::optional<Movement> Evaluator::sum(NodeRef node, const Scope& scope) {
  if (!node || node.has(lang::kFlagError)) return std::nullopt;
  if (depth_ >= kMaxBrackets) {
    report(scope, node, TooLarge{"the depth of brackets and definitions", fmt::format("{}", kMaxBrackets)});
    return std::nullopt;
  }
  if (depth_ == 0 && open_.empty()) {  // what is placed starts afresh, as a declaration does
    spent_ = 0;
    overspent_ = false;
  }
  ++depth_;
  auto out = sum_within(node, scope);
  --depth_;
  return out;
}

std::optional<Movement> Evaluator::sum_within(NodeRef node, const Scope& scope) {
  Movement out;
  constexpr std::size_t kUsual = 12;  // amounts in most poses: one allocation
  out.pose.reserve(kUsual);
  bool good = true;
  if (node.is(NodeKind::name)) {  // an argument that is a bare name: left(smile)
    if (!named(node, {}, {}, scope, out)) return std::nullopt;
    return out;
  }
  if (!node.is(NodeKind::sum)) {
    report(scope, node,
           WrongKind{std::string(node.text()), std::string(lang::describe(node.kind())), "a pose, expression or motion",
                     ""});
    return std::nullopt;
  }
  for (NodeRef t : node.children())
    if (t.is(NodeKind::term)) good = term(t, scope, out) && good;
  if (!good) return std::nullopt;
  for (const Amount& a : out.pose)
    if (!(a.value >= -kMaxAmount && a.value <= kMaxAmount)) {
      report(scope, node,
             OutOfRange{std::string(node.text()), fmt::format("what may be added up, {}%", kMaxAmount * 100.0)});
      return std::nullopt;
    }
  return out;
}

/// Works out again what was checked and not kept. It went well then, so that it is free now, and where it stands on the
/// way does not count.
class Evaluator::Recall {
 public:
  explicit Recall(Evaluator& evaluator)
      : evaluator_(evaluator),
        open_(std::exchange(evaluator.open_, {})),
        depth_(std::exchange(evaluator.depth_, 0U)),
        spent_(evaluator.spent_),
        spent_in_all_(std::exchange(evaluator.spent_in_all_, 0U)),
        overspent_(evaluator.overspent_) {}
  ~Recall() {
    evaluator_.open_ = std::move(open_);
    evaluator_.depth_ = depth_;
    evaluator_.spent_ = spent_;
    evaluator_.spent_in_all_ = spent_in_all_;
    evaluator_.overspent_ = overspent_;
  }
  Recall(const Recall&) = delete;
  Recall& operator=(const Recall&) = delete;

 private:
  Evaluator& evaluator_;
  std::vector<NodeRef> open_;
  std::uint32_t depth_;
  std::uint32_t spent_;
  std::uint64_t spent_in_all_;
  bool overspent_;
};

Evaluator::Known* Evaluator::known(const Declaration& d, const Scope& scope) {
  if (!scope.arguments.empty() || scope.places != nullptr) return nullptr;
  const std::uint32_t number = declarations_.movement_number(d);
  if (number == kUnreachable) return nullptr;
  std::vector<Known>& table = known_[scope.left_handed ? 1 : 0];
  if (table.empty()) table.resize(declarations_.movements.size());
  return &table[number];
}

void Evaluator::keep(Known& known, const Declaration& d, const std::optional<Movement>& result) {
  if (!result) {
    known = {Known::State::wrong, 0, 0, 0};
  } else if (d.node.is(NodeKind::pose)) {
    known = {Known::State::pose, rules_.of(result->pose, channels_), static_cast<std::uint16_t>(result->pose.size()),
             poses_.keep(result->pose)};
  } else {
    if (product_ == Product::diagnostics && d.node.is(NodeKind::expression) && known.state != Known::State::checked)
      if (const auto most = most_knots(*result)) {
        known = {Known::State::checked, 0, 0, *most};
        return;
      }
    known = {Known::State::movement, 0, 0, static_cast<std::uint32_t>(movements_.size())};
    movements_.push_back(*result);
  }
}

std::optional<std::uint32_t> Evaluator::most_knots(const Movement& expression) const {
  if (expression.sequences.empty()) return 0;
  const Sequence& sequence = expression.sequences.front();
  if (sequence.steps.empty() || sequence.duration_ns < 0) return 0;
  std::size_t amounts = 0;  // there are no more channels than that
  std::size_t pieces = 1;
  bool plain = true;
  for (const Step& step : sequence.steps) {
    amounts += step.pose.size();
    const auto more = most_pieces(step.easing);
    if (!more) return std::nullopt;
    pieces += *more;
    for (const Amount& a : step.pose) {
      const ChannelInfo& c = channels_.channels[a.channel];
      plain = plain && a.value <= 1.0 && a.value >= c.low() &&
              (c.longest_ns == 0 || sequence.duration_ns <= c.longest_ns) &&
              (c.hidden_by.empty() || !moves_any(sequence, c.hidden_by));
    }
  }
  // What has to be drawn to be judged: a curve that is cut off, one that may last too long or is hidden in part, one
  // with very many shapes and one that ends very late. No other rule of a unit speaks of what is one cause in one
  // layer.
  if (!plain || pieces >= program::kShapeFirstReserved || sequence.duration_ns > program::kTimeLimit_ns)
    return std::nullopt;
  const std::size_t most = std::max<std::size_t>(amounts * pieces, 1);
  if (most > std::numeric_limits<std::uint32_t>::max()) return std::nullopt;
  return static_cast<std::uint32_t>(most);
}

std::optional<std::size_t> Evaluator::most_knots(const Declaration& d) const {
  const std::uint32_t number = declarations_.movement_number(d);
  if (number == kUnreachable || known_[0].empty() || known_[0][number].state != Known::State::checked)
    return std::nullopt;
  return known_[0][number].at;
}

std::optional<Movement> Evaluator::declaration(const Declaration& d, const Scope& scope) {
  Known* const known = this->known(d, scope);
  if (known == nullptr) return work_out(d, scope, nullptr);
  switch (known->state) {
    case Known::State::wrong:
      return std::nullopt;
    case Known::State::pose: {
      Movement still;
      poses_.add_to(still.pose, known->at, 1.0);
      return still;
    }
    case Known::State::movement:
      return movements_[known->at];
    case Known::State::plain:
    case Known::State::checked: {
      const Recall recall(*this);
      return work_out(d, scope, known);
    }
    case Known::State::untried:
      break;
  }
  return work_out(d, scope, known);
}

std::optional<Movement> Evaluator::work_out(const Declaration& d, const Scope& scope, Known* known) {
  const std::uint64_t key =
      (std::uint64_t{d.file} << 33U) | (std::uint64_t{d.node.index()} << 1U) | (scope.left_handed ? 1U : 0U);
  if (too_heavy_.count(key) != 0) return std::nullopt;
  if (std::find(open_.begin(), open_.end(), d.node) != open_.end()) {
    report(scope, d.node.child(NodeKind::name), RecursiveDefinition{std::string(d.name)});
    return std::nullopt;
  }
  if (open_.size() >= kMaxDepth) {
    report(scope, d.node.child(NodeKind::name), TooLarge{"the depth of definitions", fmt::format("{}", kMaxDepth)});
    return std::nullopt;
  }
  const bool outermost = open_.empty();
  if (outermost) {
    spent_ = 0;
    overspent_ = false;
  }
  open_.push_back(d.node);
  std::optional<Movement> result;
  if (!d.node.has(lang::kFlagError)) {
    switch (d.node.kind()) {
      case NodeKind::pose:
        result = sum(d.node.child(NodeKind::sum), scope);
        if (result && !result->still()) {
          const NodeRef s = d.node.child(NodeKind::sum);
          report(scope, s,
                 WrongKind{std::string(d.name), "made of a movement", "a pose",
                           "declare it as a motion: motion " + std::string(d.name) + " = ..."});
          result.reset();
        }
        break;
      case NodeKind::motion:
        if (const NodeRef steps = d.node.child(NodeKind::steps)) {
          if (auto s = sequence(steps, d.name, std::nullopt, scope)) {
            result.emplace();
            result->sequences.push_back(std::move(*s));
          }
        } else {
          result = sum(d.node.child(NodeKind::sum), scope);
          if (result)
            for (Oscillation& o : result->oscillations)
              if (o.name.empty()) o.name = d.name;
        }
        break;
      case NodeKind::expression: {
        std::optional<std::int64_t> duration;
        bool good = true;
        if (const NodeRef length = d.node.child(NodeKind::quantity)) {
          const auto q = quantity(length, Unit::time, scope);
          if (q && q->nanoseconds <= 0) report(scope, length, OutOfRange{std::string(length.text()), "times above 0s"});
          good = q && q->nanoseconds > 0;
          if (q) duration = q->nanoseconds;
        }
        if (good) {
          if (auto s = sequence(d.node, d.name, duration, scope)) {
            result.emplace();
            result->sequences.push_back(std::move(*s));
          }
        }
        break;
      }
      default:
        break;
    }
  }
  open_.pop_back();
  if (outermost && overspent_) too_heavy_.insert(key);
  if (known != nullptr) keep(*known, d, result);
  return result;
}

}  // namespace nms::compiler
