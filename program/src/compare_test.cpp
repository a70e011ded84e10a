#include <nms/program/compare.h>

#include <random>
#include <string>

#include <gtest/gtest.h>
#include <nms/program/text.h>

#include "test_programs.h"

namespace {

using namespace nms::program;

std::string with(std::string text, std::string_view from, std::string_view to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
  return text;
}

std::vector<Difference> differences(const std::string& before, const std::string& after) {
  const auto a = from_text(before, "before");
  const auto b = from_text(after, "after");
  EXPECT_TRUE(a && b);
  if (!a || !b) return {};
  const auto x = Image::from(*a);
  const auto y = Image::from(*b);
  EXPECT_TRUE(x && y);
  if (!x || !y) return {};
  return compare(x->program(), y->program());
}

const std::string kSmall(kSmallProgram);

TEST(Compare, a_program_is_as_itself) {
  EXPECT_TRUE(differences(kSmall, kSmall).empty());
  std::mt19937 random(3);
  for (int i = 0; i < 100; ++i) {
    const Draft draft = random_draft(random);
    const auto image = Image::from(draft);
    ASSERT_TRUE(image);
    EXPECT_TRUE(compare(image->program(), image->program()).empty());
  }
}

TEST(Compare, places_and_hashes_are_no_meaning) {
  EXPECT_TRUE(differences(kSmall, with(with(kSmall, "greeting.nms:12:3", "other.nms:99:1"), "0123456789abcdef",
                                       "0123456789abcde0"))
                  .empty());
}

TEST(Compare, what_is_within_the_tolerance_is_the_same) {
  EXPECT_TRUE(differences(kSmall, with(kSmall, "2.106s 0.8", "2.1069s 0.8005")).empty());
  EXPECT_FALSE(differences(kSmall, with(kSmall, "2.106s 0.8", "2.1072s 0.8")).empty());
  EXPECT_FALSE(differences(kSmall, with(kSmall, "2.106s 0.8", "2.106s 0.802")).empty());
}

TEST(Compare, both_sides_that_change_alike_are_one) {
  const auto d = differences(kSmall, with(kSmall, "2.106s 0.8", "2.106s 0.7"));
  ASSERT_EQ(d.size(), 1U);
  EXPECT_EQ(d[0].property, Property::peak);
  EXPECT_EQ(d[0].clip, "smile");
  EXPECT_EQ(d[0].track, "mouth");
  EXPECT_EQ(d[0].channel, "AU12");
  EXPECT_NEAR(d[0].before, 0.8, 1e-6);
  EXPECT_NEAR(d[0].after, 0.7, 1e-6);
  const auto one = differences(kSmall, with(kSmall, "2.106s 0.8 linear", "2.106s 0.7 linear"));
  ASSERT_EQ(one.size(), 1U);
  EXPECT_EQ(one[0].channel, "AU12L");
}

TEST(Compare, times_of_phases) {
  const auto d = differences(kSmall, with(kSmall, "2.106s 0.8", "2.006s 0.8"));
  ASSERT_EQ(d.size(), 2U);
  EXPECT_EQ(d[0].property, Property::apex);
  EXPECT_EQ(d[1].property, Property::release);
  EXPECT_EQ(d[0].before, 2'106'000'000.0);
  EXPECT_EQ(d[0].after, 2'006'000'000.0);
}

TEST(Compare, a_course_between_the_same_phases) {
  const auto d = differences(kSmall, with(kSmall, "0.234s 0.6", "0.234s 0.5"));
  ASSERT_EQ(d.size(), 2U);  // the two sides have different shapes there
  EXPECT_EQ(d[0].property, Property::course);
  EXPECT_EQ(d[1].property, Property::course);
  EXPECT_NEAR(d[0].after, 0.1, 1e-3);
}

TEST(Compare, clips_come_and_go_and_are_renamed) {
  const auto renamed = differences(kSmall, with(kSmall, "clip smile", "clip grin"));
  ASSERT_EQ(renamed.size(), 1U);
  EXPECT_EQ(renamed[0].property, Property::renamed);
  EXPECT_EQ(renamed[0].before_name, "smile");
  EXPECT_EQ(renamed[0].after_name, "grin");
  const auto other = differences(kSmall, with(with(kSmall, "clip smile", "clip grin"), "2.106s 0.8", "2.106s 0.7"));
  ASSERT_EQ(other.size(), 2U);
  EXPECT_EQ(other[0].property, Property::added);
  EXPECT_EQ(other[0].clip, "grin");
  EXPECT_EQ(other[1].property, Property::removed);
  EXPECT_EQ(other[1].clip, "smile");
}

TEST(Compare, signs_and_ends) {
  const auto moved = differences(kSmall, with(kSmall, "marker 1.2s stroke_end", "marker 1.25s stroke_end"));
  ASSERT_EQ(moved.size(), 1U);
  EXPECT_EQ(moved[0].property, Property::sign);
  EXPECT_EQ(moved[0].marker, "NOT-YET{neg}");
  EXPECT_EQ(moved[0].marker_kind, MarkerKind::stroke_end);
  EXPECT_EQ(moved[0].after - moved[0].before, 50e6);
  const auto gone = differences(kSmall, with(kSmall, "  marker 1.2s stroke_end \"NOT-YET{neg}\"\n", ""));
  ASSERT_EQ(gone.size(), 1U);
  EXPECT_FALSE(gone[0].has_after);
  EXPECT_TRUE(differences(kSmall, with(kSmall, "marker 2s offset neg", "marker 2.1s offset neg")).empty());
}

TEST(Compare, scales_and_tracks_of_channels) {
  const auto scaled = differences(kSmall, with(kSmall, "full_scale 1.3089969", "full_scale 1.2"));
  ASSERT_EQ(scaled.size(), 1U);
  EXPECT_EQ(scaled[0].property, Property::full_scale);
  EXPECT_EQ(scaled[0].channel, "head_yaw");
  const auto moved = differences(kSmall, with(kSmall, "au 4 track brows", "au 4 track mouth"));
  ASSERT_EQ(moved.size(), 1U);
  EXPECT_EQ(moved[0].property, Property::track);
}

/// A program with one curve of an axis.
std::string one_curve(const std::string& knots) {
  const std::size_t clips = kSmall.find("clip smile");
  const std::size_t rest = kSmall.find("  curve head_yaw");
  std::string head = kSmall.substr(0, clips) + "clip swing timeline 0s..3s hash 0123456789abcdef\n";
  const std::size_t end = kSmall.find("\n\n", rest);
  return head + "  curve head_yaw\n" + knots + kSmall.substr(end);
}

TEST(Compare, swings_are_counted) {
  const std::string two = one_curve("    0s 0 smooth\n    0.5s 0.5 smooth\n    1s -0.5 smooth\n    1.5s 0 hold\n");
  const std::string three = one_curve(
      "    0s 0 smooth\n    0.5s 0.5 smooth\n    0.8s 0.2 smooth\n    0.9s 0.5 smooth\n    1s -0.5 smooth\n"
      "    1.5s 0 hold\n");
  const auto d = differences(two, three);
  ASSERT_FALSE(d.empty());
  EXPECT_EQ(d.back().property, Property::swings);
  EXPECT_EQ(d.back().before, 2.0);
  EXPECT_EQ(d.back().after, 3.0);
}

TEST(Compare, a_peak_between_knots_counts) {
  // The cubic (0, 1, 1, 0) has its peak, 0.75, in its middle.
  const std::string bump = one_curve("    0s 0 cubic(1, 1)\n    1s 0 hold\n");
  const std::string lower = one_curve("    0s 0 cubic(0.8, 0.8)\n    1s 0 hold\n");
  const auto d = differences(bump, lower);
  ASSERT_EQ(d.size(), 1U);
  EXPECT_EQ(d[0].property, Property::peak);
  EXPECT_NEAR(d[0].before, 0.75, 1e-6);
  EXPECT_NEAR(d[0].after, 0.6, 1e-6);
}

}  // namespace
