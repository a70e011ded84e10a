#include "plain_movement.h"

#include <algorithm>
#include <array>

namespace nms::compiler {

using lang::NodeKind;
using lang::NodeList;
using lang::ShapeNode;

namespace {

/// `60% AU12`
constexpr std::array<ShapeNode, 4> kScaledUnit{
    {{NodeKind::term, 4}, {NodeKind::factor, 2}, {NodeKind::quantity, 1}, {NodeKind::au_token, 1}}};
/// `40%: p`
constexpr std::array<ShapeNode, 5> kNamedStep{
    {{NodeKind::step, 5}, {NodeKind::quantity, 1}, {NodeKind::sum, 3}, {NodeKind::term, 2}, {NodeKind::name, 1}}};

/// Of an expression: many more than any has.
constexpr std::uint32_t kMostSteps = 1'000;

constexpr int kNone = -1;

/// The value of a digit; of anything else more than 9.
unsigned digit(char c) { return static_cast<unsigned char>(c) - unsigned{'0'}; }

/// `60%` as 60, up to 100 %, or kNone.
int whole_percentage(std::string_view text) {
  const std::size_t digits = text.size() - 1;
  if (digits > 3 || text[digits] != '%') return kNone;
  unsigned percent = 0;
  for (std::size_t i = 0; i < digits; ++i) {
    if (digit(text[i]) > 9) return kNone;
    percent = percent * 10 + digit(text[i]);
  }
  return percent <= 100 ? static_cast<int>(percent) : kNone;
}

/// `AU12`, `AU12L`; of anything else no number.
struct UnitName {
  unsigned number = 0;
  char side = '\0';

