#pragma once

#include <string>
#include <vector>

#include <nms/picture/image.h>

namespace nms::picture {

/// A picture with a line or two under it.
struct Tile {
  Image image;
  std::string caption;  ///< first line
  std::string detail;   ///< second line, smaller and lighter; may be empty
};

/// Tiles in rows of `columns`, from the top left, with a title above. All images have one size.
/// What a caption has no room for is cut off, with two dots.
[[nodiscard]] Image contact_sheet(const std::vector<Tile>& tiles, int columns, const std::string& title);

}  // namespace nms::picture
