#include "name_index.h"

#include <utility>

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace nms::compiler {

namespace {

constexpr std::size_t kFirstSlots = 64;

std::uint32_t hash(const void* bytes, std::size_t count) {
  return static_cast<std::uint32_t>(XXH3_64bits(bytes, count));
}

}  // namespace

NameKey::NameKey(std::string_view name) : name_(name) {
  const std::size_t n = name.size();
  char* const head = head_.data();
  if (n >= kHead) {
    hash_ = hash(name.data(), n);
    std::memcpy(head, &hash_, sizeof hash_);
    std::memcpy(head + sizeof hash_, name.data(), kHead - sizeof hash_ - 1);
    head_.back() = NameIndex::kLong;
    return;
  }
  // Two copies that may overlap: none depends on the length.
  if (n >= 8) {
    std::memcpy(head, name.data(), 8);
    std::memcpy(head + n - 4, name.data() + n - 4, 4);
  } else if (n >= 4) {
    std::memcpy(head, name.data(), 4);
    std::memcpy(head + n - 4, name.data() + n - 4, 4);
  } else {
    for (std::size_t i = 0; i < n; ++i) head[i] = name[i];
  }
  head_.back() = static_cast<char>(n);
  hash_ = hash(head, kHead);
}

NameIndex::NameIndex() : slots_(kFirstSlots), mask_(kFirstSlots - 1) {}

std::uint32_t NameIndex::hash_of(const Slot& slot) {
  if (slot.head.back() != kLong) return hash(slot.head.data(), slot.head.size());
  std::uint32_t kept = 0;
  std::memcpy(&kept, slot.head.data(), sizeof kept);
  return kept;
}

void NameIndex::grow(std::size_t slots) {
  const std::vector<Slot> old = std::exchange(slots_, std::vector<Slot>(slots));
  mask_ = slots - 1;
  for (const Slot& slot : old) {
    if (slot.number == kNothing) continue;
    std::size_t at = hash_of(slot) & mask_;
    while (slots_[at].number != kNothing) at = (at + 1) & mask_;
    slots_[at] = slot;
  }
}

void NameIndex::reserve(std::size_t count) {
  std::size_t slots = slots_.size();
  while (slots * 3 < count * 4) slots *= 2;
  if (slots != slots_.size()) grow(slots);
}

}  // namespace nms::compiler
