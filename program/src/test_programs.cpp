#include "test_programs.h"

#include <cstring>
#include <string>

#include <fmt/format.h>

#include <nms/program/evaluate.h>
#include <nms/program/play.h>
#include <nms/program/text.h>

#include "container.h"

namespace nms::program {

const std::string_view kSmallProgram = R"(nms program 1

tracks
  brows strongest
  mouth latest
  head sum

channels
  AU4 action_unit title "Brow Lowerer" au 4 track brows
  AU12L action_unit title "Lip Corner Puller" au 12 side left track mouth
  AU12R action_unit title "Lip Corner Puller" au 12 side right track mouth
  AU26 action_unit title "Jaw Drop" au 26
  head_yaw axis positive AU51 negative AU52 au 51 motion rotate_y frame head full_scale 1.3089969 track head

clip smile expression 0s..2.34s hash 0123456789abcdef
  curve AU12L
    0s 0 smooth  ; greeting.nms:12:3 smile
    0.234s 0.6 smooth  ; greeting.nms:13:3 smile
    2.106s 0.8 linear  ; greeting.nms:14:3 smile
    2.34s 0.4 hold
  curve AU12R
    0s 0 linear
    0.234s 0.6 linear
    2.106s 0.8 smooth
    2.34s 0.4 hold

clip "say \"no\"" timeline -0.233333333s..3s hash fedcba9876543210
  marker -0.233333333s onset neg
  marker 0s sign_start "NOT-YET{neg}"
  marker 0s mark ""
  marker 1.2s stroke_end "NOT-YET{neg}"
  marker 1.5s sign_end "NOT-YET{neg}"
  marker 1.5s apex neg
  marker 2s offset neg
  marker 3s release neg
  curve AU4
    -0.233333333s 0 cubic(-0.5, 1.5)  ; "a b.nms":1:1
    0s 0.62 hold
    1s 0.62 hold
    1s 0.25 linear
    3s 0 smooth
  curve head_yaw
    0s 0 cubic(0.1, -0.9)  ; greeting.nms:20:5 "n\x0ai"
    0.000000001s -1 smooth
    3s 1 hold

clip nothing pose 0s..0s hash 0000000000000000

face ada surface ada.x3d

landmarks
  mouth_corner_L 0.025 -0.03 0.08
  chin 0 -0.06 0.07

muscle zygomatic_major_L linear
  side left
  falloff thesis
  attachment zygomatic_L
  attachment_offset 0.001 0 -0.002
  insertion mouth_corner_L
  region cheek_L
  except teeth
  angle 0.6981317
  insertion_radius 0.045
  dissipation_radius 0.06
  limit 0.25

muscle frontalis sheet
  attachment brow
  insertion brow
  insertion_offset 0 0.01 0
  insertion_radius 0.02
  dissipation_radius 0.03
  perpendicular_radius 0.04

muscle orbicularis sphincter
  attachment mouth
  insertion mouth_corner_L
  major_radius 0.03
  minor_radius 0.02
  limit 0.4
  amount -0.002

muscle lid_upper_L eyelid
  side left
  attachment eye_L
  insertion lid_upper_L
  angle -0.5
  closes 0.9

muscle jaw hinge
  frame jaw
  attachment jaw_hinge
  angle 0.3
  limit 1
  slide 0 -0.001 0.004

muscle puff bulge
  attachment cheek_L
  major_radius 0.02
  minor_radius 0.02
  limit 1
  amount 0.008

actuations
  AU12L zygomatic_major_L 1
  AU12L puff -0.1
  AU26 jaw 1.2

inputs
  greeting.nms path greeting.nms hash 00000000000000ff
  "fac s" from greeting.nms path "stdlib/fac s.nms" hash fedcba9876543210
)";

Draft small_draft() { return from_text(kSmallProgram, "small").value(); }

