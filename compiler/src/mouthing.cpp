#include "mouthing.h"

#include <algorithm>
#include <string>

#include <fmt/format.h>

#include <nms/compiler/diagnostic_kinds.h>

#include "phones.h"

namespace nms::compiler {

using lang::NodeRef;

namespace {

constexpr std::size_t kMaxPhones = 500;

/// e to the power -x, x >= 0: by whole powers and a series, so that it has the same bits everywhere.
double decay(double x) {
  constexpr double kInverseE = 0.36787944117144233;
  if (x > 40.0) x = 40.0;  // 4e-18: nothing beside a neighbour
  const int whole = static_cast<int>(x);
  double power = 1.0;
  for (int i = 0; i < whole; ++i) power *= kInverseE;
  const double rest = x - whole;
  double series = 1.0;
  for (int i = 14; i > 0; --i) series = 1.0 - series * rest / i;
  return power * series;
}

/// A string's text as it is meant: `\\\\` is one backslash.
std::string unescaped(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '\\' && i + 1 < text.size()) ++i;
    out += text[i];
  }
  return out;
}

/// The blend at a time; `middles` are those of the visemes.
Pose blend(const std::vector<Viseme>& visemes, const std::vector<std::int64_t>& middles,
           const std::vector<std::uint32_t>& channels, std::int64_t time_ns) {
  std::vector<double> dominance(visemes.size());
  for (std::size_t i = 0; i < visemes.size(); ++i) {
    const std::int64_t away = time_ns < middles[i] ? middles[i] - time_ns : time_ns - middles[i];
    dominance[i] = visemes[i].dominance * decay(static_cast<double>(away) / static_cast<double>(visemes[i].reach_ns));
  }
  Pose out;
  for (const std::uint32_t channel : channels) {
    double wanted = 0.0, all = 0.0;
    for (std::size_t i = 0; i < visemes.size(); ++i) {
      const auto stated = std::find_if(visemes[i].pose.begin(), visemes[i].pose.end(),
                                       [&](const Amount& a) { return a.channel == channel; });
      const double d = stated == visemes[i].pose.end() ? kFaintDominance * dominance[i] : dominance[i];
      if (stated != visemes[i].pose.end()) wanted += d * stated->value;
      all += d;
    }
    out.push_back({channel, all > 0.0 ? wanted / all : 0.0});
  }
  return out;
}

}  // namespace

std::vector<Step> blend_visemes(const std::vector<Viseme>& visemes) {
  std::vector<std::uint32_t> channels;
  std::vector<std::int64_t> middles;
  std::int64_t end = 0;
  for (const Viseme& v : visemes) {
    for (const Amount& a : v.pose) channels.push_back(a.channel);
    middles.push_back(end + v.duration_ns / 2);
    end += v.duration_ns;
  }
  std::sort(channels.begin(), channels.end());
  channels.erase(std::unique(channels.begin(), channels.end()), channels.end());
  std::vector<Step> steps;
  std::int64_t at = 0;
  const auto step_to = [&](std::int64_t time) {
    Step step;
    step.own_ns = time - at;
    step.pose = blend(visemes, middles, channels, time);
    steps.push_back(std::move(step));
    at = time;
  };
  std::int64_t begin = 0;
  for (std::size_t i = 0; i < visemes.size(); ++i) {
    step_to(middles[i]);
    begin += visemes[i].duration_ns;
    step_to(begin);
  }
  return steps;
}

bool Evaluator::mouthing(NodeRef node, const Scale& scale, const Scope& scope, Movement& into) {
  const NodeRef string = node.child(lang::NodeKind::string);
  if (!string) return false;
  const std::string text = unescaped(unquoted(string));
  UnreadPhone unread;
  const auto phones = read_phones(text, unread);
  if (!phones) {
    report(scope, string, UnknownPhone{text.substr(unread.at, unread.length), text});
    return false;
  }
  if (phones->size() > kMaxPhones) {
    report(scope, string, TooLarge{"the length of a mouthing", fmt::format("{} phones", kMaxPhones)});
    return false;
  }
  std::vector<Viseme> visemes;
  for (const Phone& phone : *phones) {
    const std::string name = fmt::format("viseme_{}", phone.viseme);
    const Declaration* d = declarations_.find_movement(name, scope.file);
    if (d == nullptr) {
      report(scope, node, UnknownName{"pose", name, {}}).helps.push_back("write `use \"poses/visemes.nms\"`");
      return false;
    }
    const auto inner = bind(NodeRef(), false, d->name, d->node.child(lang::NodeKind::params), d->file, scope);
    if (!inner) return false;
    auto shape = declaration(*d, *inner);
    if (!shape || !shape->still()) return false;
    Viseme v{std::move(shape->pose), 1.0, phone.duration_ns, phone.duration_ns};
    for (const Argument& a : inner->arguments) {
      if (a.name == "dominance" && a.quantity.value > 0.0) v.dominance = a.quantity.value;
      if (a.name == "reach" && a.quantity.nanoseconds > 0) v.reach_ns = a.quantity.nanoseconds;
    }
    visemes.push_back(std::move(v));
  }
  Sequence sequence;
  sequence.name = "mouthing";
  sequence.mouthing = true;
  sequence.steps = blend_visemes(visemes);
  sequence.duration_ns = 0;
  for (Step& step : sequence.steps) {
    step.node = node;
    step.file = scope.file;
    sequence.duration_ns += step.own_ns;
  }
  Movement part;
  part.sequences.push_back(std::move(sequence));
  return take(std::move(part), scale, node, scope, into);
}

}  // namespace nms::compiler
