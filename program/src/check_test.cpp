#include <cstring>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>

#include <gtest/gtest.h>

#include <nms/program/evaluate.h>
#include <nms/program/text.h>

#include <nms/program/utf8.h>
#include "container.h"
#include "test_programs.h"

namespace nms::program {
namespace {

std::string kind_of(std::span<const std::byte> bytes) {
  const auto image = Image::load(bytes, "a.auc");
  if (!image) {
    const Failure& failure = image.error();
    EXPECT_EQ(failure.place.substr(0, 5), "a.auc");
    EXPECT_FALSE(failure.cause.empty());
    EXPECT_FALSE(failure.remedy.empty());
    return failure.kind;
  }
  exercise(image->program());
  return "";
}

template <typename T>
void write(std::vector<std::byte>& bytes, std::size_t offset, T value) {
  std::memcpy(bytes.data() + offset, &value, sizeof(T));
}

std::vector<std::byte> small_bytes() { return encode(small_draft()); }

/// The small program with one field of its section table overwritten, and its checksum put right.
std::vector<std::byte> with_section(std::size_t index, const std::function<void(Section&)>& change) {
  std::vector<std::byte> bytes = small_bytes();
  Section section;
  const std::size_t offset = sizeof(Header) + index * sizeof(Section);
  std::memcpy(&section, bytes.data() + offset, sizeof(section));
  change(section);
  write(bytes, offset, section);
  reseal(bytes);
  return bytes;
}

TEST(check, accepts_what_was_encoded_where_it_lies) {
  const std::vector<std::byte> bytes = small_bytes();
  const Image image = Image::load(bytes, "a.auc").value();
  EXPECT_EQ(encode(small_draft()), bytes);
  // No copy: the tables are the file's own bytes.
  const auto* knots = reinterpret_cast<const std::byte*>(image.program().knots.data());
  EXPECT_GE(knots, image.bytes().data());
  EXPECT_LT(knots, image.bytes().data() + image.bytes().size());
  EXPECT_EQ(image.program().clips.size(), 3U);
  EXPECT_EQ(image.program().find_clip("say \"no\""), &image.program().clips[1]);
  EXPECT_EQ(image.program().find_clip("say"), nullptr);
  EXPECT_EQ(kind_of(encode(Draft{})), "");
}

TEST(check, bytes_are_the_same_on_every_machine) {
  const std::vector<std::byte> bytes = small_bytes();
  Header header;
  std::memcpy(&header, bytes.data(), sizeof(header));
  EXPECT_EQ(header.size, bytes.size());
  EXPECT_EQ(header.checksum, kSmallChecksum);
}

std::string read_file(std::string_view path) {
  std::ifstream file(std::string(NMS_SOURCE_DIR "/tests/fuzz_corpus/program/") + std::string(path), std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(check, programs_of_earlier_builds_still_load) {
  const std::string small = read_file("check/small.auc");
  const std::vector<std::byte> bytes = small_bytes();
  ASSERT_EQ(small.size(), bytes.size());
  EXPECT_EQ(std::memcmp(small.data(), bytes.data(), bytes.size()), 0);
  EXPECT_EQ(read_file("text/small.txt"), kSmallProgram);
  for (const std::string_view path : {"check/empty.auc", "check/random.auc"}) {
    const std::string file = read_file(path);
    EXPECT_EQ(kind_of({reinterpret_cast<const std::byte*>(file.data()), file.size()}), "") << path;
  }
}

TEST(check, a_moved_image_keeps_its_bytes) {
  Image image = Image::from(small_draft()).value();
  const Knot* knots = image.program().knots.data();
  const Image moved = std::move(image);
  EXPECT_EQ(moved.program().knots.data(), knots);
  EXPECT_EQ(to_text(moved.program()), kSmallProgram);
}

TEST(check, refuses_every_shorter_file) {
  const std::vector<std::byte> bytes = small_bytes();
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    ASSERT_EQ(kind_of(std::span(bytes).first(size)), "truncated_program") << size;
  }
  std::vector<std::byte> longer = bytes;
  longer.resize(bytes.size() + 8);
  EXPECT_EQ(kind_of(longer), "corrupt_program");
}

TEST(check, refuses_every_shorter_file_that_says_it_is_whole) {
  const std::vector<std::byte> bytes = small_bytes();
  for (std::size_t size = sizeof(Header); size < bytes.size(); ++size) {
    std::vector<std::byte> shorter(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
    write(shorter, offsetof(Header, size), std::uint64_t{size});
    reseal(shorter);
    ASSERT_EQ(kind_of(shorter), "invalid_program") << size;
  }
}

TEST(check, refuses_every_flipped_bit) {
  std::vector<std::byte> bytes = small_bytes();
  for (std::size_t bit = 0; bit < bytes.size() * 8; ++bit) {
    const std::byte mask = std::byte{1} << (bit % 8);
    bytes[bit / 8] ^= mask;
    ASSERT_NE(kind_of(bytes), "") << "bit " << bit;
    bytes[bit / 8] ^= mask;
  }
  EXPECT_EQ(kind_of(bytes), "");
}

TEST(check, what_passes_with_a_flipped_bit_and_a_new_checksum_can_be_used) {
  std::vector<std::byte> bytes = small_bytes();
  std::size_t refused = 0;
  for (std::size_t bit = 0; bit < bytes.size() * 8; ++bit) {
    const std::byte mask = std::byte{1} << (bit % 8);
    bytes[bit / 8] ^= mask;
    reseal(bytes);
    const auto image = Image::load(bytes, "a.auc");
    if (image) {
      exercise(image->program());
      // What is accepted can be printed, read and encoded: nothing in it is beyond its text.
      const std::string text = to_text(image->program());
      const auto draft = from_text(text, "flipped");
      ASSERT_TRUE(draft) << "bit " << bit << ": " << draft.error().place << ": " << draft.error().cause << "\n" << text;
      const auto again = Image::from(*draft);
      ASSERT_TRUE(again) << "bit " << bit << ": " << again.error().place << ": " << again.error().cause << "\n" << text;
      ASSERT_EQ(to_text(again->program()), text) << "bit " << bit;
    } else {
      ++refused;
    }
    bytes[bit / 8] ^= mask;
  }
  EXPECT_GT(refused, bytes.size()) << "of 8 bits a byte";
}

TEST(check, refuses_other_files_by_name) {
  const auto bytes_of = [](std::string_view text) {
    const auto* first = reinterpret_cast<const std::byte*>(text.data());
    return std::vector<std::byte>(first, first + text.size());
  };
  EXPECT_EQ(kind_of(bytes_of("pose glad = 60% AU12")), "not_a_program");
  EXPECT_EQ(kind_of(bytes_of("g")), "not_a_program");
  EXPECT_EQ(kind_of({}), "truncated_program");
  std::vector<std::byte> text_mode = small_bytes();
  text_mode.erase(text_mode.begin() + 4);  // \r\n becomes \n
  EXPECT_EQ(kind_of(text_mode), "corrupt_program");
}

TEST(check, refuses_bytes_that_are_not_aligned) {
  std::vector<std::byte> bytes = small_bytes();
  bytes.insert(bytes.begin(), std::byte{0});
  EXPECT_EQ(check(std::span(bytes).subspan(1), "a.auc").error().kind, "invalid_program");
}

TEST(check, refuses_newer_and_unknown_versions) {
  std::vector<std::byte> bytes = small_bytes();
  write(bytes, offsetof(Header, version_major), std::uint16_t{kVersionMajor + 1});
  EXPECT_EQ(kind_of(bytes), "newer_version");
  write(bytes, offsetof(Header, version_major), std::uint16_t{kVersionMajor - 1});
  EXPECT_EQ(kind_of(bytes), "older_version");
}

/// The small program with a section of an unknown kind at its end.
std::vector<std::byte> with_more_sections(std::uint16_t version_minor) {
  const std::vector<std::byte> old = small_bytes();
  std::vector<std::byte> bytes(old.begin(), old.begin() + sizeof(Header) + kSectionCount * sizeof(Section));
  bytes.resize(bytes.size() + sizeof(Section));
  bytes.insert(bytes.end(), old.begin() + sizeof(Header) + kSectionCount * sizeof(Section), old.end());
  for (std::size_t s = 0; s < kSectionCount; ++s) {
    Section section;
    const std::size_t offset = sizeof(Header) + s * sizeof(Section);
    std::memcpy(&section, bytes.data() + offset, sizeof(section));
    section.offset += sizeof(Section);
    write(bytes, offset, section);
  }
  write(bytes, sizeof(Header) + kSectionCount * sizeof(Section), Section{77, 3, bytes.size(), 5});
  bytes.resize(bytes.size() + 16);
  bytes[bytes.size() - 16] = std::byte{42};
  Header header;
  std::memcpy(&header, bytes.data(), sizeof(header));
  header.version_minor = version_minor;
  header.section_count = kSectionCount + 1;
  header.size = bytes.size();
  write(bytes, 0, header);
  reseal(bytes);
  return bytes;
}

TEST(check, skips_unknown_sections_of_a_newer_minor_version_only) {
  const auto image = Image::load(with_more_sections(kVersionMinor + 1), "a.auc");
  ASSERT_TRUE(image) << image.error().cause;
  EXPECT_EQ(to_text(image->program()), kSmallProgram);
  EXPECT_EQ(kind_of(with_more_sections(kVersionMinor)), "invalid_program");
}

TEST(check, refuses_hostile_claims_of_the_section_table) {
  constexpr std::uint64_t kMost = std::numeric_limits<std::uint64_t>::max();
  for (std::size_t s = 0; s < kSectionCount; ++s) {
    for (const std::uint64_t claim : {kMost, kMost / 8, kMost / 16, kMost / 96, kMost - 7, std::uint64_t{1} << 32U,
                                      std::uint64_t{0xFFFFFFFFU}, std::uint64_t{1} << 61U}) {
      EXPECT_EQ(kind_of(with_section(s, [&](Section& section) { section.count = claim; })), "invalid_program");
      EXPECT_EQ(kind_of(with_section(s, [&](Section& section) { section.offset = claim; })), "invalid_program");
      EXPECT_EQ(kind_of(with_section(s, [&](Section& section) { section.offset += claim; })), "invalid_program");
    }
    for (const std::uint32_t size : {0U, 1U, 0xFFFFFFFFU}) {
      EXPECT_EQ(kind_of(with_section(s,
                                     [&](Section& section) {
                                       section.record_size = section.record_size == size ? size + 1 : size;
                                       section.count = 0;
                                     })),
                "invalid_program");
    }
    EXPECT_EQ(kind_of(with_section(s, [&](Section& section) { section.kind = 0; })), "invalid_program");
    EXPECT_EQ(kind_of(with_section(s, [&](Section& section) { section.kind += 100; })), "invalid_program");
  }
  for (const std::uint32_t count : {0U, kSectionCount - 1, kSectionCount + 1, 0xFFFFFFFFU, 0x0AAAAAAAU}) {
    std::vector<std::byte> bytes = small_bytes();
    write(bytes, offsetof(Header, section_count), count);
    reseal(bytes);
    EXPECT_EQ(kind_of(bytes), "invalid_program") << count;
  }
}

TEST(check, refuses_filling_that_is_not_zero) {
  constexpr auto kStrings = static_cast<std::size_t>(SectionKind::string_bytes) - 2;  // no section is numbered 0 or 7
  Draft draft = small_draft();
  std::vector<std::byte> bytes;
  Section strings;
  do {
    draft.strings.back() += "x";
    bytes = encode(draft);
    std::memcpy(&strings, bytes.data() + sizeof(Header) + kStrings * sizeof(Section), sizeof(strings));
  } while ((strings.offset + strings.count) % 8 == 0);
  ASSERT_EQ(strings.kind, static_cast<std::uint32_t>(SectionKind::string_bytes));
  EXPECT_EQ(kind_of(bytes), "");
  bytes[strings.offset + strings.count] = std::byte{1};
  reseal(bytes);
  EXPECT_EQ(kind_of(bytes), "invalid_program");
}

struct BadDraft {
  std::string_view place;  ///< table and index
  std::function<void(Draft&)> break_it;
};

TEST(check, refuses_every_broken_table_by_its_place) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  constexpr float kInf = std::numeric_limits<float>::infinity();
  constexpr auto kBadString = StringId{9999};
  const std::vector<BadDraft> bad = {
      {"string_begin[0]", [](Draft& d) { d.strings.clear(); }},
      {"string_begin[0]", [](Draft& d) { d.strings[0] = "x"; }},
      {"string_begin[1]", [](Draft& d) { d.strings[1] = "\xFF"; }},
      {"string_begin[1]", [](Draft& d) { d.strings[1].clear(); }},
      {"string_begin[1]", [](Draft& d) { d.strings[1] = std::string(5000, 'x'); }},
      {"tracks[1]", [&](Draft& d) { d.tracks[1].name = kBadString; }},
      {"tracks[1]", [](Draft& d) { d.tracks[1].name = d.tracks[0].name; }},
      {"tracks[1]", [](Draft& d) { d.tracks[1].name = StringId{}; }},
      {"tracks[1]", [](Draft& d) { d.tracks[1].merge = static_cast<MergeOperator>(3); }},
      {"tracks[1]", [](Draft& d) { d.tracks[1].zero[2] = 1; }},
      {"channels[1]", [&](Draft& d) { d.channels[1].name = kBadString; }},
      {"channels[1]", [](Draft& d) { d.channels[1].name = d.channels[0].name; }},
      {"channels[1]", [&](Draft& d) { d.channels[1].title = kBadString; }},
      {"channels[4]", [&](Draft& d) { d.channels[4].positive = kBadString; }},
      {"channels[4]", [](Draft& d) { d.channels[4].negative = StringId{}; }},
      {"channels[4]", [](Draft& d) { d.channels[4].side = Side::left; }},
      {"channels[4]", [&](Draft& d) { d.channels[4].full_scale = kNan; }},
      {"channels[1]", [](Draft& d) { d.channels[1].full_scale = -1; }},
      {"channels[1]", [](Draft& d) { d.channels[1].track = 3; }},
      {"channels[1]", [](Draft& d) { d.channels[1].kind = static_cast<ChannelKind>(2); }},
      {"channels[1]", [](Draft& d) { d.channels[1].side = static_cast<Side>(3); }},
      {"channels[1]", [](Draft& d) { d.channels[1].side = Side::right; }},
      {"channels[1]", [](Draft& d) { d.channels[1].motion = static_cast<Motion>(7); }},
      {"channels[1]", [](Draft& d) { d.channels[1].motion = Motion::rotate_x; }},
      {"channels[1]", [](Draft& d) { d.channels[1].frame = static_cast<Frame>(5); }},
      {"channels[1]", [](Draft& d) { d.channels[1].zero[0] = 1; }},
      {"clips[1]", [&](Draft& d) { d.clips[1].name = kBadString; }},
      {"clips[1]", [](Draft& d) { d.clips[1].kind = static_cast<ClipKind>(6); }},
      {"clips[1]", [](Draft& d) { d.clips[1].zero[0] = 1; }},
      {"clips[1]", [](Draft& d) { d.clips[1].end_ns = d.clips[1].start_ns - 1; }},
      {"clips[1]", [](Draft& d) { d.clips[1].end_ns = kTimeLimit_ns + 1; }},
      {"clips[1]", [](Draft& d) { d.clips[1].first_curve = 1; }},
      {"clips[1]", [](Draft& d) { d.clips[1].curve_count = kNone; }},
      {"clips[1]", [](Draft& d) { d.clips[1].first_marker = 1; }},
      {"clips[1]", [](Draft& d) { d.clips[1].marker_count = 9; }},
      {"clips[3]", [](Draft& d) { --d.clips[1].marker_count; }},
      {"curves[1]", [](Draft& d) { d.curves[1].channel = ChannelId{5}; }},
      {"curves[1]", [](Draft& d) { d.curves[1].channel = d.curves[0].channel; }},
      {"curves[1]", [](Draft& d) { d.curves[1].first_knot = 3; }},
      {"curves[1]", [](Draft& d) { d.curves[1].knot_count = 0; }},
      {"curves[3]", [](Draft& d) { d.curves[3].knot_count = 4; }},
      {"curves[3]", [](Draft& d) { d.curves[3].knot_count = kNone; }},
      {"knots[15]", [](Draft& d) { --d.curves[3].knot_count; }},
      {"knots[1]",
       [](Draft& d) {
         d.knots[1] = {-kTimeLimit_ns - 1, 0, kShapeHold};
       }},
      {"knots[1]",
       [](Draft& d) {
         d.knots[1] = {-1, 0, kShapeHold};
       }},
      {"knots[2]", [](Draft& d) { d.knots[1] = d.knots[2] = d.knots[0]; }},
      {"knots[1]", [&](Draft& d) { d.knots[1].value = kNan; }},
      {"knots[1]", [&](Draft& d) { d.knots[1].value = kInf; }},
      {"knots[1]", [](Draft& d) { d.knots[1].value = -0.25F; }},
      {"knots[13]", [](Draft& d) { d.knots[13].value = -1.25F; }},
      {"knots[1]", [](Draft& d) { d.knots[1].shape = 2; }},
      {"knots[8]", [](Draft& d) { d.knots[8].shape = 1; }},
      {"curves[3]", [](Draft& d) { d.curves[3].first_handle = 0; }},
      {"curves[3]", [](Draft& d) { d.curves[3].first_handle = kNone; }},
      {"curves[3]", [](Draft& d) { d.knots[8].shape = kShapeHold; }},
      {"handles[2]", [](Draft& d) { d.handles.push_back(d.handles[0]); }},
      {"knots[1]", [](Draft& d) { d.knots[1].shape = kShapeFirstReserved; }},
      {"knots[8]", [](Draft& d) { d.handles[0].b2 = 2.5F; }},
      {"handles[0]", [&](Draft& d) { d.handles[0].b1 = kNan; }},
      {"handles[1]", [](Draft& d) { d.handles[1].b1 = -3.5F; }},
      {"markers[1]", [](Draft& d) { d.markers[1].time_ns = -1'000'000'000; }},
      {"markers[1]", [&](Draft& d) { d.markers[1].name = kBadString; }},
      {"markers[1]", [](Draft& d) { d.markers[1].kind = static_cast<MarkerKind>(12); }},
      {"markers[1]", [](Draft& d) { d.markers[1].zero[1] = 8; }},
      {"markers[1]", [](Draft& d) { d.markers[1].hand = static_cast<Hand>(2); }},
      {"knot_sources[0]", [](Draft& d) { d.knot_sources.pop_back(); }},
      {"knot_sources[1]", [](Draft& d) { d.knot_sources[1] = 5; }},
      {"sources[1]", [&](Draft& d) { d.sources[1].file = kBadString; }},
      {"sources[1]", [](Draft& d) { d.sources[1].line = 0; }},
      {"muscles[1]", [&](Draft& d) { d.muscles[1].except = kBadString; }},
      {"muscles[1]", [](Draft& d) { d.muscles[1].name = d.muscles[0].name; }},
      {"muscles[1]", [](Draft& d) { d.muscles[1].kind = static_cast<MuscleKind>(7); }},
      {"muscles[1]", [](Draft& d) { d.muscles[1].falloff = static_cast<Falloff>(2); }},
      {"muscles[1]", [&](Draft& d) { d.muscles[1].insertion_offset[2] = kNan; }},
      {"muscles[1]", [&](Draft& d) { d.muscles[1].slide[0] = kInf; }},
      {"muscles[0]", [](Draft& d) { d.muscles[0].angle = -0.1F; }},
      {"muscles[3]", [](Draft& d) { d.muscles[3].angle = -3.2F; }},
      {"muscles[3]", [](Draft& d) { d.muscles[3].closes = 1.5F; }},
      {"muscles[2]", [](Draft& d) { d.muscles[2].minor_radius = -1; }},
      {"muscles[4]", [](Draft& d) { d.muscles[4].frame = Frame::none; }},
      {"actuations[1]", [](Draft& d) { std::swap(d.actuations[0], d.actuations[1]); }},
      {"actuations[1]", [](Draft& d) { d.actuations[1].channel = ChannelId{5}; }},
      {"actuations[1]", [](Draft& d) { d.actuations[1].muscle = MuscleId{6}; }},
      {"actuations[1]", [&](Draft& d) { d.actuations[1].share = kNan; }},
      {"landmarks[1]", [&](Draft& d) { d.landmarks[1].position[1] = kInf; }},
      {"landmarks[1]", [](Draft& d) { d.landmarks[1].name = d.landmarks[0].name; }},
      {"faces[0]", [&](Draft& d) { d.faces[0].surface = kBadString; }},
      {"faces[1]", [](Draft& d) { d.faces.push_back(d.faces[0]); }},
      {"inputs[1]", [&](Draft& d) { d.inputs[1].name = kBadString; }},
      {"inputs[1]", [&](Draft& d) { d.inputs[1].from = kBadString; }},
      {"inputs[1]", [&](Draft& d) { d.inputs[1].path = kBadString; }},
      {"inputs[1]", [](Draft& d) { d.inputs[1].name = StringId{}; }},
      {"inputs[1]", [](Draft& d) { d.inputs[1].path = StringId{}; }},
      {"inputs[1]", [](Draft& d) { d.inputs[1].zero[3] = 1; }},
  };
  for (std::size_t i = 0; i < bad.size(); ++i) {
    Draft draft = small_draft();
    bad[i].break_it(draft);
    const auto image = Image::from(draft);
    EXPECT_FALSE(image) << i << ": " << bad[i].place;
    if (image) {
      continue;
    }
    EXPECT_EQ(image.error().kind, "invalid_program") << i;
    EXPECT_EQ(image.error().place, "the compiled program: " + std::string(bad[i].place)) << i << image.error().cause;
  }
}

TEST(check, reads_strings_as_utf8) {
  for (const std::string_view good : {"", "a", "\xC2\x80", "\xE0\xA0\x80", "\xED\x9F\xBF", "\xEF\xBF\xBF",
                                      "\xF0\x90\x80\x80", "\xF4\x8F\xBF\xBF", "z\xC3\xA9z"}) {
    EXPECT_TRUE(is_utf8(good));
  }
  for (const std::string_view bad : {"\x80", "\xC1\xBF", "\xC2", "\xC2z", "\xE0\x9F\xBF", "\xED\xA0\x80", "\xE2\x82",
                                     "\xF0\x8F\xBF\xBF", "\xF4\x90\x80\x80", "\xF5\x80\x80\x80", "\xF1\x80\x80z"}) {
    EXPECT_FALSE(is_utf8(bad));
  }
}

TEST(check, random_programs_pass_and_random_corruptions_do_no_harm) {
  std::mt19937 random(5);
  for (int i = 0; i < 300; ++i) {
    std::vector<std::byte> bytes = encode(random_draft(random));
    ASSERT_EQ(kind_of(bytes), "");
    for (int k = 0; k < 10; ++k) {
      const std::size_t at = random() % bytes.size();
      const std::byte before = bytes[at];
      bytes[at] = static_cast<std::byte>(random());
      reseal(bytes);
      kind_of(bytes);
      bytes[at] = before;
    }
  }
}

}  // namespace
}  // namespace nms::program
