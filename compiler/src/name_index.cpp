#include "name_index.h"

#include <utility>

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace nms::compiler {

namespace {
constexpr std::size_t kFirstSlots = 64;
}

NameIndex::NameIndex() : slots_(kFirstSlots), mask_(kFirstSlots - 1) {}

std::uint32_t NameIndex::hash_of(std::string_view name) {
  return static_cast<std::uint32_t>(XXH3_64bits(name.data(), name.size()));
}

std::uint32_t NameIndex::hash_of(const Slot& slot) {
  if (slot.length != kLong) return hash_of(std::string_view(slot.head.data(), slot.length));
  std::uint32_t hash = 0;
  std::memcpy(&hash, slot.head.data(), sizeof hash);
  return hash;
}

void NameIndex::place(const Slot& slot, std::uint32_t hash) {
  std::size_t at = hash & mask_;
  while (slots_[at].number != kNothing) at = (at + 1) & mask_;
  slots_[at] = slot;
}

void NameIndex::grow(std::size_t slots) {
  const std::vector<Slot> old = std::exchange(slots_, std::vector<Slot>(slots));
  mask_ = slots - 1;
  for (const Slot& slot : old)
    if (slot.number != kNothing) place(slot, hash_of(slot));
}

void NameIndex::reserve(std::size_t count) {
  std::size_t slots = slots_.size();
  while (slots * 3 < count * 4) slots *= 2;
  if (slots != slots_.size()) grow(slots);
}

void NameIndex::insert(std::string_view name, std::uint32_t number) {
  // At most three quarters full, so that a search ends soon.
  if ((count_ + 1) * 4 > slots_.size() * 3) grow(slots_.size() * 2);
  ++count_;
  const std::uint32_t hash = hash_of(name);
  place(slot_of(name, hash, number), hash);
}

}  // namespace nms::compiler
