#include <nms/program/enum_names.h>
#include <nms/program/text.h>

#include <cstring>
#include <fstream>
#include <iterator>
#include <set>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "container.h"
#include "test_programs.h"

namespace nms::program {
namespace {

std::vector<std::byte> copy(std::span<const std::byte> bytes) { return {bytes.begin(), bytes.end()}; }

TEST(text, of_a_program_that_was_text_is_that_text) {
  const Image image = Image::from(small_draft()).value();
  EXPECT_EQ(to_text(image.program()), kSmallProgram);
}

TEST(text, leads_back_to_the_same_bytes) {
  const Image image = Image::from(small_draft()).value();
  const Draft again = from_text(to_text(image.program()), "again").value();
  EXPECT_EQ(encode(again), copy(image.bytes()));
}

TEST(text, of_random_programs_is_a_fixed_point) {
  std::mt19937 random(4);
  for (int i = 0; i < 200; ++i) {
    const Image image = Image::from(random_draft(random)).value();
    const std::string text = to_text(image.program());
    const auto draft = from_text(text, "random");
    ASSERT_TRUE(draft) << draft.error().place << ": " << draft.error().cause;
    const Image again = Image::from(*draft).value();
    ASSERT_EQ(to_text(again.program()), text);
    ASSERT_EQ(encode(from_text(to_text(again.program()), "again").value()), encode(*draft));
  }
}

TEST(text, can_be_asked_for_clips_alone) {
  const Image image = Image::from(small_draft()).value();
  const std::string clips = to_text(image.program(), {.rig = false, .channels = false});
  EXPECT_EQ(clips.find("clip smile expression 0s..2.34s hash 0123456789abcdef\n  curve AU12L\n    0s 0 smooth  ; gree"),
            0U);
  EXPECT_EQ(clips.find("muscle"), std::string::npos);
  EXPECT_EQ(clips.find("channels"), std::string::npos);
  const auto draft = from_text(clips, "clips");
  ASSERT_FALSE(draft);
  EXPECT_EQ(draft.error().place, "clips:1");
}

TEST(text, keeps_every_number_and_name_to_the_bit) {
  Draft draft;
  draft.strings = {"", "x", std::string("\0\x01\"\\\n;\xC3\xA9", 8), "clip"};
  Channel channel;
  channel.name = StringId{2};
  channel.title = StringId{3};
  draft.channels = {channel};
  draft.knots = {{-99'999'999'999'999, -0.0F, 0},
                 {-1, 1e-45F, kShapeHold},
                 {0, 0.1F, kShapeLinear},
                 {kTimeLimit_ns, 0.99999994F, kShapeSmooth}};
  draft.handles = {{-1.0F, 1.9999999F}};
  draft.curves = {{ChannelId{0}, 0, 4, 0}};
  Clip clip;
  clip.curve_count = 1;
  draft.clips = {clip};
  const Image image = Image::from(draft).value();
  const std::string text = to_text(image.program());
  const Draft again = from_text(text, "again").value();
  ASSERT_EQ(again.knots.size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(std::memcmp(&again.knots[i], &draft.knots[i], sizeof(Knot)), 0) << i;
  }
  EXPECT_EQ(again.handles[0].b2, 1.9999999F);
  EXPECT_EQ(again.strings[static_cast<std::size_t>(again.channels[0].name)], draft.strings[2]);
  EXPECT_NE(text.find("    -0.000000001s 1e-45 hold\n"), std::string::npos) << text;
  EXPECT_NE(text.find("    -99999.999999999s -0 cubic(-1, 1.9999999)\n"), std::string::npos) << text;
}

TEST(text, has_room_for_as_many_different_cubics_in_a_curve_as_a_shape_can_count) {
  std::string text = "nms program 1\nchannels\n  x action_unit\nclip c pose 0s..1s hash 0000000000000000\n  curve x\n";
  for (int i = 0; i < kShapeFirstReserved; ++i) {
    text += fmt::format("    {}ns 0 cubic(0, {})\n", i, static_cast<float>(i) / 65536.0F);
  }
  text += "    1s 0 cubic(0, 0)\n";  // one there was
  const auto draft = from_text(text, "t");
  ASSERT_TRUE(draft) << draft.error().place << draft.error().cause;
  EXPECT_EQ(draft->handles.size(), std::size_t{kShapeFirstReserved});
  EXPECT_TRUE(Image::from(*draft));
  const auto more = from_text(text + "    2s 0 cubic(0, 1)\n", "t");
  ASSERT_FALSE(more);
  EXPECT_EQ(more.error().cause, "expected no more different cubics in one curve");
}

TEST(text, that_is_not_a_programs_is_refused_with_its_line) {
  const std::string clip = "clip c pose 0s..1s hash 0000000000000000\n";
  const std::string curve = "channels\n  x action_unit\n" + clip + "  curve x\n";
  const std::vector<std::pair<std::string, std::string>> bad = {
      {"  x\n", "t:2"},
      {"clops\n", "t:2"},
      {"tracks x\n", "t:2"},
      {"tracks\n  brows weakest\n", "t:3"},
      {"tracks\n  a sum\n  a sum\n", "t:4"},
      {"tracks\n  \"a sum\n", "t:3"},
      {"tracks\n  \"\\q\" sum\n", "t:3"},
      {"tracks\n  \"\\x0\" sum\n", "t:3"},
      {"tracks\n  \"\\\n", "t:3"},
      {"channels\n  x action_unit track y\n", "t:3"},
      {"channels\n  x action_unit au 65536\n", "t:3"},
      {"channels\n  x action_unit full_scale inf\n", "t:3"},
      {"channels\n  x action_unit full_scale -nan\n", "t:3"},
      {"channels\n  x action_unit full_scale 1e\n", "t:3"},
      {"channels\n  x action_unit wings 2\n", "t:3"},
      {"clip c pose 0s.1s hash 0000000000000000\n", "t:2"},
      {"clip c pose 0s..1s hash 000000000000000\n", "t:2"},
      {"clip c pose 0s..1s\n", "t:2"},
      {"clip c poze 0s..1s hash 0000000000000000\n", "t:2"},
      {clip + "  0s 0 hold\n", "t:3"},
      {clip + "  curve y\n", "t:3"},
      {clip + "  marker 0s begin x\n", "t:3"},
      {clip + "  marker 0s mark\n", "t:3"},
      {curve + "    0s 0\n", "t:6"},
      {curve + "    0 0 hold\n", "t:6"},
      {curve + "    0.1234567890s 0 hold\n", "t:6"},
      {curve + "    99999999999999999999s 0 hold\n", "t:6"},
      {curve + "    9999999999999999999ns 0 hold\n", "t:6"},
      {curve + "    0s 0 cubic(1)\n", "t:6"},
      {curve + "    0s 0 cubic 1 2\n", "t:6"},
      {curve + "    0s 0 hold hold\n", "t:6"},
      {curve + "    0s 0 hold ; nowhere\n", "t:6"},
      {curve + "    0s 0 hold ; a:1\n", "t:6"},
      {curve + "    0s 0 hold ; a:4294967296:1\n", "t:6"},
      {curve + "    0s 0 hold ; a:1:1 b c\n", "t:6"},
      {curve + "    100000.000000001s 0 hold\n", "t:6"},
      {"inputs\n  a from\n", "t:3"},
      {"inputs\n  a hash 0000000000000000\n", "t:3"},
      {"inputs\n  a path b hash 0\n", "t:3"},
      {"inputs\n  a path b hash 0000000000000000 c\n", "t:3"},
      {"muscle m lever\n", "t:2"},
      {"muscle m linear\n  strength 3\n", "t:3"},
      {"muscle m linear\n  slide 3 4\n", "t:3"},
      {"muscle m linear\nactuations\n  x m 1\n", "t:4"},
      {"landmarks\n  a 1 2\n", "t:3"},
      {"face ada paper x\n", "t:2"},
      {"face ada\n  x\n", "t:3"},
  };
  for (const auto& [text, place] : bad) {
    const auto draft = from_text("nms program 1\n" + text, "t");
    ASSERT_FALSE(draft) << text;
    EXPECT_EQ(draft.error().kind, "invalid_program_text");
    EXPECT_EQ(draft.error().place, place) << text;
    EXPECT_EQ(draft.error().cause.find("expected "), 0U) << text;
  }
  EXPECT_FALSE(from_text("", "t"));
  EXPECT_FALSE(from_text("nms program 2\n", "t"));
}

template <typename Enum>
void expect_names_lead_back() {
  for (std::size_t i = 0; i < EnumNames<Enum>::kNames.size(); ++i) {
    const auto value = static_cast<Enum>(i);
    EXPECT_EQ(enum_from<Enum>(enum_name(value)), value) << enum_name(value);
  }
  EXPECT_EQ(enum_from<Enum>(""), std::nullopt);
}

TEST(text, names_each_enumerator_once) {
  expect_names_lead_back<Side>();
  expect_names_lead_back<ChannelKind>();
  expect_names_lead_back<Motion>();
  expect_names_lead_back<Frame>();
  expect_names_lead_back<MergeOperator>();
  expect_names_lead_back<ClipKind>();
  expect_names_lead_back<MarkerKind>();
  expect_names_lead_back<MuscleKind>();
  expect_names_lead_back<Falloff>();
}

/// Which enumerators of one type a program's records hold, by name.
template <typename Enum>
class Seen {
 public:
  void add(Enum value) { seen_.insert(enum_name(value)); }
  void expect_all() const {
    for (const std::string_view name : EnumNames<Enum>::kNames) {
      EXPECT_EQ(seen_.count(name), 1U) << "tests/golden/program_text/every_record.txt has no " << name;
    }
  }

