#include <algorithm>
#include <cstring>
#include <limits>
#include <string>
#include <utility>

#include <fmt/format.h>

#include <nms/program/program.h>

#include "check_tables.h"
#include "container.h"

/// The container's half of the checks: header, checksum, section table. Nothing is allocated by what a file claims,
/// and all sums are of 64-bit numbers that have been compared with the file's real size first.
namespace nms::program {
namespace {

constexpr std::string_view kCopyAgain = "compile it again, or copy it again in binary mode";

tl::unexpected<Failure> refuse(std::string_view kind, std::string_view place, std::string cause,
                               std::string_view remedy) {
  return tl::make_unexpected(Failure{std::string(kind), std::string(place), std::move(cause), std::string(remedy)});
}

template <typename T>
T read(std::span<const std::byte> bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof(T));
  return value;
}

/// Points `table` into the section; false if the section cannot be one of this table.
template <typename T>
bool bind(std::span<const T>& table, const Section& section, std::span<const std::byte> bytes) {
  if (section.record_size != sizeof(T) || section.count > std::numeric_limits<std::uint32_t>::max() - 1) {
    return false;
  }
  const std::byte* first = bytes.data() + section.offset;
  table = {reinterpret_cast<const T*>(first), static_cast<std::size_t>(section.count)};
  return true;
}

tl::expected<Header, Failure> check_header(std::span<const std::byte> bytes, std::string_view place) {
  const std::size_t magic_size = std::min(bytes.size(), kMagic.size());
  // The first half of the mark tells what it was meant to be, the second what a copy in text mode has done to it.
  if (std::memcmp(bytes.data(), kMagic.data(), std::min<std::size_t>(magic_size, 4)) != 0) {
    return refuse("not_a_program", place, "the file does not begin as an AU curve program does",
                  "name an .auc file, or compile this one if it is source text");
  }
  if (std::memcmp(bytes.data(), kMagic.data(), magic_size) != 0) {
    return refuse("corrupt_program", place, "the line ends in the file's mark were changed", kCopyAgain);
  }
  if (bytes.size() < sizeof(Header)) {
    return refuse("truncated_program", place,
                  fmt::format("the file ends after {} bytes, its header alone takes {}", bytes.size(), sizeof(Header)),
                  kCopyAgain);
  }
  const auto header = read<Header>(bytes, 0);
  if (header.version_major > kVersionMajor) {
    return refuse("newer_version", place,
                  fmt::format("the file has format version {}.{}, this nmsc reads {}.x", header.version_major,
                              header.version_minor, kVersionMajor),
                  "use a newer nmsc, or compile it again with this one");
  }
  if (header.version_major < kVersionMajor) {
    return refuse("older_version", place,
                  fmt::format("the file has format version {}.{}, this nmsc reads {}.x", header.version_major,
                              header.version_minor, kVersionMajor),
                  "compile it again with this nmsc");
  }
  if (bytes.size() < header.size) {
    return refuse(
        "truncated_program", place,
        fmt::format("the file ends after {} bytes, its header says {}", grouped(bytes.size()), grouped(header.size)),
        kCopyAgain);
  }
  if (bytes.size() > header.size) {
    return refuse("corrupt_program", place,
                  fmt::format("the file has {} bytes, its header says {}", grouped(bytes.size()), grouped(header.size)),
                  kCopyAgain);
  }
  if (checksum(bytes) != header.checksum) {
    return refuse("corrupt_program", place, "the checksum does not match the contents", kCopyAgain);
  }
  return header;
}

}  // namespace

tl::expected<Program, Failure> check(std::span<const std::byte> bytes, std::string_view place) {
  if (bytes.empty()) {
    return refuse("truncated_program", place, "the file is empty", kCopyAgain);
  }
  const auto invalid = [&](std::string cause) { return refuse("invalid_program", place, std::move(cause), kReport); };
  if (reinterpret_cast<std::uintptr_t>(bytes.data()) % 8 != 0) {
    return invalid("its bytes do not lie at a multiple of 8");
  }
  const tl::expected<Header, Failure> header = check_header(bytes, place);
  if (!header) {
    return tl::make_unexpected(header.error());
  }

  const std::uint64_t table_end = sizeof(Header) + std::uint64_t{header->section_count} * sizeof(Section);
  if (table_end > bytes.size()) {
    return invalid(fmt::format("it cannot hold the {} sections its header speaks of", grouped(header->section_count)));
  }
  Program program;
  std::uint64_t end = table_end;
  std::uint32_t last_kind = 0;
  std::uint32_t known_count = 0;
  for (std::uint32_t s = 0; s < header->section_count; ++s) {
    const auto section = read<Section>(bytes, sizeof(Header) + std::size_t{s} * sizeof(Section));
    const std::uint64_t begin = align_to_8(end);
    if (section.kind <= last_kind) {
      return invalid(fmt::format("section kind {} comes after kind {}", section.kind, last_kind));
    }
    if (section.offset != begin || begin > bytes.size()) {
      return invalid(fmt::format("section {} is said to begin at byte {}, it should at {}", section.kind,
                                 grouped(section.offset), grouped(begin)));
    }
    if (section.record_size == 0 || section.count > (bytes.size() - begin) / section.record_size) {
      return invalid(fmt::format("section {} cannot hold {} records of {} bytes", section.kind, grouped(section.count),
                                 grouped(section.record_size)));
    }
    last_kind = section.kind;
    end = begin + section.count * section.record_size;
    for (std::uint64_t i = end; i < std::min<std::uint64_t>(align_to_8(end), bytes.size()); ++i) {
      if (bytes[static_cast<std::size_t>(i)] != std::byte{0}) {
        return invalid(fmt::format("the filling after section {} is not zero", section.kind));
      }
    }
    bool is_known = false;
    bool is_bound = false;
    visit_sections(program, [&](SectionKind kind, std::string_view, auto& table) {
      if (static_cast<std::uint32_t>(kind) == section.kind) {
        is_known = true;
        is_bound = bind(table, section, bytes);
      }
    });
    if (is_known && !is_bound) {
      return invalid(fmt::format("section {} has records of {} bytes, or too many of them", section.kind,
                                 grouped(section.record_size)));
    }
    if (!is_known && header->version_minor <= kVersionMinor) {
      return invalid(fmt::format("format version {}.{} has no section kind {}", header->version_major,
                                 header->version_minor, section.kind));
    }
    known_count += is_known ? 1U : 0U;
  }
  if (known_count != kSectionCount) {
    return invalid(fmt::format("it has {} of the {} sections every program has", known_count, kSectionCount));
  }
  if (align_to_8(end) != bytes.size()) {
    return invalid(fmt::format("its last section ends at byte {} of {}", grouped(end), grouped(bytes.size())));
  }

  std::optional<Failure> failure = check_tables(program, place);
  if (failure) {
    return tl::make_unexpected(std::move(*failure));
  }
  return program;
}

}  // namespace nms::program
