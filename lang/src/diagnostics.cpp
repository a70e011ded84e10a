#include <algorithm>

#include <nms/lang/diagnostic.h>

namespace nms::lang {

Diagnostic& Diagnostics::add(Diagnostic diagnostic) {
  const bool is_error = diagnostic.severity == Severity::error;
  ++(is_error ? errors_ : warnings_);
  if (all_.size() >= kMaxKept) {
    ++dropped_;
    overflow_ = std::move(diagnostic);
    return overflow_;
  }
  all_.push_back(std::move(diagnostic));
  return all_.back();
}

void Diagnostics::add_label(std::size_t n, Label label) {
  constexpr std::size_t kMostLabels = 8;
  if (n >= all_.size()) return;
  std::vector<Label>& labels = all_[n].labels;
  const auto same = [&](const Label& l) { return l.source == label.source && l.range.begin == label.range.begin; };
  if (labels.size() < kMostLabels && std::none_of(labels.begin(), labels.end(), same))
    labels.push_back(std::move(label));
}

void Diagnostics::sort() {
  std::vector<const Source*> files;
  const auto file = [&files](const Diagnostic& d) {
    const auto found = std::find(files.begin(), files.end(), d.source.get());
    if (found != files.end()) return static_cast<std::size_t>(found - files.begin());
    files.push_back(d.source.get());
    return files.size() - 1;
  };
  for (const Diagnostic& d : all_) file(d);
  std::stable_sort(all_.begin(), all_.end(), [&](const Diagnostic& a, const Diagnostic& b) {
    const std::size_t fa = file(a);
    const std::size_t fb = file(b);
    if (fa != fb) return fa < fb;
    if (a.range.begin != b.range.begin) return a.range.begin < b.range.begin;
    return a.range.end < b.range.end;
  });
}

}  // namespace nms::lang
