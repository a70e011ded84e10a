#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <string_view>

#include <fmt/format.h>

#include <nms/compiler/explain.h>
#include <nms/program/evaluate.h>

#include "commands.h"
#include "diagnostic_pages.h"
#include "explanation.h"
#include "loading.h"
#include "report.h"
#include "times.h"

namespace nms::cli {
namespace {

/// `AU4` means both its sides, `AU51` its axis, a track's name all of its channels.
bool means(const program::Program& p, const program::Channel& c, std::string_view asked) {
  const std::string_view name = p.string(c.name);
  if (name == asked || p.string(p.tracks[c.track].name) == asked) return true;
  if (c.kind == program::ChannelKind::axis) return p.string(c.positive) == asked || p.string(c.negative) == asked;
  return c.side != program::Side::none && name.substr(0, name.size() - 1) == asked;
}

void report_unknown_channel(const program::Program& p, const std::string& asked, lang::Diagnostics& diagnostics) {
  std::vector<std::string> names;
  for (const program::Channel& c : p.channels) names.emplace_back(p.string(c.name));
  for (const program::Track& t : p.tracks) names.emplace_back(p.string(t.name));
  const auto close = lang::nearest(asked, names);
  add_failure(
      diagnostics,
      {"unknown_channel", "--channel", fmt::format("there is no channel named {}", asked),
       close.empty() ? std::string("a channel is an action unit (AU4, AU4L), an axis (head_yaw) or a track (brows)")
                     : fmt::format("did you mean {}?", close.front())});
}

/// The channels asked for, or all that are not at rest, with their values.
std::vector<ExplainedChannel> chosen_channels(const program::Program& p, const program::Clip& clip,
                                              const ExplainCommandOptions& options, std::int64_t time_ns,
                                              std::vector<compiler::ChannelExplanation> why) {
  std::vector<float> values(p.channels.size());
  program::evaluate(p, clip, time_ns, values);
  std::vector<ExplainedChannel> out;
  std::size_t next = 0;  // both are in the program's order
  bool spoken_of = false;
  for (std::uint32_t i = 0; i < p.channels.size(); ++i) {
    ExplainedChannel c{i, values[i], {}};
    if (next < why.size() && why[next].channel == i) c.why = std::move(why[next++]);
    const bool wanted = options.channel.empty() ? c.value != 0.0F : means(p, p.channels[i], options.channel);
    if (wanted) spoken_of |= !c.why.causes.empty();
    if (wanted) out.push_back(std::move(c));
  }
  // Of a track, only what the clip moves.
  if (spoken_of) std::erase_if(out, [](const ExplainedChannel& c) { return c.why.causes.empty(); });
  return out;
}

void run(const GlobalOptions& global, const ExplainCommandOptions& options, SourceFiles& sources,
         lang::Diagnostics& diagnostics) {
  const auto times = read_times(options.time, diagnostics);
  if (!times) return;
  if (times->size() != 1) {
    add_failure(diagnostics, {"bad_time", "--at", fmt::format("\"{}\" is more than one time", options.time),
                              "ask for one time after another"});
    return;
  }
  const std::int64_t time_ns = times->front();
  const auto roots = load_roots({options.file}, sources, diagnostics);
  auto tables = load_time_tables(global, sources, diagnostics);
  if (diagnostics.error_count() != 0) return;
  auto explained = compiler::explain(roots, sources, diagnostics, {options.clip, time_ns, std::move(*tables)});
  if (!explained) return;
  const auto image = checked_image(explained->program, diagnostics);
  if (!image) return;
  const program::Program& p = image->program();
  const program::Clip* clip = find_clip(p, options.clip, options.file, diagnostics);
  if (clip == nullptr) return;
  ExplainedMoment moment{&p, options.clip, time_ns,
                         chosen_channels(p, *clip, options, time_ns, std::move(explained->channels))};
  if (moment.channels.empty() && !options.channel.empty()) {
    report_unknown_channel(p, options.channel, diagnostics);
    return;
  }
  std::string out;
  if (options.json)
    out = explanation_json(moment);
  else if (moment.channels.empty())
    out = fmt::format("{}: everything is at rest at {}\n", options.clip, options.time);
  else
    out = explanation_text(moment, ::isatty(STDOUT_FILENO) != 0 && std::getenv("NO_COLOR") == nullptr);
  std::fwrite(out.data(), 1, out.size(), stdout);
}

void list_kinds() {
  std::string out =
      "Kinds of diagnostics; nmsc explain KIND says what one means, with a wrong and a right example.\n\n";
  constexpr std::size_t kColumns = 96;
  for (const DiagnosticPage& page : diagnostic_pages()) {
    std::string said = page.group().empty() ? page.summary() : fmt::format("[{}] {}", page.group(), page.summary());
    if (said.size() > kColumns) said = said.substr(0, said.rfind(' ', kColumns)) + " ...";
    out += fmt::format("  {:<20} {}\n", page.kind, said);
  }
  out += "\n[GROUP] marks a warning: --deny GROUP makes an error of it, --allow GROUP leaves it out.\n";
  std::fwrite(out.data(), 1, out.size(), stdout);
}

void explain_kind(const std::string& kind, lang::Diagnostics& diagnostics) {
  if (const DiagnosticPage* page = find_diagnostic_page(kind)) {
    const std::string out = page_text(*page, ::isatty(STDOUT_FILENO) != 0 && std::getenv("NO_COLOR") == nullptr);
    std::fwrite(out.data(), 1, out.size(), stdout);
    return;
  }
  if (kind.ends_with(".nms") || kind.ends_with(".auc")) {
    add_failure(diagnostics, {"no_moment", kind, "nothing says of which clip, at which time",
                              fmt::format("nmsc explain {} --clip NAME --at T", kind)});
    return;
  }
  std::vector<std::string> kinds;
  for (const DiagnosticPage& page : diagnostic_pages()) kinds.emplace_back(page.kind);
  const auto close = lang::nearest(kind, kinds);
  add_failure(diagnostics, {"unknown_kind", kind, "there is no diagnostic of that kind",
                            close.empty() ? std::string("nmsc explain lists the kinds there are")
                                          : fmt::format("did you mean {}?", close.front())});
}

}  // namespace

int explain(const GlobalOptions& global, const ExplainCommandOptions& options) {
  SourceFiles sources(global.stdlib);
  lang::Diagnostics diagnostics;
  if (options.clip.empty() && options.file.empty())
    list_kinds();
  else if (options.clip.empty())
    explain_kind(options.file, diagnostics);
  else
    run(global, options, sources, diagnostics);
  return finish(global, diagnostics);
}

}  // namespace nms::cli
