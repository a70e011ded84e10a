#include <cstdlib>
#include <string_view>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "explanation.h"
#include "tiers.h"

namespace nms::cli {
namespace {

using compiler::Cause;
using compiler::MergeStep;
using Json = nlohmann::ordered_json;

/// Without the noise of sums in binary.
double rounded(double value) {
  const double scaled = value * 1e9;
  return static_cast<double>(static_cast<std::int64_t>(scaled + (scaled < 0.0 ? -0.5 : 0.5))) / 1e9;
}

double seconds(std::int64_t ns) { return static_cast<double>(ns) / 1e9; }

Json place(const lang::Source* source, lang::Range range) {
  if (source == nullptr) return nullptr;
  const lang::Position at = source->position(range.begin);
  return {
      {"file", source->path()}, {"line", at.line}, {"column", at.column}, {"text", std::string(source->slice(range))}};
}

Json cause(const Cause& c) {
  static constexpr const char* kMovements[] = {"pose", "steps", "swing"};
  static constexpr const char* kPhases[] = {"before", "onset", "apex", "offset", "held", "moving", "after"};
  static constexpr const char* kFates[] = {"counted", "repeated", "let_go", "joined"};
  Json out{{"entry", c.entry},
           {"layer", std::string(c.layer)},
           {"stated", c.stated},
           {"movement", kMovements[static_cast<std::size_t>(c.movement)]},
           {"phase", kPhases[static_cast<std::size_t>(c.phase)]},
           {"fate", kFates[static_cast<std::size_t>(c.fate)]},
           {"value", rounded(c.value)},
           {"envelope", rounded(c.envelope)},
           {"peak", rounded(c.peak)},
           {"start_s", seconds(c.start_ns)},
           {"end_s", seconds(c.end_ns)},
           {"span_start_s", seconds(c.span_start_ns)},
           {"span_end_s", seconds(c.span_end_ns)}};
  if (c.movement == Cause::Movement::pose) {
    out["apex_s"] = seconds(c.apex_ns);
    out["release_s"] = seconds(c.release_ns);
  }
  out["source"] = place(c.source.get(), c.range);
  out["used"] = place(c.used_source.get(), c.used_range);
  if (!c.given.empty()) out["gave_way"] = Json::array();
  for (const Cause::Given& g : c.given)
    out["gave_way"].push_back({{"to", g.to}, {"taken", rounded(g.taken)}, {"rule", place(g.source.get(), g.range)}});
  return out;
}

Json step(const MergeStep& s) {
  static constexpr const char* kKinds[] = {"strongest", "sum",     "latest", "either", "add",
                                           "replace",   "highest", "scale",  "hide"};
  Json out{{"operator", kKinds[static_cast<std::size_t>(s.kind)]}};
  if (!s.name.empty()) out["layer"] = std::string(s.name);
  out["operands"] = Json::array();
  for (const MergeStep::Operand& o : s.operands) {
    Json operand{{"value", rounded(o.value)}};
    if (!s.name.empty()) operand["cause"] = o.cause;
    out["operands"].push_back(std::move(operand));
  }
  if (s.kind >= MergeStep::Kind::replace) out["envelope"] = rounded(s.envelope);
  out["result"] = rounded(s.result);
  return out;
}

}  // namespace

std::string explanation_json(const ExplainedMoment& moment) {
  const program::Program& p = *moment.program;
  Json all{{"clip", moment.clip}, {"time_s", seconds(moment.time_ns)}, {"channels", Json::array()}};
  for (const ExplainedChannel& c : moment.channels) {
    const program::Channel& info = p.channels[c.channel];
    Json one{{"channel", std::string(p.string(info.name))}, {"title", std::string(p.string(info.title))}};
    if (info.kind == program::ChannelKind::axis) {
      one["positive"] = std::string(p.string(info.positive));
      one["negative"] = std::string(p.string(info.negative));
    }
    one["track"] = std::string(p.string(p.tracks[info.track].name));
    one["value"] = std::strtod(fmt::format("{}", c.value).c_str(), nullptr);  // the digits that `sample` prints
    one["spoken_of"] = !c.why.causes.empty();
    one["causes"] = Json::array();
    for (const Cause& each : c.why.causes) one["causes"].push_back(cause(each));
    one["steps"] = Json::array();
    for (const MergeStep& each : c.why.steps) one["steps"].push_back(step(each));
    all["channels"].push_back(std::move(one));
  }
  return all.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace nms::cli
