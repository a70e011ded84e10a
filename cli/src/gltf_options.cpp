#include "gltf_options.h"

#include <fmt/format.h>

#include <nms/lang/quantity.h>

#include "report.h"

namespace nms::cli {
namespace {

constexpr double kLeastError_mm = 0.01;

}  // namespace

std::optional<runtime::GltfOptions> gltf_options(const BuildOptions& options, lang::Diagnostics& diagnostics) {
  runtime::GltfOptions wanted;
  wanted.all_targets = options.all_targets;
  wanted.dense = options.dense;
  wanted.quantize = options.quantize;
  wanted.max_corrections = options.max_corrections;
  if (options.max_error.empty()) return wanted;
  const auto length = lang::read_quantity(options.max_error);
  if (!length || length->unit != lang::Unit::length || length->value < kLeastError_mm) {
    add_failure(diagnostics, {"bad_length", "--max-error",
                              fmt::format("\"{}\" is not a length of 0.01 mm or more", options.max_error),
                              "write a plain number with its unit: 0.2mm"});
    return std::nullopt;
  }
  wanted.max_error_m = length->value / 1000.0;
  return wanted;
}

}  // namespace nms::cli