Draft random_draft(std::mt19937& random) {
  const auto below = [&](std::uint32_t bound) { return static_cast<std::uint32_t>(random() % bound); };
  const auto between = [&](float low, float high) {
    return low + (high - low) * static_cast<float>(random() >> 8U) / 16777216.0F;
  };
  Draft draft;
  const std::uint32_t channel_count = 1 + below(12);
  for (std::uint32_t i = 0; i < channel_count; ++i) {
    Channel channel;
    draft.strings.push_back(fmt::format("c{}", i));
    channel.name = StringId{static_cast<std::uint32_t>(draft.strings.size() - 1)};
    if (below(3) == 0) {
      channel.kind = ChannelKind::axis;
      channel.positive = channel.negative = channel.name;
    }
    draft.channels.push_back(channel);
  }
  const std::uint32_t clip_count = below(4);
  for (std::uint32_t i = 0; i < clip_count; ++i) {
    Clip clip;
    clip.kind = static_cast<ClipKind>(below(6));
    clip.start_ns = -static_cast<std::int64_t>(below(1000));
    clip.end_ns = below(1'000'000'000);
    clip.first_curve = static_cast<std::uint32_t>(draft.curves.size());
    clip.first_marker = static_cast<std::uint32_t>(draft.markers.size());
    for (std::uint32_t c = 0; c < channel_count; ++c) {
      if (below(4) == 0) {
        continue;
      }
      const bool is_axis = draft.channels[c].kind == ChannelKind::axis;
      Curve curve{ChannelId{c}, static_cast<std::uint32_t>(draft.knots.size()), 1 + below(30),
                  static_cast<std::uint32_t>(draft.handles.size())};
      // Few distinct times, so that curves share them and jumps happen.
      std::int64_t time_ns = -static_cast<std::int64_t>(below(100)) * 10'000'000;
      bool is_jump = true;
      for (std::uint32_t k = 0; k < curve.knot_count; ++k) {
        const std::uint32_t step = is_jump ? 1 + below(5) : below(5);
        is_jump = step == 0;
        time_ns += static_cast<std::int64_t>(step) * 10'000'000;
        const float value = between(is_axis ? -1.0F : 0.0F, 1.0F);
        Knot knot{time_ns, value, static_cast<std::uint16_t>(kShapeSmooth - below(3))};
        if (below(3) == 0) {
          knot.shape = static_cast<std::uint16_t>(draft.handles.size() - curve.first_handle);
          draft.handles.push_back(is_axis ? Handles{between(-3, 3), between(-3, 3)}
                                          : Handles{between(-1, 2), between(-1, 2)});
        }
        draft.knots.push_back(knot);
      }
      draft.curves.push_back(curve);
      ++clip.curve_count;
    }
    draft.clips.push_back(clip);
  }
  return draft;
}

void reseal(std::span<std::byte> bytes) {
  if (bytes.size() < sizeof(Header)) {
    return;
  }
  const std::uint64_t sum = checksum(bytes);
  std::memcpy(bytes.data() + offsetof(Header, checksum), &sum, sizeof(sum));
}

std::size_t exercise(const Program& program) {
  std::vector<float> values(program.channels.size());
  std::size_t high = 0;
  for (const Clip& clip : program.clips) {
    Player player(program, clip);
    const BoundClip bound(program, clip);
    const std::int64_t middle_ns = clip.start_ns + (clip.end_ns - clip.start_ns) / 2;
    for (const std::int64_t time_ns :
         {clip.start_ns, middle_ns, middle_ns + 1, clip.end_ns, std::int64_t{0}, INT64_MIN, INT64_MAX}) {
      evaluate(program, clip, time_ns, values);
      player.advance(time_ns, values);
      bound.evaluate(time_ns, values);
      for (const float value : values) {
        high += value > 0.5F ? 1U : 0U;
      }
    }
  }
  return high + to_text(program).size() + to_text(program, {.rig = false, .channels = false}).size();
}

}  // namespace nms::program