  explicit UnitName(std::string_view text) {
    constexpr std::size_t kMostDigits = 3;
    if (text[0] != 'A' || text[1] != 'U') return;
    std::size_t at = 2;
    unsigned read = 0;
    for (; at < text.size() && at < 2 + kMostDigits && digit(text[at]) <= 9; ++at) read = read * 10 + digit(text[at]);
    if (at < text.size() && (text[at] == 'L' || text[at] == 'R')) side = text[at++];
    if (at == text.size()) number = read;
  }
};

/// The first node behind a declaration's comments.
std::uint32_t behind_docs(const NodeList& nodes, std::uint32_t declaration) {
  std::uint32_t at = declaration + 1;
  while (at < nodes.size() && nodes.kind(at) == NodeKind::doc_comment) ++at;
  return at;
}

}  // namespace

PlainMovements::PlainMovements(Evaluator& evaluator) : evaluator_(evaluator), declarations_(evaluator.declarations()) {
  const Channels& channels = evaluator.channels();
  for (const UnitInfo& unit : channels.units) {
    if (unit.number >= units_.size()) units_.resize(unit.number + 1U);
    // A share of a unit is in range on each of its channels: on an axis whichever way it goes.
    if (unit.sign == 1.0 || (unit.sign == -1.0 && channels.channels[unit.channel].is_axis()))
      units_[unit.number] = {static_cast<std::uint16_t>(unit.channel), true, unit.sided};
  }
  moved_.resize(channels.channels.size() / 64 + 1);
  evaluator.known_[0].resize(declarations_.movements.size());
}

bool PlainMovements::work_out(std::uint32_t number) {
  const Declaration& d = declarations_.movements[number];
  if (number >= block_end_) read_ahead(number);
  if (d.node.has(lang::kFlagError) || declarations_.has_params(number) ||
      evaluator_.known_[0][number].state != Evaluator::Known::State::untried)
    return false;
  return d.node.is(NodeKind::pose) ? pose(number) : d.node.is(NodeKind::expression) && expression(number);
}

/// Work counts as the evaluator counts it. False: it would be too much.
bool PlainMovements::spend(std::uint32_t steps) {
  if (steps > Evaluator::kMaxWork || evaluator_.spent_in_all_ + steps > Evaluator::kMaxWorkInAll) return false;
  evaluator_.spent_in_all_ += steps;
  return true;
}

bool PlainMovements::pose(std::uint32_t number) {
  const lang::NodeRef node = declarations_.movements[number].node;
  const NodeList& nodes = node.tree().nodes();
  const std::uint32_t end = nodes.next(node.index());
  const std::uint32_t sum = behind_docs(nodes, node.index()) + 1;  // its name comes first
  if (sum >= end || nodes.kind(sum) != NodeKind::sum || nodes.next(sum) != end) return false;
  std::fill(moved_.begin(), moved_.end(), 0);
  Evaluator::Known known{Evaluator::Known::State::plain, 0, 0, 0};
  for (std::uint32_t term = sum + 1; term != end; term += kScaledUnit.size())
    if (!nodes.has_shape(term, kScaledUnit) || !add_term(node.tree(), term, known)) return false;
  if (!spend((end - sum) / kScaledUnit.size())) return false;
  evaluator_.known_[0][number] = known;
  return true;
}

bool PlainMovements::add_term(const lang::Tree& tree, std::uint32_t term, Evaluator::Known& pose) {
  if (whole_percentage(tree.near_text(term + 2)) == kNone) return false;
  const UnitName name(tree.near_text(term + 3));
  if (name.number >= units_.size()) return false;
  const Unit unit = units_[name.number];
  if (!unit.exists || (!unit.sided && name.side != '\0')) return false;
  return (name.side == 'R' || add(unit.channel, pose)) &&
         (!unit.sided || name.side == 'L' || add(unit.channel + 1U, pose));
}

/// False: the pose moves it already. Sums are left to those who round them.
bool PlainMovements::add(std::uint32_t channel, Evaluator::Known& pose) {
  std::uint64_t& word = moved_[channel / 64];
  const std::uint64_t bit = std::uint64_t{1} << channel % 64;
  if ((word & bit) != 0) return false;
  word |= bit;
  ++pose.amounts;
  pose.rules |= evaluator_.rules_.of(channel);
  return true;
}

void PlainMovements::read_ahead(std::uint32_t number) {
  const std::vector<Declaration>& movements = declarations_.movements;
  block_end_ = static_cast<std::uint32_t>(std::min<std::size_t>(number + kBlock, movements.size()));
  block_.assign(kBlock, {});
  steps_.clear();
  names_.clear();
  if (evaluator_.product_ != Product::diagnostics) return;  // expressions are wanted whole
  for (std::uint32_t i = number; i < block_end_; ++i) {
    const auto first = static_cast<std::uint32_t>(steps_.size());
    if (movements[i].node.is(NodeKind::expression) && add_steps(movements[i]))
      block_[i % kBlock] = {first, static_cast<std::uint32_t>(steps_.size()) - first};
  }
  for (std::uint32_t i = number; i < block_end_; ++i) {
    const Steps steps = block_[i % kBlock];
    for (std::uint32_t s = steps.first; s < steps.first + steps.count; ++s) {
      steps_[s].pose = declarations_.own_movement(names_[s], movements[i].file);
      if (steps_[s].pose != kUnreachable) __builtin_prefetch(&evaluator_.known_[0][steps_[s].pose]);
    }
  }
}

/// The steps of an expression, up to one that is not plain: then false.
bool PlainMovements::add_steps(const Declaration& expression) {
  const lang::Tree& tree = expression.node.tree();
  const NodeList& nodes = tree.nodes();
  const std::uint32_t end = nodes.next(expression.node.index());
  const std::uint32_t length = behind_docs(nodes, expression.node.index()) + 1;  // its name comes first
  if (length >= end || nodes.kind(length) != NodeKind::quantity) return false;
  if (end - length > kMostSteps * kNamedStep.size()) return false;
  for (std::uint32_t step = length + 1; step != end; step += kNamedStep.size()) {
    if (!nodes.has_shape(step, kNamedStep)) return false;
    steps_.push_back({step + 1, 0});
    names_.emplace_back(tree.near_text(step + 4));
    declarations_.prefetch_movement(names_.back());
  }
  return true;
}

bool PlainMovements::expression(std::uint32_t number) {
  const Steps steps = block_[number % kBlock];
  if (steps.count == 0) return false;
  const lang::Tree& tree = declarations_.movements[number].node.tree();
  double shares = 0.0;
  std::uint32_t amounts = 0;
  std::uint8_t rules = 0;
  for (std::uint32_t i = steps.first; i < steps.first + steps.count; ++i) {
    const int percent = whole_percentage(tree.near_text(steps_[i].share));
    if (percent == kNone || steps_[i].pose == kUnreachable) return false;
    const Evaluator::Known& pose = evaluator_.known_[0][steps_[i].pose];
    if (!pose.is_pose()) return false;
    shares += percent / 100.0;
    amounts += pose.amounts;
    rules |= pose.rules;
  }
  // What has to be drawn to be judged, see Evaluator::most_knots.
  const auto any = [&](std::uint8_t rule) { return (rules & rule) != 0; };
  if (any(PoseRules::kCutOff) || any(PoseRules::kBrief) || (any(PoseRules::kHidden) && any(PoseRules::kHides)))
    return false;
  const std::uint32_t length = steps_[steps.first].share - 2;  // before the first step
  const auto duration = lang::read_quantity(lang::NodeRef(&tree, length).text());
  if (!duration || duration->unit != lang::Unit::time || duration->nanoseconds <= 0 ||
      duration->nanoseconds > program::kTimeLimit_ns)
    return false;
  const double whole = static_cast<double>(duration->nanoseconds);
  const double total = shares * whole;
  if (total - whole > 1.0 || whole - total > 1.0 || !spend(steps.count)) return false;
  evaluator_.known_[0][number] = {Evaluator::Known::State::checked, 0, 0, std::max(amounts * (steps.count + 1), 1U)};
  return true;
}

}  // namespace nms::compiler