 private:
  std::set<std::string_view> seen_;
};

std::string every_record() {
  std::ifstream file(NMS_SOURCE_DIR "/tests/golden/program_text/every_record.txt", std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(text, of_every_record_is_known) {
  const std::string text = every_record();
  const auto draft = from_text(text, "every_record.txt");
  ASSERT_TRUE(draft) << draft.error().place << ": " << draft.error().cause;
  const auto image = Image::from(*draft);
  ASSERT_TRUE(image) << image.error().place << ": " << image.error().cause;
  EXPECT_EQ(to_text(image->program()), text);
}

TEST(text, of_every_record_shows_every_table_enumerator_and_shape) {
  const Image image = Image::from(from_text(every_record(), "every_record.txt").value()).value();
  const Program& program = image.program();
  visit_sections(program, [](SectionKind, std::string_view name, const auto& table) {
    EXPECT_FALSE(table.empty()) << "tests/golden/program_text/every_record.txt has no " << name;
  });
  Seen<FacePartKind> parts;
  for (const FacePart& part : program.face_parts) {
    parts.add(part.kind);
  }
  parts.expect_all();
  Seen<MergeOperator> operators;
  for (const Track& track : program.tracks) {
    operators.add(track.merge);
  }
  Seen<ChannelKind> channels;
  Seen<Side> sides;
  Seen<Motion> motions;
  Seen<Frame> frames;
  for (const Channel& channel : program.channels) {
    channels.add(channel.kind);
    sides.add(channel.side);
    motions.add(channel.motion);
    frames.add(channel.frame);
  }
  Seen<ClipKind> clips;
  for (const Clip& clip : program.clips) {
    clips.add(clip.kind);
  }
  Seen<MarkerKind> markers;
  for (const Marker& marker : program.markers) {
    markers.add(marker.kind);
  }
  Seen<MuscleKind> muscles;
  Seen<Falloff> falloffs;
  for (const Muscle& muscle : program.muscles) {
    muscles.add(muscle.kind);
    falloffs.add(muscle.falloff);
  }
  std::set<std::uint16_t> shapes;
  for (const Knot& knot : program.knots) {
    shapes.insert(knot.shape);
  }
  operators.expect_all();
  channels.expect_all();
  sides.expect_all();
  motions.expect_all();
  frames.expect_all();
  clips.expect_all();
  markers.expect_all();
  muscles.expect_all();
  falloffs.expect_all();
  EXPECT_EQ(shapes, (std::set<std::uint16_t>{0, kShapeHold, kShapeLinear, kShapeSmooth}));
}

TEST(text, may_have_comments_blank_lines_and_windows_line_ends) {
  const auto draft = from_text(
      "nms program 1\r\n\r\n; a remark\r\nchannels ; all of them\r\n\tx action_unit ; one\r\n"
      "clip c pose 0ns..1500000000ns hash 0000000000000000\r\n  curve x\r\n    1ns 0.5 hold\r\n",
      "t");
  ASSERT_TRUE(draft) << draft.error().place << draft.error().cause;
  EXPECT_EQ(draft->clips[0].end_ns, 1'500'000'000);
  EXPECT_EQ(draft->knots[0].time_ns(), 1);
}

}  // namespace
}  // namespace nms::program
