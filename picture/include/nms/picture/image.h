#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

namespace nms::picture {

/// One colour as it is stored: sRGB, 8 bits a channel.
struct Rgb {
  std::uint8_t r = 0, g = 0, b = 0;
};

/// Pixels in rows from the top, three bytes each: sRGB.
struct Image {
  int width = 0;                     ///< [px]
  int height = 0;                    ///< [px]
  std::vector<std::uint8_t> pixels;  ///< 3 * width * height

  Image() = default;
  Image(int width, int height, Rgb fill);
};

/// Copies `from` with its top left corner at (x, y); what lies outside is left out.
void paste(Image& onto, const Image& from, int x, int y);

/// How wide `text` is when written at `size` pixels a line. Only ASCII has glyphs; anything else is as wide as a `?`.
[[nodiscard]] int text_width(std::string_view text, int size);

/// Writes one line of text, its top left corner at (x, y), `size` pixels high. What lies outside is left out.
void write_text(Image& onto, std::string_view text, int x, int y, int size, Rgb color);

/// The image as a PNG file.
[[nodiscard]] std::vector<std::byte> encode_png(const Image& image);

}  // namespace nms::picture
