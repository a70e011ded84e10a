#include "utf8.h"

#include <cstdint>
#include <cstring>

namespace nms::compiler {

std::size_t first_not_utf8(std::string_view bytes) {
  const auto at = [&](std::size_t i) { return static_cast<unsigned>(static_cast<unsigned char>(bytes[i])); };
  for (std::size_t i = 0; i < bytes.size();) {
    // Most text is ASCII: eight bytes at once.
    for (std::uint64_t eight = 0; bytes.size() - i >= sizeof eight; i += sizeof eight) {
      std::memcpy(&eight, bytes.data() + i, sizeof eight);
      if ((eight & 0x8080808080808080U) != 0) break;
    }
    if (i == bytes.size()) break;
    const unsigned lead = at(i);
    const std::size_t length = lead < 0x80U                     ? 1
                               : lead >= 0xC2U && lead <= 0xDFU ? 2
                               : lead >= 0xE0U && lead <= 0xEFU ? 3
                               : lead >= 0xF0U && lead <= 0xF4U ? 4
                                                                : 0;
    if (length == 0 || bytes.size() - i < length) return i;
    for (std::size_t k = 1; k < length; ++k) {
      // Only the second byte's range depends on the lead.
      const unsigned lowest = k > 1 ? 0x80U : lead == 0xE0U ? 0xA0U : lead == 0xF0U ? 0x90U : 0x80U;
      const unsigned highest = k > 1 ? 0xBFU : lead == 0xEDU ? 0x9FU : lead == 0xF4U ? 0x8FU : 0xBFU;
      if (at(i + k) < lowest || at(i + k) > highest) return i;
    }
    i += length;
  }
  return bytes.size();
}

}  // namespace nms::compiler
