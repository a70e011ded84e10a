#include "explain.h"

namespace nms::compiler {
namespace {

double farthest_from_rest(const Curve& curve) {
  double peak = 0.0;
  for (const CurveKnot& k : curve.knots)
    if ((k.value < 0.0 ? -k.value : k.value) > (peak < 0.0 ? -peak : peak)) peak = k.value;
  return peak;
}

Cause::Phase phase_of(const Contribution& c, std::int64_t time_ns) {
  if (time_ns < c.start_ns) return Cause::Phase::before;
  if (c.held && time_ns >= c.release_ns) return Cause::Phase::held;
  if (time_ns >= c.end_ns) return Cause::Phase::after;
  if (!c.pose) return Cause::Phase::moving;
  if (time_ns < c.apex_ns) return Cause::Phase::onset;
  return time_ns < c.release_ns ? Cause::Phase::apex : Cause::Phase::offset;
}

}  // namespace

Cause ExplanationRecorder::cause(const Contribution& c) const {
  Cause out;
  if (const DraftSource* made = source_at(clip_, c.curve, time_ns_)) {
    out.source = made->node.tree().source_pointer();
    out.range = made->node.range();
    out.entry = made->entry;
  }
  if (c.used) {
    out.used_source = c.used.tree().source_pointer();
    out.used_range = c.used.range();
  }
  out.layer = layer_name(c.layer);
  out.stated = c.stated;
  out.movement = c.pose ? Cause::Movement::pose : c.motion.empty() ? Cause::Movement::steps : Cause::Movement::swing;
  out.phase = phase_of(c, time_ns_);
  out.value = c.curve.value(time_ns_);
  out.envelope = c.envelope.value(time_ns_);
  out.peak = farthest_from_rest(c.curve);
  out.start_ns = c.start_ns;
  out.apex_ns = c.apex_ns;
  out.release_ns = c.release_ns;
  out.end_ns = c.end_ns;
  out.span_start_ns = c.span_start_ns;
  out.span_end_ns = c.span_end_ns;
  for (std::uint32_t g = c.gave_way; g != kUnreachable; g = clip_.givings[g].before) {
    const Giving& giving = clip_.givings[g];
    out.given.insert(out.given.begin(), Cause::Given{std::string(giving.to->name), giving.taken.value(time_ns_),
                                                     giving.rule.tree().source_pointer(), giving.rule.range()});
  }
  return out;
}

void ExplanationRecorder::channel(std::uint32_t channel, const std::vector<const Contribution*>& all) {
  explained_.push_back({channel, {}, {}});
  index_.clear();
  first_ = true;
  for (const Contribution* c : all) {
    index_[c] = current().causes.size();
    current().causes.push_back(cause(*c));
  }
}

void ExplanationRecorder::repeated(const Contribution& left_out) {
  current().causes[index_.at(&left_out)].fate = Cause::Fate::repeated;
}

void ExplanationRecorder::let_go(const Contribution& held, const Contribution& going, const Contribution&) {
  const std::size_t at = index_.at(&held);
  index_[&going] = at;
  Cause& c = current().causes[at];
  c.fate = Cause::Fate::let_go;
  c.phase = phase_of(going, time_ns_);
  c.value = going.curve.value(time_ns_);
  c.envelope = going.envelope.value(time_ns_);
  c.release_ns = going.release_ns;
  c.end_ns = going.end_ns;
}

void ExplanationRecorder::joined(const Contribution& pose, const Contribution& joint) {
  const std::size_t at = index_.at(&pose);
  index_.emplace(&joint, at);
  current().causes[at].fate = Cause::Fate::joined;
}

void ExplanationRecorder::group(const std::vector<const Contribution*>& of, bool stated, program::MergeOperator op,
                                bool sum, const Curve& merged) {
  MergeStep step;
  step.kind = sum                                       ? MergeStep::Kind::sum
              : op == program::MergeOperator::strongest ? MergeStep::Kind::strongest
                                                        : MergeStep::Kind::latest;
  step.name = stated ? std::string_view("stated") : layer_name(of.front()->layer);
  for (const Contribution* c : of) step.operands.push_back({c->curve.value(time_ns_), index_.at(c)});
  step.result = group_ = merged.value(time_ns_);
  current().steps.push_back(std::move(step));
}

void ExplanationRecorder::scaled(Layer, const Curve& taken, const Curve& merged) {
  const double result = merged.value(time_ns_);
  current().steps.push_back({MergeStep::Kind::scale, {}, {{group_, 0}}, taken.value(time_ns_), result});
  group_ = result;
}

void ExplanationRecorder::layers(Layer, const Curve* envelope, const Curve& merged) {
  const double result = merged.value(time_ns_);
  if (!first_) {
    const MergeStep::Kind kind = envelope != nullptr                               ? MergeStep::Kind::highest
                                 : channels_.channels[current().channel].is_axis() ? MergeStep::Kind::add
                                                                                   : MergeStep::Kind::either;
    current().steps.push_back(
        {kind, {}, {{below_, 0}, {group_, 0}}, envelope != nullptr ? envelope->value(time_ns_) : 1.0, result});
  }
  first_ = false;
  below_ = result;
}

void ExplanationRecorder::replaced(const Curve& envelope, const Curve& merged) {
  const double result = merged.value(time_ns_);
  current().steps.push_back(
      {MergeStep::Kind::replace, {}, {{below_, 0}, {group_, 0}}, envelope.value(time_ns_), result});
  below_ = result;
}

void ExplanationRecorder::hidden(const Curve& taken, const Curve& merged) {
  const double value = current().steps.empty() ? 0.0 : current().steps.back().result;
  current().steps.push_back({MergeStep::Kind::hide, {}, {{value, 0}}, taken.value(time_ns_), merged.value(time_ns_)});
}

}  // namespace nms::compiler
