#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <vector>

namespace nms::compiler {

/// Finds numbers by names, each name once: an open-addressed table of sixteen bytes a slot. A name of up to eleven
/// bytes lies in its slot, so that finding it touches one line of memory; of a longer one the slot holds hash and
/// beginning, and who asks compares the rest. Nothing depends on the order of the slots.
class NameIndex {
 public:
  NameIndex();

  /// Room for that many without another allocation.
  void reserve(std::size_t count);
  /// The number of `name`, or kNothing. `is_it(number)` says whether a number has that name.
  template <typename IsIt>
  [[nodiscard]] std::uint32_t find(std::string_view name, IsIt is_it) const {
    const std::uint32_t hash = hash_of(name);
    const Slot wanted = slot_of(name, hash, 0);
    for (std::size_t at = hash & mask_;; at = (at + 1) & mask_) {
      const Slot& slot = slots_[at];
      if (slot.number == kNothing) return kNothing;
      if (same_name(slot, wanted) && (slot.length != kLong || is_it(slot.number))) return slot.number;
    }
  }
  /// Asks memory for the slot of a name that will soon be looked for; changes nothing.
  void prefetch(std::string_view name) const { __builtin_prefetch(&slots_[hash_of(name) & mask_]); }
  /// @pre `name` is not in it
  void insert(std::string_view name, std::uint32_t number);

  static constexpr std::uint32_t kNothing = 0xFFFFFFFFU;

 private:
  static constexpr std::size_t kHead = 11;
  static constexpr std::uint8_t kLong = 255;
  struct Slot {
    std::uint32_t number = kNothing;
    std::uint8_t length = 0;         ///< of the name, or kLong
    std::array<char, kHead> head{};  ///< the name; of a long one its hash and its first bytes
  };
  static_assert(sizeof(Slot) == 16);

  [[nodiscard]] static bool same_name(const Slot& a, const Slot& b) {
    // Length and head, in twelve bytes: two comparisons.
    std::uint32_t begin[2];
    std::uint64_t rest[2];
    std::memcpy(&begin[0], &a.length, sizeof begin[0]);
    std::memcpy(&begin[1], &b.length, sizeof begin[1]);
    std::memcpy(&rest[0], a.head.data() + 3, sizeof rest[0]);
    std::memcpy(&rest[1], b.head.data() + 3, sizeof rest[1]);
    return begin[0] == begin[1] && rest[0] == rest[1];
  }
  [[nodiscard]] static std::uint32_t hash_of(std::string_view name);
  [[nodiscard]] static std::uint32_t hash_of(const Slot& slot);
  [[nodiscard]] static Slot slot_of(std::string_view name, std::uint32_t hash, std::uint32_t number) {
    Slot slot;
    slot.number = number;
    if (name.size() <= kHead) {
      slot.length = static_cast<std::uint8_t>(name.size());
      for (std::size_t i = 0; i < name.size(); ++i) slot.head[i] = name[i];
    } else {
      slot.length = kLong;
      std::memcpy(slot.head.data(), &hash, sizeof hash);
      std::memcpy(slot.head.data() + sizeof hash, name.data(), kHead - sizeof hash);
    }
    return slot;
  }
  void place(const Slot& slot, std::uint32_t hash);
  void grow(std::size_t slots);

  std::vector<Slot> slots_;
  std::size_t mask_ = 0;
  std::size_t count_ = 0;
};

}  // namespace nms::compiler
