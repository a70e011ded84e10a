#include <nms/picture/contact_sheet.h>

#include <cstring>

#include <gtest/gtest.h>

namespace nms::picture {
namespace {

bool is(const Image& image, int x, int y, Rgb c) {
  const std::uint8_t* p = &image.pixels[static_cast<std::size_t>(y * image.width + x) * 3];
  return p[0] == c.r && p[1] == c.g && p[2] == c.b;
}

/// Whether any pixel of a stretch of a row differs from its first.
bool written(const Image& image, int x0, int x1, int y0, int y1) {
  const Rgb first{image.pixels[static_cast<std::size_t>(y0 * image.width + x0) * 3],
                  image.pixels[static_cast<std::size_t>(y0 * image.width + x0) * 3 + 1],
                  image.pixels[static_cast<std::size_t>(y0 * image.width + x0) * 3 + 2]};
  for (int y = y0; y < y1; ++y)
    for (int x = x0; x < x1; ++x)
      if (!is(image, x, y, first)) return true;
  return false;
}

TEST(ContactSheet, tiles_stand_in_rows_with_their_captions) {
  const Rgb red{200, 0, 0};
  const Rgb blue{0, 0, 200};
  const Image sheet = contact_sheet(
      {{Image(40, 50, red), "one", ""}, {Image(40, 50, blue), "two", ""}, {Image(40, 50, red), "three", ""}}, 2, "");
  EXPECT_EQ(sheet.width, 8 + 2 * 48);
  EXPECT_TRUE(is(sheet, 10, 10, red));
  EXPECT_TRUE(is(sheet, 8 + 48 + 2, 10, blue));
  const int second_row = 8 + 50 + 20 + 8;
  EXPECT_TRUE(is(sheet, 10, second_row + 2, red));
  EXPECT_TRUE(written(sheet, 8, 48, 8 + 52, 8 + 68));
  EXPECT_FALSE(written(sheet, 8 + 48, 8 + 88, second_row + 52, second_row + 68)) << "there is no fourth tile";
}

TEST(ContactSheet, a_long_caption_stays_in_its_tile) {
  const Image sheet =
      contact_sheet({{Image(60, 20, {9, 9, 9}), "a caption that is far too long for its tile", "x"}}, 1, "t");
  EXPECT_EQ(sheet.width, 60 + 16);
  EXPECT_FALSE(written(sheet, 8 + 61, sheet.width, 0, sheet.height));
}

TEST(Png, a_file_begins_with_its_signature_and_says_its_size) {
  const auto png = encode_png(Image(3, 2, {1, 2, 3}));
  const unsigned char signature[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
  ASSERT_GT(png.size(), 24U);
  EXPECT_EQ(std::memcmp(png.data(), signature, 8), 0);
  EXPECT_EQ(static_cast<int>(png[19]), 3);
  EXPECT_EQ(static_cast<int>(png[23]), 2);
}

TEST(Text, what_lies_outside_is_left_out) {
  Image image(10, 10, {255, 255, 255});
  write_text(image, "W\xC3\xA9 \xF0\x9F\x98\x80 ~", -6, -4, 30, {0, 0, 0});
  EXPECT_TRUE(written(image, 0, 10, 0, 10));
}

}  // namespace
}  // namespace nms::picture
