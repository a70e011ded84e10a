#include "animation_keys.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <map>

#include <nms/runtime/trigonometry.h>

namespace nms::runtime {
namespace {

constexpr std::int64_t kShortest_ns = 1'000'000;  // no key interval is halved below this; also the ramp of a jump

struct Sample {
  std::int64_t time_ns = 0;
  std::vector<float> values;
};

double quaternion_dot(std::span<const float> a, std::span<const float> b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < 4; ++i) sum += static_cast<double>(a[i]) * static_cast<double>(b[i]);
  return sum;
}

// Angle of the rotation from a to b, from the chord: exact to second order, and without the arc cosine's loss near 1.
double angle_between(std::span<const float> a, const double (&b)[4]) {
  double sum = 0.0;
  for (std::size_t i = 0; i < 4; ++i) {
    const double d = static_cast<double>(a[i]) - b[i];
    sum += d * d;
  }
  return 2.0 * std::sqrt(sum);
}

// How far interpolation from `from` to `to` misses `truth`, as a share of the tolerance.
double miss(const Sample& from, const Sample& to, const Sample& truth, Interpolation interpolation,
            std::span<const double> tolerance) {
  const double u = static_cast<double>(truth.time_ns - from.time_ns) / static_cast<double>(to.time_ns - from.time_ns);
  if (interpolation == Interpolation::slerp) {
    const double cos_angle = std::clamp(quaternion_dot(from.values, to.values), -1.0, 1.0);
    double wa = 1.0 - u;
    double wb = u;
    if (cos_angle < 0.999999) {
      const double angle = arc_cosine(cos_angle);
      const double s = sine(angle);
      wa = sine((1.0 - u) * angle) / s;
      wb = sine(u * angle) / s;
    }
    double q[4];
    for (std::size_t i = 0; i < 4; ++i) {
      q[i] = wa * static_cast<double>(from.values[i]) + wb * static_cast<double>(to.values[i]);
    }
    return angle_between(truth.values, q) / tolerance[0];
  }
  double worst = 0.0;
  for (std::size_t i = 0; i < truth.values.size(); ++i) {
    const double a = static_cast<double>(from.values[i]);
    const double b = static_cast<double>(to.values[i]);
    worst = std::max(worst, std::abs(a + u * (b - a) - static_cast<double>(truth.values[i])) / tolerance[i]);
  }
  return worst;
}

}  // namespace

std::vector<std::int64_t> break_times(const program::Program& program, const program::Clip& clip) {
  std::vector<std::int64_t> times{clip.start_ns, clip.end_ns};
  const auto add = [&](std::int64_t t) {
    if (t > clip.start_ns && t < clip.end_ns) times.push_back(t);
  };
  for (std::uint32_t c = 0; c < clip.curve_count; ++c) {
    const program::Curve& curve = program.curves[clip.first_curve + c];
    for (std::uint32_t k = 0; k < curve.knot_count; ++k) {
      const program::Knot& knot = program.knots[curve.first_knot + k];
      add(knot.time_ns());
      if (k == 0) continue;
      const program::Knot& before = program.knots[curve.first_knot + k - 1];
      const bool jumps = before.time_ns() == knot.time_ns() || before.shape == program::kShapeHold;
      if (jumps && before.value != knot.value) {
        const std::int64_t t = knot.time_ns() - kShortest_ns;
        if (t < clip.end_ns) add(t);
      }
    }
  }
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return times;
}

Keys fit_keys(std::span<const std::int64_t> breaks, Interpolation interpolation, std::span<const double> tolerance,
              const std::function<void(std::int64_t, std::span<float>)>& signal, std::size_t looks) {
  const std::size_t width = interpolation == Interpolation::slerp ? 4 : tolerance.size();
  // What an interval is looked at, its halves ask for again.
  std::map<std::int64_t, std::vector<float>> known;
  const auto sample = [&](std::int64_t t) {
    const auto [at, fresh] = known.try_emplace(t, width);
    if (fresh) signal(t, at->second);
    return Sample{t, at->second};
  };

  // Halving. Half of the tolerance goes here, the other half to the dropping below.
  constexpr double kHalf = 0.5;
  static constexpr std::array<std::int64_t, 5> kEighths{4, 2, 6, 1, 7};
  assert(looks <= kEighths.size());
  std::vector<Sample> samples{sample(breaks[0])};
  for (std::size_t i = 1; i < breaks.size(); ++i) {
    std::vector<Sample> ahead{sample(breaks[i])};  // ends of the intervals still to do, the nearest last
    while (!ahead.empty()) {
      const Sample& from = samples.back();
      const Sample& to = ahead.back();
      const std::int64_t length = to.time_ns - from.time_ns;
      bool fits = true;
      if (length > kShortest_ns) {
        for (const std::int64_t eighths : std::span(kEighths).first(looks)) {
          if (miss(from, to, sample(from.time_ns + length * eighths / 8), interpolation, tolerance) > kHalf) {
            fits = false;
            break;
          }
        }
      }
      if (fits) {
        samples.push_back(std::move(ahead.back()));
        ahead.pop_back();
        known.erase(known.begin(), known.lower_bound(samples.back().time_ns));
      } else {
        ahead.push_back(sample(from.time_ns + length / 2));
      }
    }
  }

  // Dropping: from each kept key, reach as far as all keys passed over stay within the other half.
  Keys keys;
  const std::int64_t start = breaks[0];
  const auto keep = [&](const Sample& s) {
    const float t = static_cast<float>(static_cast<double>(s.time_ns - start) * 1e-9);
    if (!keys.times.empty() && t <= keys.times.back()) return;  // two moments that single precision cannot tell apart
    keys.times.push_back(t);
    keys.values.insert(keys.values.end(), s.values.begin(), s.values.end());
  };
  std::size_t i = 0;
  keep(samples[0]);
  while (i + 1 < samples.size()) {
    std::size_t reach = i + 1;
    while (reach + 1 < samples.size()) {
      bool fits = true;
      for (std::size_t j = i + 1; j <= reach && fits; ++j) {
        fits = miss(samples[i], samples[reach + 1], samples[j], interpolation, tolerance) <= kHalf;
      }
      if (!fits) break;
      ++reach;
    }
    i = reach;
    keep(samples[i]);
  }
  return keys;
}

}  // namespace nms::runtime
