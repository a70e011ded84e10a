#include <nms/picture/contact_sheet.h>

#include <algorithm>

namespace nms::picture {
namespace {

constexpr Rgb kPaper{246, 246, 244};
constexpr Rgb kInk{32, 34, 38};
constexpr Rgb kPale{108, 112, 120};
constexpr int kGap = 8;     // [px] between tiles, and around all
constexpr int kTitle = 26;  // [px] heights of lines
constexpr int kCaption = 20;
constexpr int kDetail = 16;

/// `text`, cut to `width` pixels.
std::string fitted(std::string text, int width, int size) {
  if (text_width(text, size) <= width) return text;
  while (!text.empty() && text_width(text + "..", size) > width) text.pop_back();
  return text + "..";
}

}  // namespace

Image contact_sheet(const std::vector<Tile>& tiles, int columns, const std::string& title) {
  if (tiles.empty() || columns < 1) return {};
  const int across = std::min<int>(columns, static_cast<int>(tiles.size()));
  const int rows = (static_cast<int>(tiles.size()) + across - 1) / across;
  const int tile_width = tiles.front().image.width;
  const bool details = std::any_of(tiles.begin(), tiles.end(), [](const Tile& t) { return !t.detail.empty(); });
  const int tile_height = tiles.front().image.height + kCaption + (details ? kDetail : 0);
  const int top = title.empty() ? kGap : kTitle + kGap;
  Image sheet(kGap + across * (tile_width + kGap), top + rows * (tile_height + kGap), kPaper);
  write_text(sheet, fitted(title, sheet.width - 2 * kGap, kTitle - 4), kGap, kGap, kTitle - 4, kInk);
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    const int x = kGap + static_cast<int>(i) % across * (tile_width + kGap);
    const int y = top + static_cast<int>(i) / across * (tile_height + kGap);
    paste(sheet, tiles[i].image, x, y);
    const int text_y = y + tiles[i].image.height + 4;
    write_text(sheet, fitted(tiles[i].caption, tile_width, kCaption - 2), x, text_y, kCaption - 2, kInk);
    write_text(sheet, fitted(tiles[i].detail, tile_width, kDetail - 2), x, text_y + kCaption - 2, kDetail - 2, kPale);
  }
  return sheet;
}

}  // namespace nms::picture
