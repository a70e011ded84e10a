#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <vector>

namespace nms::compiler {

/// A name as NameIndex looks for it: who looks several times makes it once. The name outlives it.
class NameKey {
 public:
  explicit NameKey(std::string_view name = {});

  [[nodiscard]] std::string_view name() const { return name_; }

 private:
  friend class NameIndex;
  static constexpr std::size_t kHead = 12;
  std::string_view name_;
  std::uint32_t hash_ = 0;
  /// A short name with its length behind it; of a long one its hash and its first bytes.
  std::array<char, kHead> head_{};
};

/// Finds numbers by names, each name once: an open-addressed table of sixteen bytes a slot. A name of up to eleven
/// bytes lies in its slot, so that finding it touches one line of memory; of a longer one the slot holds hash and
/// beginning, and who asks compares the rest. Nothing depends on the order of the slots.
class NameIndex {
 public:
  NameIndex();

  /// Room for that many without another allocation.
  void reserve(std::size_t count);
  /// The number of a name, or kNothing. `is_it(number)` says whether a number has that name.
  template <typename IsIt>
  [[nodiscard]] std::uint32_t find(const NameKey& key, IsIt is_it) const {
    const Slot& slot = slots_[place_of(key, is_it)];
    return slot.number;
  }
  template <typename IsIt>
  [[nodiscard]] std::uint32_t find(std::string_view name, IsIt is_it) const {
    return count_ == 0 ? kNothing : find(NameKey(name), is_it);
  }
  /// The number that the name has already, or kNothing: then it has `number` from now on.
  template <typename IsIt>
  std::uint32_t insert(const NameKey& key, std::uint32_t number, IsIt is_it) {
    // At most three quarters full, so that a search ends soon.
    if ((count_ + 1) * 4 > slots_.size() * 3) grow(slots_.size() * 2);
    Slot& slot = slots_[place_of(key, is_it)];
    if (slot.number != kNothing) return slot.number;
    slot = {number, key.head_};
    ++count_;
    return kNothing;
  }
  /// @pre `name` is not in it
  void insert(std::string_view name, std::uint32_t number) {
    insert(NameKey(name), number, [](std::uint32_t) { return false; });
  }
  /// Asks memory for the slot of a name that will soon be looked for; changes nothing.
  void prefetch(const NameKey& key) const { __builtin_prefetch(&slots_[key.hash_ & mask_]); }

  static constexpr std::uint32_t kNothing = 0xFFFFFFFFU;

 private:
  friend class NameKey;
  /// What stands behind a name that has no room in a slot, where others have their length.
  static constexpr char kLong = '\x7F';
  struct Slot {
    std::uint32_t number = kNothing;
    std::array<char, NameKey::kHead> head{};
  };
  static_assert(sizeof(Slot) == 16);

  /// Where the name is, or where it would be.
  template <typename IsIt>
  [[nodiscard]] std::size_t place_of(const NameKey& key, IsIt is_it) const {
    for (std::size_t at = key.hash_ & mask_;; at = (at + 1) & mask_) {
      const Slot& slot = slots_[at];
      if (slot.number == kNothing) return at;
      if (same(slot.head, key.head_) && (key.head_.back() != kLong || is_it(slot.number))) return at;
    }
  }
  [[nodiscard]] static bool same(const std::array<char, NameKey::kHead>& a, const std::array<char, NameKey::kHead>& b) {
    return std::memcmp(a.data(), b.data(), NameKey::kHead) == 0;
  }
  [[nodiscard]] static std::uint32_t hash_of(const Slot& slot);
  void grow(std::size_t slots);

  std::vector<Slot> slots_;
  std::size_t mask_ = 0;
  std::size_t count_ = 0;
};

}  // namespace nms::compiler
