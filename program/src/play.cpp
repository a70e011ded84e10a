#include <nms/program/play.h>

#include <algorithm>
#include <cassert>
#include <cstring>
#include <limits>

#include <nms/program/several_processors.h>

#include "cubic.h"

namespace nms::program {

/// @param low  lowest value of each lane
/// @param out  a value for each lane
NMS_FOR_SEVERAL_PROCESSORS
void BoundClip::evaluate_blocks(const Block* __restrict blocks, const float* __restrict low, std::size_t count,
                                double time_ns, float* __restrict out) {
  for (std::size_t i = 0; i < count; ++i) {
    const Block& block = blocks[i];
    for (std::size_t l = 0; l < kLanes; ++l) {
      const float value =
          value_of(block.start[l], block.rate[l], block.a[l], block.b[l], block.c[l], block.d[l], time_ns);
      out[i * kLanes + l] = held(value, low[i * kLanes + l]);
    }
  }
}

void BoundClip::evaluate_row(const Block* row, double time_ns, float* values) const {
  constexpr std::size_t kMost = 16;  // blocks at a time
  float out[kMost * kLanes];
  for (std::size_t first = 0; first < places_.size(); first += kMost) {
    const std::size_t count = std::min(kMost, places_.size() - first);
    evaluate_blocks(row + first, low_.data() + first * kLanes, count, time_ns, out);
    for (std::size_t i = 0; i < count; ++i) {
      const Place& to = places_[first + i];
      if (to.is_run) {
        std::memcpy(values + to.channel[0], out + i * kLanes, kLanes * sizeof(float));
        continue;
      }
      for (std::size_t l = 0; l < to.count; ++l) {
        values[to.channel[l]] = out[i * kLanes + l];
      }
    }
  }
}

void BoundClip::apply(const Event& event, Block* row) {
  Block& block = row[event.lane / kLanes];
  const std::size_t l = event.lane % kLanes;
  block.start[l] = event.start;
  block.rate[l] = event.rate;
  block.a[l] = event.a;
  block.b[l] = event.b;
  block.c[l] = event.c;
  block.d[l] = event.d;
}

BoundClip::BoundClip(const Program& program, const Clip& clip)
    : channel_count_(program.channels.size()),
      places_((std::size_t{clip.curve_count} + kLanes - 1) / kLanes),
      low_(places_.size() * kLanes),
      row_events_(std::max(kLanes, std::size_t{clip.curve_count} / 3)) {
  std::vector<Block> row(places_.size());
  for (std::uint32_t i = 0; i < clip.curve_count; ++i) {
    const Curve& curve = program.curves[std::size_t{clip.first_curve} + i];
    low_[i] = lowest(program, curve);
    Place& place = places_[i / kLanes];
    place.channel[place.count] = static_cast<std::uint32_t>(curve.channel);
    ++place.count;
    place.is_run = place.count == kLanes && place.channel[kLanes - 1] - place.channel[0] == kLanes - 1;
    row[i / kLanes].d[i % kLanes] = cubic_before(program, curve).d;
  }
  list_events(program, clip);
  lay_rows(std::move(row));
}

void BoundClip::list_events(const Program& program, const Clip& clip) {
  for (std::uint32_t i = 0; i < clip.curve_count; ++i) {
    const Curve& curve = program.curves[std::size_t{clip.first_curve} + i];
    const std::size_t end = std::size_t{curve.first_knot} + curve.knot_count;
    for (std::size_t k = curve.first_knot; k < end; ++k) {
      const std::int64_t time_ns = program.knots[k].time_ns();
      if (k + 1 < end && program.knots[k + 1].time_ns() == time_ns) {
        continue;  // a jump: the second knot's segment holds
      }
      const Cubic cubic = cubic_from(program, curve, k);
      events_.push_back({time_ns, i, cubic.start, cubic.rate, cubic.a, cubic.b, cubic.c, cubic.d});
    }
  }
  std::sort(events_.begin(), events_.end(), [](const Event& a, const Event& b) {
    return a.time_ns != b.time_ns ? a.time_ns < b.time_ns : a.lane < b.lane;
  });
}

void BoundClip::lay_rows(std::vector<Block> row) {
  const std::size_t count = 1 + events_.size() / row_events_;
  row_ns_.reserve(count);
  rows_.reserve(count * row.size());
  row_ns_.push_back(std::numeric_limits<std::int64_t>::min());
  rows_.insert(rows_.end(), row.begin(), row.end());
  for (std::size_t e = 0; e < events_.size(); ++e) {
    apply(events_[e], row.data());
    if ((e + 1) % row_events_ == 0) {
      row_ns_.push_back(events_[e].time_ns);
      rows_.insert(rows_.end(), row.begin(), row.end());
    }
  }
}

std::size_t BoundClip::row_at(std::int64_t time_ns) const {
  // A binary search without branches: none can be guessed, and a wrong guess costs more than the search.
  std::size_t first = 0;
  for (std::size_t count = row_ns_.size(); count > 1;) {
    const std::size_t half = count / 2;
    first += row_ns_[first + half] <= time_ns ? half : 0;
    count -= half;
  }
  return first;
}

std::span<const BoundClip::Block> BoundClip::row(std::size_t index) const {
  return std::span(rows_).subspan(index * places_.size(), places_.size());
}

void BoundClip::evaluate(std::int64_t time_ns, std::span<float> values) const {
  assert(values.size() == channel_count_);
  const std::size_t at = row_at(time_ns);
  const auto time = static_cast<double>(time_ns);
  evaluate_row(row(at).data(), time, values.data());
  const std::size_t end = std::min(events_.size(), (at + 1) * row_events_);
  for (std::size_t e = at * row_events_; e < end && events_[e].time_ns <= time_ns; ++e) {
    const Event& event = events_[e];
    values[places_[event.lane / kLanes].channel[event.lane % kLanes]] =
        held(value_of(event.start, event.rate, event.a, event.b, event.c, event.d, time), low_[event.lane]);
  }
}

std::size_t BoundClip::memory_size() const {
  return sizeof(*this) + places_.capacity() * sizeof(Place) + low_.capacity() * sizeof(float) +
         events_.capacity() * sizeof(Event) + row_ns_.capacity() * sizeof(std::int64_t) +
         rows_.capacity() * sizeof(Block);
}

void Player::seek(std::int64_t time_ns) {
  const std::size_t at = clip_.row_at(time_ns);
  const auto row = clip_.row(at);
  row_.assign(row.begin(), row.end());
  next_event_ = at * clip_.row_events_;
  is_placed_ = true;
}

/// Whether to walk there is cheaper than to search: past about a row's events it is not.
bool Player::is_near(std::int64_t time_ns) const {
  const std::size_t far_event = next_event_ + clip_.row_events_;
  return far_event >= clip_.events_.size() || clip_.events_[far_event].time_ns > time_ns;
}

void Player::advance(std::int64_t time_ns, std::span<float> values) {
  const bool is_back = time_ns < time_ns_;
  time_ns_ = time_ns;
  if (is_back) {
    is_placed_ = false;  // who goes back once may go on doing so
    clip_.evaluate(time_ns, values);
    return;
  }
  assert(values.size() == clip_.channel_count_);
  if (!is_placed_ || !is_near(time_ns)) {
    seek(time_ns);
  }
  for (; next_event_ < clip_.events_.size() && clip_.events_[next_event_].time_ns <= time_ns; ++next_event_) {
    BoundClip::apply(clip_.events_[next_event_], row_.data());
  }
  clip_.evaluate_row(row_.data(), static_cast<double>(time_ns), values.data());
}

}  // namespace nms::program
