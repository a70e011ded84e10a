#include "removals.h"

#include <string_view>

namespace nms::compiler {
namespace {

using lang::NodeKind;
using lang::NodeRef;
using lang::Range;
using Part = Removal::Part;

bool is_phase(std::string_view property) {
  for (const std::string_view known : {"onset", "apex", "offset", "lead", "lag", "easing", "held"})
    if (property == known) return true;
  return false;
}

class Collector {
 public:
  std::vector<RemovablePart> take() { return std::move(parts_); }

  /// What stands in an entry, under a condition or among alternatives.
  void items(NodeRef parent) {
    for (NodeRef item : parent.children()) {
      switch (item.kind()) {
        case NodeKind::property:
        case NodeKind::profile:
          property(item);
          break;
        case NodeKind::placement:
          whole(item);
          placement(item);
          break;
        case NodeKind::optional:
          whole(item);
          if (item.at(0).is(NodeKind::placement))
            placement(item.at(0));
          else
            items(item);
          break;
        case NodeKind::one_of:
          items(item);
          break;
        case NodeKind::when:
          items(item);
          break;
        default:
          break;
      }
    }
  }

 private:
  void add(Part part, Range range) { parts_.push_back({part, range, range, ""}); }
  void whole(NodeRef item) { add(Part::component, item.range()); }

  void property(NodeRef p) {
    if (p.is(NodeKind::profile)) return add(Part::profile, p.range());
    const std::string_view name = p.at(0).text();
    if (is_phase(name)) add(Part::phase, p.range());
    if (name == "spreads") add(Part::span, p.range());
  }

  void placement(NodeRef p) {
    for (NodeRef child : p.children()) {
      switch (child.kind()) {
        case NodeKind::sum:
          sum(child);
          break;
        case NodeKind::over:
        case NodeKind::at:
        case NodeKind::on:
        case NodeKind::fill:
        case NodeKind::per_cycle:
          add(Part::span, child.range());
          break;
        case NodeKind::options:
          for (NodeRef option : child.children()) property(option);
          break;
        default:
          break;
      }
    }
  }

  /// Terms of a sum that has several, with the sign in front of them; the first goes with the sign behind it.
  void sum(NodeRef node) {
    const NodeRef second = node.at(1);
    std::uint32_t end_before = 0;
    for (NodeRef term : node.children()) {
      const Range range = term.range();
      const bool first = end_before == 0;
      if (second && !(first && second.has(lang::kFlagMinus)))
        parts_.push_back(
            {Part::term, range, first ? Range{range.begin, second.range().begin} : Range{end_before, range.end}, ""});
      end_before = range.end;
      within(term);
    }
  }

  void within(NodeRef term) {
    for (NodeRef part : term.children()) {
      if (part.is(NodeKind::group) && part.at(0).is(NodeKind::sum)) sum(part.at(0));
      if (part.is(NodeKind::steps)) steps(part);
    }
  }

  /// A step that has a time of its own goes, and what follows comes earlier; one that has a share stays and is at rest.
  void steps(NodeRef node) {
    std::uint32_t end_before = 0;
    for (NodeRef step : node.children()) {
      const Range range = step.range();
      const NodeRef sum_node = step.child(NodeKind::sum);
      if (!sum_node) continue;
      const bool share = step.at(0).text().ends_with('%');
      if (share) {
        const Range pose = sum_node.range();
        parts_.push_back({Part::step, range, pose, "0% * (" + std::string(sum_node.text()) + ")"});
      } else if (end_before != 0) {
        parts_.push_back({Part::step, range, {end_before, range.end}, ""});
      } else if (node.at(1)) {
        parts_.push_back({Part::step, range, {range.begin, node.at(1).range().begin}, ""});
      }
      end_before = range.end;
      sum(sum_node);
    }
  }

  std::vector<RemovablePart> parts_;
};

}  // namespace

std::vector<RemovablePart> removable_parts(NodeRef entry) {
  Collector collector;
  collector.items(entry);
  return collector.take();
}

}  // namespace nms::compiler
