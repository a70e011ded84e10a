#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nms/compiler/explain.h>
#include <nms/program/program.h>

namespace nms::cli {

/// A channel, why it is what it is, and the value that players and `nmsc sample` have.
struct ExplainedChannel {
  std::uint32_t channel = 0;
  float value = 0.0F;
  compiler::ChannelExplanation why;  ///< no causes: the clip does not speak of it
};

/// One answer of `nmsc explain FILE`.
struct ExplainedMoment {
  const program::Program* program = nullptr;
  std::string clip;
  std::int64_t time_ns = 0;
  std::vector<ExplainedChannel> channels;
};

/// For people. Left and right are told once where they have the same reasons.
[[nodiscard]] std::string explanation_text(const ExplainedMoment& moment, bool color);
/// For programs: every number in full.
[[nodiscard]] std::string explanation_json(const ExplainedMoment& moment);

}  // namespace nms::cli
