#include <algorithm>
#include <cstddef>

#include <nms/program/program.h>

namespace nms::program {

void order_plays(Draft& draft) {
  draft.plays.clear();
  draft.plays.reserve(draft.knots.size());
  for (Clip& clip : draft.clips) {
    clip.first_play = static_cast<std::uint32_t>(draft.plays.size());
    const std::size_t curves_end =
        std::min<std::size_t>(draft.curves.size(), std::size_t{clip.first_curve} + clip.curve_count);
    for (std::size_t c = clip.first_curve; c < curves_end; ++c) {
      const Curve& curve = draft.curves[c];
      const std::size_t knots_end =
          std::min<std::size_t>(draft.knots.size(), std::size_t{curve.first_knot} + curve.knot_count);
      for (std::size_t k = curve.first_knot; k < knots_end; ++k) {
        draft.plays.push_back(static_cast<std::uint32_t>(k));
      }
    }
    clip.play_count = static_cast<std::uint32_t>(draft.plays.size()) - clip.first_play;
    // A clip's curves are ordered by channel and its knots by curve, so among equal times the order by knot is the
    // order by channel, and the second knot of a jump comes second.
    std::sort(draft.plays.begin() + clip.first_play, draft.plays.end(), [&](std::uint32_t a, std::uint32_t b) {
      const std::int64_t time_a = draft.knots[a].time_ns;
      const std::int64_t time_b = draft.knots[b].time_ns;
      return time_a != time_b ? time_a < time_b : a < b;
    });
  }
}

}  // namespace nms::program
