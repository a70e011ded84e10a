#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <type_traits>

#include <nms/program/program.h>

/// The container of an `.auc` file: header, section table, sections.
///
/// Sections follow one another without gaps but the zero bytes that align each to 8, in the order of their kinds, and
/// the file ends with the last one's. So every byte of a file is accounted for, and equal programs are equal files.
/// A newer minor version may add sections with kinds of its own; a change to a record is a new major version.
namespace nms::program {

inline constexpr std::uint16_t kVersionMajor = 3;
inline constexpr std::uint16_t kVersionMinor = 0;

/// A byte above 127 and both kinds of line end, so that a copy in text mode is found out at once.
inline constexpr std::array<unsigned char, 8> kMagic{0x8E, 'N', 'M', 'S', '\r', '\n', 0x1A, '\n'};

struct Header {
  unsigned char magic[8] = {};
  std::uint16_t version_major = kVersionMajor;
  std::uint16_t version_minor = kVersionMinor;
  std::uint32_t section_count = 0;
  std::uint64_t size = 0;      ///< of the whole file                                        [bytes]
  std::uint64_t checksum = 0;  ///< XXH3-64 of all other bytes: those before, then those after
};

struct Section {
  std::uint32_t kind = 0;
  std::uint32_t record_size = 0;  ///< [bytes]
  std::uint64_t offset = 0;       ///< from the start of the file, a multiple of 8            [bytes]
  std::uint64_t count = 0;        ///< records
};

static_assert(sizeof(Header) == 32 && sizeof(Section) == 24);
static_assert(offsetof(Header, checksum) == 24);

/// Numbers are contract: a kind keeps its number for ever.
enum class SectionKind : std::uint32_t {
  tracks = 1,
  channels,
  clips,
  curves,
  knots,
  handles,
  // 7 was the play list of format 1
  markers = 8,
  knot_sources,
  sources,
  muscles,
  actuations,
  landmarks,
  faces,
  string_begin,
  string_bytes,
  inputs,
  face_parts,
};
inline constexpr std::uint32_t kSectionCount = 17;

/// Calls `visit(kind, name, span)` for every table of a program, in the order of the file.
template <typename AProgram, typename Visit>
void visit_sections(AProgram& program, const Visit& visit) {
  visit(SectionKind::tracks, std::string_view("tracks"), program.tracks);
  visit(SectionKind::channels, std::string_view("channels"), program.channels);
  visit(SectionKind::clips, std::string_view("clips"), program.clips);
  visit(SectionKind::curves, std::string_view("curves"), program.curves);
  visit(SectionKind::knots, std::string_view("knots"), program.knots);
  visit(SectionKind::handles, std::string_view("handles"), program.handles);
  visit(SectionKind::markers, std::string_view("markers"), program.markers);
  visit(SectionKind::knot_sources, std::string_view("knot_sources"), program.knot_sources);
  visit(SectionKind::sources, std::string_view("sources"), program.sources);
  visit(SectionKind::muscles, std::string_view("muscles"), program.muscles);
  visit(SectionKind::actuations, std::string_view("actuations"), program.actuations);
  visit(SectionKind::landmarks, std::string_view("landmarks"), program.landmarks);
  visit(SectionKind::faces, std::string_view("faces"), program.faces);
  visit(SectionKind::string_begin, std::string_view("string_begin"), program.string_begin);
  visit(SectionKind::string_bytes, std::string_view("string_bytes"), program.string_bytes);
  visit(SectionKind::inputs, std::string_view("inputs"), program.inputs);
  visit(SectionKind::face_parts, std::string_view("face_parts"), program.face_parts);
}

[[nodiscard]] constexpr std::uint64_t align_to_8(std::uint64_t offset) { return (offset + 7U) & ~std::uint64_t{7}; }

/// What `Header::checksum` of these bytes should be.
/// @pre at least a header long
[[nodiscard]] std::uint64_t checksum(std::span<const std::byte> bytes);

}  // namespace nms::program
