#include <nms/program/utf8.h>

#include <cstddef>

namespace nms::program {

bool is_utf8(std::string_view bytes) {
  const auto at = [&](std::size_t i) { return static_cast<unsigned char>(bytes[i]); };
  for (std::size_t i = 0; i < bytes.size();) {
    const unsigned lead = at(i);
    if (lead < 0x80U) {
      ++i;
      continue;
    }
    const std::size_t length = lead >= 0xC2U && lead <= 0xDFU   ? 2
                               : lead >= 0xE0U && lead <= 0xEFU ? 3
                               : lead >= 0xF0U && lead <= 0xF4U ? 4
                                                                : 0;
    if (length == 0 || bytes.size() - i < length) {
      return false;
    }
    // Only the second byte's range depends on the lead.
    const unsigned lowest = lead == 0xE0U ? 0xA0U : lead == 0xF0U ? 0x90U : 0x80U;
    const unsigned highest = lead == 0xEDU ? 0x9FU : lead == 0xF4U ? 0x8FU : 0xBFU;
    if (at(i + 1) < lowest || at(i + 1) > highest) {
      return false;
    }
    for (std::size_t k = 2; k < length; ++k) {
      if (at(i + k) < 0x80U || at(i + k) > 0xBFU) {
        return false;
      }
    }
    i += length;
  }
  return true;
}

}  // namespace nms::program
