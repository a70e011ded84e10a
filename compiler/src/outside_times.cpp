#include "outside_times.h"

#include <nms/compiler/diagnostic_kinds.h>

namespace nms::compiler {
namespace {

std::string key(std::string_view clip, std::string_view name) {
  std::string k(clip);
  k += '\0';
  k += name;
  return k;
}

}  // namespace

OutsideTimes::OutsideTimes(const std::vector<TimeTable>& tables, lang::Diagnostics& diagnostics) {
  for (const TimeTable& table : tables) {
    for (const MarkTime& mark : table.marks) {
      const auto [it, added] =
          by_clip_and_name_.emplace(key(mark.clip, mark.name), static_cast<std::uint32_t>(marks_.size()));
      if (added) {
        marks_.push_back({&table, &mark, false});
        continue;
      }
      lang::Diagnostic& d = diagnostics.report(table.source, mark.range, DuplicateName{"mark", mark.name});
      const MarkRow& first = marks_[it->second];
      d.labels.push_back({first.table->source, first.mark->range, "first given here"});
    }
    for (const SignTiming& timing : table.signs) {
      signs_of_clip_[timing.clip].push_back(static_cast<std::uint32_t>(signs_.size()));
      signs_.push_back({&table, &timing, false});
    }
  }
}

std::optional<std::int64_t> OutsideTimes::mark(std::string_view name) {
  auto it = by_clip_and_name_.find(key(clip_, name));
  if (it == by_clip_and_name_.end()) it = by_clip_and_name_.find(key({}, name));
  if (it == by_clip_and_name_.end()) return std::nullopt;
  MarkRow& row = marks_[it->second];
  row.used = true;
  if (uses_.names.insert(row.mark->name).second) uses_.marks.push_back({row.mark->name, row.mark->time_ns});
  return row.mark->time_ns;
}

std::vector<std::string> OutsideTimes::mark_names() const {
  std::vector<std::string> names;
  for (const MarkRow& row : marks_)
    if (row.mark->clip.empty() || row.mark->clip == clip_) names.push_back(row.mark->name);
  return names;
}

std::vector<OutsideTimes::SignRow*> OutsideTimes::sign_rows(bool non_dominant) {
  std::vector<SignRow*> rows;
  const auto it = signs_of_clip_.find(clip_);
  if (it == signs_of_clip_.end()) return rows;
  for (const std::uint32_t i : it->second)
    if (signs_[i].timing->non_dominant == non_dominant) rows.push_back(&signs_[i]);
  return rows;
}

void OutsideTimes::report_unused(lang::Diagnostics& diagnostics) const {
  struct Unused {
    const TimeTable* table;
    lang::Range first;
    UnusedTimes kind;
  };
  std::vector<Unused> tables;
  std::unordered_map<const TimeTable*, std::size_t> index;
  const auto add = [&](const TimeTable* table, lang::Range range, std::string name) {
    const auto [it, added] = index.emplace(table, tables.size());
    if (added) tables.push_back({table, range, {}});
    Unused& u = tables[it->second];
    if (range.begin < u.first.begin) u.first = range;
    u.kind.names.push_back(std::move(name));
  };
  for (const MarkRow& row : marks_)
    if (!row.used) add(row.table, row.mark->range, row.mark->name);
  for (const SignRow& row : signs_) {
    if (row.used) continue;
    const SignTiming& t = *row.timing;
    add(row.table, t.range, t.clip + ": " + (t.sign.empty() ? std::to_string(t.index) : t.sign));
  }
  for (const Unused& u : tables) diagnostics.report(u.table->source, u.first, u.kind);
}

}  // namespace nms::compiler
