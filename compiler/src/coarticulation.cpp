#include "coarticulation.h"

#include <algorithm>

#include "merge.h"

namespace nms::compiler {

namespace {

bool starts_before(const Contribution* a, const Contribution* b) { return a->start_ns < b->start_ns; }

/// `next` begins once `pose` is at its apex, and is reached after the release: there is one way between the two.
bool runs_into(const Contribution& pose, const Contribution& next) {
  if (!pose.joins() || !next.joins() || pose.held) return false;
  if (next.start_ns < pose.apex_ns || next.apex_ns <= pose.release_ns) return false;
  return next.start_ns <= pose.end_ns || next.apex_ns - pose.release_ns < kHeldThroughNs;
}

/// Cuts `curve` off behind `release_ns`, goes straight to what `next` is at `apex_ns`, and on with that. A pose has a
/// knot at its release and at its apex.
void go_on_with(Curve& curve, std::int64_t release_ns, const Curve& next, std::int64_t apex_ns, Easing easing) {
  const auto release = std::lower_bound(curve.knots.begin(), curve.knots.end(), release_ns,
                                        [](const CurveKnot& k, std::int64_t t) { return k.time_ns < t; });
  const auto after = std::upper_bound(next.knots.begin(), next.knots.end(), apex_ns,
                                      [](std::int64_t t, const CurveKnot& k) { return t < k.time_ns; });
  if (release == curve.knots.end() || after == next.knots.begin()) return;
  curve.knots.erase(release + 1, curve.knots.end());
  const CurveKnot& apex = *(after - 1);
  ease_to(curve, apex_ns, apex.value, easing, apex.source);
  curve.knots.back() = apex;
  curve.knots.insert(curve.knots.end(), after, next.knots.end());
}

}  // namespace

void end_held(std::vector<const Contribution*>& all, std::deque<Contribution>& made, MergeObserver* observer) {
  std::vector<std::size_t> order(all.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return starts_before(all[a], all[b]); });
  const std::vector<const Contribution*> was = all;
  // The first that outlasts a held one is looked for from the back: what ends before a later one's end never is it.
  std::vector<std::size_t> outlasting;  // by falling start, rising end towards the front
  for (std::size_t k = order.size(); k-- > 0;) {
    const Contribution& c = *was[order[k]];
    if (c.held) {
      const Contribution* next = nullptr;
      for (std::size_t i = outlasting.size(); i-- > 0 && next == nullptr;)
        if (was[outlasting[i]]->end_ns > c.release_ns) next = was[outlasting[i]];
      if (next != nullptr) {
        Contribution going = c;
        const std::int64_t from = std::max(next->start_ns, c.release_ns);
        const std::int64_t onset =
            next->envelope.knots.size() > 1 ? next->envelope.knots[1].time_ns - next->envelope.knots[0].time_ns : 0;
        const std::int64_t to = std::min(from + onset, std::max(from, next->end_ns));
        for (Curve* curve : {&going.curve, &going.envelope}) {
          if (curve->knots.empty()) continue;
          if (curve->knots.back().time_ns > from) *curve = until(*curve, from);  // another takes some of it later on
          const std::uint32_t source = curve->knots.back().source;
          ease_to(*curve, from, curve->knots.back().value, Easing::smooth, source);
          ease_to(*curve, to, 0.0, curve == &going.envelope ? settled(next->easing) : next->easing, source);
        }
        going.release_ns = from;
        going.end_ns = to;
        going.held = false;
        made.push_back(std::move(going));
        if (observer != nullptr) observer->let_go(c, made.back(), *next);
        all[order[k]] = &made.back();
      }
    }
    if (c.layer == Layer::ambient) continue;  // a breath ends nothing
    while (!outlasting.empty() && was[outlasting.back()]->end_ns <= c.end_ns) outlasting.pop_back();
    outlasting.push_back(order[k]);
  }
}

void coarticulate(std::vector<const Contribution*>& group, program::MergeOperator op, std::deque<Contribution>& made,
                  MergeObserver* observer) {
  if (group.size() < 2) return;
  std::stable_sort(group.begin(), group.end(), starts_before);
  std::vector<const Contribution*> out;
  Contribution* joint = nullptr;       // the chain that is being made, the last of `made`
  const Contribution* last = nullptr;  // the pose it ends with
  std::size_t place = 0;               // of the chain, or of its only pose, in `out`
  const auto keep = [&](const Contribution* c) { out.push_back(c); };
  for (const Contribution* c : group) {
    // Under `latest` nothing may begin between the two: it would take the place of one and not of the other.
    if (!c->joins() && op != program::MergeOperator::latest) {
      keep(c);
      continue;
    }
    if (last == nullptr || !runs_into(*last, *c)) {
      joint = nullptr;
      last = c;
      place = out.size();
      keep(c);
      continue;
    }
    if (joint == nullptr) {
      made.push_back(*last);
      joint = &made.back();
      out[place] = joint;
      if (observer != nullptr) observer->joined(*last, *joint);
    }
    if (observer != nullptr) observer->joined(*c, *joint);
    go_on_with(joint->curve, last->release_ns, c->curve, c->apex_ns, c->easing);
    go_on_with(joint->envelope, last->release_ns, c->envelope, c->apex_ns, settled(c->easing));
    joint->end_ns = c->end_ns;
    joint->release_ns = c->release_ns;
    joint->held = c->held;
    if (op == program::MergeOperator::strongest) {
      if (last->end_ns > c->apex_ns) keep(last);
      if (c->start_ns < last->release_ns) keep(c);
    }
    last = c;
  }
  group = std::move(out);
}

}  // namespace nms::compiler
