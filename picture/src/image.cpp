#include <nms/picture/image.h>

#include <algorithm>
#include <array>
#include <string>

#if defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wold-style-cast"
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#endif
#define STB_IMAGE_WRITE_STATIC
#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STBI_WRITE_NO_STDIO
#include <stb/stb_easy_font.h>
#include <stb/stb_image_write.h>
#if defined(__GNUC__)
#pragma GCC diagnostic pop
#endif

namespace nms::picture {
namespace {

/// The font's own line is 12 units high, of which capitals take 7.
constexpr int kFontLine = 12;

std::string ascii(std::string_view text) {
  std::string out;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if ((byte & 0xC0U) == 0x80U) continue;  // the rest of a character of several bytes
    out += byte >= 0x20U && byte < 0x7FU ? c : '?';
  }
  return out;
}

/// The font's quads: rectangles in font units.
struct Quad {
  float x0, y0, x1, y1;
};

std::vector<Quad> quads_of(std::string text) {
  struct Vertex {
    float x, y, z;
    std::uint8_t color[4];
  };
  std::vector<std::array<Vertex, 4>> buffer(text.size() * 20 + 8);
  const int count = stb_easy_font_print(0.0F, 0.0F, text.data(), nullptr, buffer.data(),
                                        static_cast<int>(buffer.size() * sizeof(std::array<Vertex, 4>)));
  std::vector<Quad> quads;
  quads.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    const auto& q = buffer[static_cast<std::size_t>(i)];
    quads.push_back({q[0].x, q[0].y, q[2].x, q[2].y});
  }
  return quads;
}

/// Length that [a, b) and [lo, lo + 1) share.
float overlap(float a, float b, int lo) {
  return std::max(0.0F, std::min(b, static_cast<float>(lo + 1)) - std::max(a, static_cast<float>(lo)));
}

}  // namespace

Image::Image(int w, int h, Rgb fill) : width(w), height(h), pixels(static_cast<std::size_t>(w) * h * 3) {
  for (std::size_t i = 0; i < pixels.size(); i += 3) {
    pixels[i] = fill.r;
    pixels[i + 1] = fill.g;
    pixels[i + 2] = fill.b;
  }
}

void paste(Image& onto, const Image& from, int x, int y) {
  const int left = std::max(0, -x);
  const int right = std::min(from.width, onto.width - x);
  if (right <= left) return;
  for (int row = std::max(0, -y); row < std::min(from.height, onto.height - y); ++row) {
    const auto begin = from.pixels.begin() + (static_cast<std::ptrdiff_t>(row) * from.width + left) * 3;
    std::copy(begin, begin + static_cast<std::ptrdiff_t>(right - left) * 3,
              onto.pixels.begin() + (static_cast<std::ptrdiff_t>(row + y) * onto.width + x + left) * 3);
  }
}

int text_width(std::string_view text, int size) {
  std::string plain = ascii(text);
  return (stb_easy_font_width(plain.data()) * size + kFontLine - 1) / kFontLine;
}

void write_text(Image& onto, std::string_view text, int x, int y, int size, Rgb color) {
  const float scale = static_cast<float>(size) / kFontLine;
  const std::array<std::uint8_t, 3> ink{color.r, color.g, color.b};
  for (const Quad& q : quads_of(ascii(text))) {
    const float x0 = static_cast<float>(x) + q.x0 * scale;
    const float x1 = static_cast<float>(x) + q.x1 * scale;
    const float y0 = static_cast<float>(y) + q.y0 * scale;
    const float y1 = static_cast<float>(y) + q.y1 * scale;
    for (int row = std::max(0, static_cast<int>(y0)); row < onto.height && static_cast<float>(row) < y1; ++row)
      for (int column = std::max(0, static_cast<int>(x0)); column < onto.width && static_cast<float>(column) < x1;
           ++column) {
        const float share = overlap(x0, x1, column) * overlap(y0, y1, row);
        const std::size_t at = (static_cast<std::size_t>(row) * onto.width + column) * 3;
        for (std::size_t c = 0; c < 3; ++c) {
          const float under = onto.pixels[at + c];
          onto.pixels[at + c] = static_cast<std::uint8_t>(under + (static_cast<float>(ink[c]) - under) * share + 0.5F);
        }
      }
  }
}

std::vector<std::byte> encode_png(const Image& image) {
  std::vector<std::byte> out;
  const auto append = [](void* context, void* data, int size) {
    auto& bytes = *static_cast<std::vector<std::byte>*>(context);
    const auto* begin = static_cast<const std::byte*>(data);
    bytes.insert(bytes.end(), begin, begin + size);
  };
  stbi_write_png_to_func(append, &out, image.width, image.height, 3, image.pixels.data(), image.width * 3);
  return out;
}

}  // namespace nms::picture
