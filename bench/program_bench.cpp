#include <cstdint>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <nms/program/evaluate.h>
#include <nms/program/play.h>
#include <nms/program/text.h>

/// What one signer's frame costs: 80 channels, 10 s, 20 segments a channel, half of them smooth and half cubic.
namespace {

using namespace nms::program;

constexpr std::uint32_t kChannels = 80;
constexpr std::uint32_t kSegments = 20;
constexpr std::int64_t kLength_ns = 10'000'000'000;

Draft make_draft() {
  std::mt19937 random(1);
  Draft draft;
  for (std::uint32_t c = 0; c < kChannels; ++c) {
    draft.strings.push_back(fmt::format("AU{}", c + 1));
    Channel channel;
    channel.name = StringId{c + 1};
    draft.channels.push_back(channel);
    const auto first_handle = static_cast<std::uint32_t>(draft.handles.size());
    draft.curves.push_back({ChannelId{c}, static_cast<std::uint32_t>(draft.knots.size()), kSegments + 1, first_handle});
    for (std::uint32_t k = 0; k <= kSegments; ++k) {
      const std::int64_t jitter_ns = k > 0 && k < kSegments ? random() % 400'000'000 : 0;
      Knot knot{kLength_ns / kSegments * k + jitter_ns, static_cast<float>(random() % 1024) / 1023.0F, kShapeSmooth};
      if (k % 2 == 0) {  // of its own: no two curves share a table
        knot.shape = static_cast<std::uint16_t>(draft.handles.size() - first_handle);
        draft.handles.push_back({0.3F, static_cast<float>(random() % 1024) / 1023.0F});
      }
      draft.knots.push_back(knot);
    }
  }
  Clip clip;
  clip.end_ns = kLength_ns;
  clip.curve_count = kChannels;
  draft.clips.push_back(clip);
  return draft;
}

const Image& image() {
  static const Image kImage = Image::from(make_draft()).value();
  return kImage;
}

void count_channels(benchmark::State& state) {
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kChannels));
}

/// Times all over the clip, drawn beforehand.
std::vector<std::int64_t> random_times() {
  std::mt19937 random(2);
  std::vector<std::int64_t> times_ns(1U << 14U);
  for (std::int64_t& time_ns : times_ns) {
    time_ns = kLength_ns / 1'000'000 * static_cast<std::int64_t>(random() % 1'000'000) + random() % 10'000;
  }
  return times_ns;
}

/// From nothing but the program: a search for each channel.
void evaluate_unbound(benchmark::State& state) {
  const Program& program = image().program();
  const std::vector<std::int64_t> times_ns = random_times();
  std::vector<float> values(kChannels);
  std::size_t i = 0;
  for (auto _ : state) {
    evaluate(program, program.clips[0], times_ns[i++ % times_ns.size()], values);
    benchmark::DoNotOptimize(values.data());
    benchmark::ClobberMemory();
  }
  count_channels(state);
}
BENCHMARK(evaluate_unbound);

void evaluate_anywhere(benchmark::State& state) {
  const BoundClip clip(image().program(), image().program().clips[0]);
  const std::vector<std::int64_t> times_ns = random_times();
  std::vector<float> values(kChannels);
  std::size_t i = 0;
  for (auto _ : state) {
    clip.evaluate(times_ns[i++ % times_ns.size()], values);
    benchmark::DoNotOptimize(values.data());
    benchmark::ClobberMemory();
  }
  count_channels(state);
}
BENCHMARK(evaluate_anywhere);

/// Frames at so many a second, negative: backwards; from the beginning again when it is over.
void play(benchmark::State& state) {
  const std::int64_t frame_ns = 1'000'000'000 / state.range(0);
  Player player(image().program(), image().program().clips[0]);
  std::vector<float> values(kChannels);
  std::int64_t time_ns = 0;
  for (auto _ : state) {
    player.advance(time_ns, values);
    benchmark::DoNotOptimize(values.data());
    benchmark::ClobberMemory();
    time_ns += frame_ns;
    time_ns = time_ns > kLength_ns ? 0 : time_ns < 0 ? kLength_ns : time_ns;
  }
  count_channels(state);
}
BENCHMARK(play)->Arg(60)->Arg(25)->Arg(-60);

/// Once for each clip that is played.
void bind_clip(benchmark::State& state) {
  const Program& program = image().program();
  for (auto _ : state) {
    benchmark::DoNotOptimize(BoundClip(program, program.clips[0]));
  }
  state.counters["memory"] = static_cast<double>(BoundClip(program, program.clips[0]).memory_size());
}
BENCHMARK(bind_clip);

void fade(benchmark::State& state) {
  const std::vector<float> from(kChannels, 0.25F);
  const std::vector<float> to(kChannels, 0.75F);
  std::vector<float> out(kChannels);
  float u = 0.0F;
  for (auto _ : state) {
    cross_fade(from, to, u, out);
    benchmark::DoNotOptimize(out.data());
    benchmark::ClobberMemory();
    u = u < 1.0F ? u + 0.001F : 0.0F;
  }
  count_channels(state);
}
BENCHMARK(fade);

void encode_draft(benchmark::State& state) {
  const Draft draft = make_draft();
  for (auto _ : state) {
    benchmark::DoNotOptimize(encode(draft));
  }
  const auto names = sizeof(std::uint32_t) * (draft.strings.size() + 1) +
                     std::accumulate(draft.strings.begin(), draft.strings.end(), std::size_t{0},
                                     [](std::size_t sum, const std::string& name) { return sum + name.size(); });
  state.counters["bytes"] = static_cast<double>(encode(draft).size());
  state.counters["without_names"] = static_cast<double>(encode(draft).size() - names);
}
BENCHMARK(encode_draft);

/// Opening a mapped file: there is nothing to parse, only to check.
void check_image(benchmark::State& state) {
  const auto bytes = image().bytes();
  for (auto _ : state) {
    benchmark::DoNotOptimize(check(bytes, "bench"));
  }
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(bytes.size()));
}
BENCHMARK(check_image);

void write_text(benchmark::State& state) {
  for (auto _ : state) {
    benchmark::DoNotOptimize(to_text(image().program()));
  }
  state.counters["bytes"] = static_cast<double>(to_text(image().program()).size());
}
BENCHMARK(write_text);

void read_text(benchmark::State& state) {
  const std::string text = to_text(image().program());
  for (auto _ : state) {
    benchmark::DoNotOptimize(from_text(text, "bench"));
  }
}
BENCHMARK(read_text);

}  // namespace
