#include "container.h"

#include <bit>
#include <cassert>

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace nms::program {

static_assert(std::endian::native == std::endian::little, "records lie in the file as they lie in memory");

std::uint64_t checksum(std::span<const std::byte> bytes) {
  assert(bytes.size() >= sizeof(Header));
  constexpr std::size_t kBefore = offsetof(Header, checksum);
  const std::span<const std::byte> after = bytes.subspan(sizeof(Header));
  XXH3_state_t state;
  XXH3_64bits_reset(&state);
  XXH3_64bits_update(&state, bytes.data(), kBefore);
  if (!after.empty()) {
    XXH3_64bits_update(&state, after.data(), after.size());
  }
  return XXH3_64bits_digest(&state);
}

std::uint64_t text_hash(std::string_view text) { return XXH3_64bits(text.data(), text.size()); }

}  // namespace nms::program
