#include "pose_store.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>
#include <limits>

namespace nms::compiler {

void add_amount(Pose& pose, std::uint32_t channel, double value) {
  if (pose.empty() || pose.back().channel < channel) {
    pose.push_back({channel, value});
    return;
  }
  const auto it = std::lower_bound(pose.begin(), pose.end(), channel,
                                   [](const Amount& a, std::uint32_t c) { return a.channel < c; });
  if (it->channel == channel)
    it->value += value;
  else
    pose.insert(it, {channel, value});
}

namespace {

// There are at most 999 units, each with two sides, and the axes made of them.
using Channel = std::uint16_t;
using Percent = std::int16_t;
constexpr Percent kNoPercent = std::numeric_limits<Percent>::min();

/// The whole percentage that a value is, to the last bit.
Percent percent_of(double value) {
  if (!(value > -100.0 && value < 100.0)) return kNoPercent;
  const auto percent = static_cast<Percent>(value * 100.0 + (value < 0.0 ? -0.5 : 0.5));
  return static_cast<double>(percent) / 100.0 == value && (percent != 0 || !std::signbit(value)) ? percent : kNoPercent;
}

/// Reads and writes what lies side by side.
template <typename Value>
Value get(const std::byte*& at) {
  Value value;
  std::memcpy(&value, at, sizeof value);
  at += sizeof value;
  return value;
}
template <typename Value>
void put(std::byte*& at, Value value) {
  std::memcpy(at, &value, sizeof value);
  at += sizeof value;
}

}  // namespace

// A pose lies there as the number of its amounts, then each as its channel and its percentage, or kNoPercent and value.
std::uint32_t PoseStore::keep(const Pose& pose) {
  const std::size_t most = sizeof(Channel) + pose.size() * (sizeof(Channel) + sizeof(Percent) + sizeof(double));
  assert(most <= kBlockBytes);
  if (used_ + most > kBlockBytes) {
    blocks_.push_back(std::make_unique_for_overwrite<std::byte[]>(kBlockBytes));
    used_ = 0;
  }
  const auto number = static_cast<std::uint32_t>(((blocks_.size() - 1) * kBlockBytes + used_) / kAlign);
  std::byte* const begin = blocks_.back().get() + used_;
  std::byte* at = begin;
  put(at, static_cast<Channel>(pose.size()));
  for (const Amount& a : pose) {
    const Percent percent = percent_of(a.value);
    put(at, static_cast<Channel>(a.channel));
    put(at, percent);
    if (percent == kNoPercent) put(at, a.value);
  }
  used_ += (static_cast<std::size_t>(at - begin) + kAlign - 1) / kAlign * kAlign;
  return number;
}

void PoseStore::add_to(Pose& into, std::uint32_t number, double factor) const {
  const std::size_t place = std::size_t{number} * kAlign;
  const std::byte* at = blocks_[place / kBlockBytes].get() + place % kBlockBytes;
  const auto count = get<Channel>(at);
  into.reserve(into.size() + count);
  for (Channel i = 0; i < count; ++i) {
    const auto channel = get<Channel>(at);
    const auto percent = get<Percent>(at);
    const double value = percent == kNoPercent ? get<double>(at) : static_cast<double>(percent) / 100.0;
    add_amount(into, channel, value * factor);
  }
}

}  // namespace nms::compiler
