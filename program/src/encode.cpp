#include <algorithm>
#include <cstring>
#include <type_traits>

#include <nms/program/program.h>

#include "container.h"

namespace nms::program {
namespace {

template <typename T>
void put(std::vector<std::byte>& bytes, std::size_t offset, const T* records, std::size_t count) {
  static_assert(std::is_trivially_copyable_v<T>);
  if (count > 0) {
    std::memcpy(bytes.data() + offset, records, count * sizeof(T));
  }
}

}  // namespace

std::vector<std::byte> encode(const Draft& draft) {
  std::vector<std::uint32_t> string_begin{0};
  std::vector<char> string_bytes;
  for (const std::string& string : draft.strings) {
    string_bytes.insert(string_bytes.end(), string.begin(), string.end());
    string_begin.push_back(static_cast<std::uint32_t>(string_bytes.size()));
  }
  // The draft as a program, not checked: only to name its tables in the order of the file.
  const Program tables{draft.tracks,     draft.channels,  draft.clips,        draft.curves,     draft.knots,
                       draft.handles,    draft.markers,   draft.knot_sources, draft.sources,    draft.muscles,
                       draft.actuations, draft.landmarks, draft.faces,        draft.face_parts, string_begin,
                       string_bytes,     draft.inputs};

  std::vector<Section> sections;
  std::uint64_t size = sizeof(Header) + kSectionCount * sizeof(Section);
  visit_sections(tables, [&](SectionKind kind, std::string_view, const auto& table) {
    constexpr std::size_t kRecordSize = sizeof(table[0]);
    sections.push_back({static_cast<std::uint32_t>(kind), static_cast<std::uint32_t>(kRecordSize), size, table.size()});
    size = align_to_8(size + table.size() * kRecordSize);
  });

  std::vector<std::byte> bytes(static_cast<std::size_t>(size));  // zero, so the padding is
  put(bytes, sizeof(Header), sections.data(), sections.size());
  std::size_t next = 0;
  visit_sections(tables, [&](SectionKind, std::string_view, const auto& table) {
    put(bytes, static_cast<std::size_t>(sections[next].offset), table.data(), table.size());
    ++next;
  });
  Header header;
  std::copy(kMagic.begin(), kMagic.end(), header.magic);
  header.section_count = kSectionCount;
  header.size = size;
  put(bytes, 0, &header, 1);
  header.checksum = checksum(bytes);
  put(bytes, 0, &header, 1);
  return bytes;
}

}  // namespace nms::program
