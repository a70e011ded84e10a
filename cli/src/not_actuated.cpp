#include "not_actuated.h"

#include <fmt/format.h>

#include "report.h"

namespace nms::cli {
namespace {

bool moves(const program::Program& program, const program::Curve& curve) {
  for (std::uint32_t i = 0; i < curve.knot_count; ++i)
    if (program.knots[curve.first_knot + i].value != 0.0F) return true;
  return false;
}

}  // namespace

void warn_not_actuated(const program::Program& program, const runtime::Rig& rig,
                       const std::vector<const program::Clip*>& clips, const std::string& face,
                       lang::Diagnostics& diagnostics) {
  for (std::uint32_t c = 0; c < program.channels.size(); ++c) {
    if (rig.actuated(program::ChannelId{c})) continue;
    std::string users;
    for (const program::Clip* clip : clips)
      for (std::uint32_t i = 0; i < clip->curve_count; ++i) {
        const program::Curve& curve = program.curves[clip->first_curve + i];
        if (static_cast<std::uint32_t>(curve.channel) != c || !moves(program, curve)) continue;
        users += users.empty() ? "" : ", ";
        users += program.string(clip->name);
      }
    if (users.empty()) continue;
    const program::Channel& channel = program.channels[c];
    const std::string title(program.string(channel.title));
    add_failure(diagnostics,
                {"not_actuated", face,
                 fmt::format("{}{} moves nothing on this face; used by {}", program.string(channel.name),
                             title.empty() ? "" : fmt::format(" ({})", title), users),
                 "give the action unit a muscle of this face, or leave it out"},
                lang::Severity::warning);
  }
}

}  // namespace nms::cli
