#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <span>
#include <string_view>
#include <vector>

#include <nms/program/program.h>

/// Programs for the tests of this room and for its fuzz targets' seeds.
namespace nms::program {

/// The thesis's smile and a timeline with every kind of segment, marker and source, on a small rig: each field of each
/// record is used. Its text form.
extern const std::string_view kSmallProgram;

/// The checksum of its image: it changes with the format, and with nothing else.
inline constexpr std::uint64_t kSmallChecksum = 15740839510282498002U;

/// kSmallProgram, read.
[[nodiscard]] Draft small_draft();

/// A valid program with random clips: jumps, wild handles, axes, empty clips, single knots.
[[nodiscard]] Draft random_draft(std::mt19937& random);

/// Writes the checksum that the bytes should have, so that a corruption reaches the checks behind it.
void reseal(std::span<std::byte> bytes);

/// Uses all of a checked program: plays each clip, prints it and reads it again. Returns something that depends on it.
std::size_t exercise(const Program& program);

}  // namespace nms::program
