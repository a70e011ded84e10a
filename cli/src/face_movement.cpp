#include "face_movement.h"

#include <algorithm>
#include <cmath>

#include <nms/program/play.h>
#include <nms/runtime/face_file.h>

namespace nms::cli {
namespace {

constexpr std::int64_t kStep_ns = 40'000'000;
/// Every clip is first compared at so many vertices: those that units move most, and some of all others.
constexpr std::size_t kProbesOfAll = 256;

double distance(const glm::vec3& a, const glm::vec3& b) {
  const glm::dvec3 d = glm::dvec3(a) - glm::dvec3(b);
  return std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z);
}

/// One channel at one end of its scale.
struct End {
  std::uint32_t channel = 0;
  float value = 1.0F;
  program::StringId name{};
};

std::vector<End> ends_of(const program::Program& program, const runtime::Rig& rig) {
  std::vector<End> ends;
  for (std::uint32_t c = 0; c < program.channels.size(); ++c) {
    if (!rig.actuated(program::ChannelId{c})) continue;
    const program::Channel& channel = program.channels[c];
    if (channel.kind == program::ChannelKind::axis) {
      ends.push_back({c, 1.0F, channel.positive});
      ends.push_back({c, -1.0F, channel.negative});
    } else {
      ends.push_back({c, 1.0F, channel.name});
    }
  }
  return ends;
}

/// Values of a clip over time, by channel.
class Frames {
 public:
  Frames(const program::Program& program, const program::Clip& clip) : channels_(program.channels.size()) {
    program::Player player(program, clip);
    for (std::int64_t t = clip.start_ns;; t += kStep_ns) {
      const std::int64_t at = std::min(t, clip.end_ns);
      values_.resize(values_.size() + channels_);
      player.advance(at, std::span(values_).last(channels_));
      if (at == clip.end_ns) break;
    }
  }
  [[nodiscard]] std::size_t count() const { return values_.size() / channels_; }
  /// The last one holds.
  [[nodiscard]] std::span<const float> at(std::size_t i) const {
    return std::span(values_).subspan(std::min(i, count() - 1) * channels_, channels_);
  }

 private:
  std::size_t channels_;
  std::vector<float> values_;
};

}  // namespace

FaceVertices::FaceVertices(const runtime::Face& face, const runtime::Rig& rig)
    : face_(face),
      rig_(rig),
      pose_(runtime::make_pose(face, rig)),
      normals_(face.skin.surface.rows),
      size_(face.skin.surface.rows) {
  for (const runtime::RigidMesh& part : face.rigid) size_ += part.positions.size();
}

void FaceVertices::at(std::span<const float> values, std::span<glm::vec3> out) {
  runtime::pose_face(face_, rig_, values, pose_);
  const std::size_t skin = face_.skin.surface.rows;
  runtime::place_skin(rig_, pose_, out.first(skin), normals_);
  std::size_t next = skin;
  for (std::size_t i = 0; i < face_.rigid.size(); ++i) {
    const runtime::RigidMesh& part = face_.rigid[i];
    const runtime::Placement& placement = pose_.placements[static_cast<std::size_t>(part.frame)];
    for (const glm::vec3& p : pose_.parts[i].empty() ? part.positions : pose_.parts[i])
      out[next++] = glm::vec3(placement.rotation * glm::dvec3(p) + placement.translation);
  }
}

std::vector<ChannelMovement> channel_movements(const program::Program& program, const runtime::Rig& rig,
                                               FaceVertices& vertices, const runtime::Landmarks& landmarks,
                                               const std::map<std::string, std::string>& titles) {
  std::vector<float> values(program.channels.size(), 0.0F);
  std::vector<glm::vec3> rest(vertices.size());
  std::vector<glm::vec3> moved(vertices.size());
  vertices.at(values, rest);
  std::vector<ChannelMovement> result;
  for (const End& end : ends_of(program, rig)) {
    values[end.channel] = end.value;
    vertices.at(values, moved);
    values[end.channel] = 0.0F;
    ChannelMovement m;
    m.unit = program.string(end.name);
    const auto title = titles.find(m.unit);
    m.title = program.channels[end.channel].kind == program::ChannelKind::axis && title != titles.end()
                  ? title->second
                  : std::string(program.string(program.channels[end.channel].title));
    std::size_t at = 0;
    for (std::size_t v = 0; v < rest.size(); ++v) {
      const double d = distance(rest[v], moved[v]);
      if (d <= m.largest_m) continue;
      m.largest_m = d;
      at = v;
    }
    if (m.largest_m > 0.0) {
      m.direction = (glm::dvec3(moved[at]) - glm::dvec3(rest[at])) / m.largest_m;
      m.place = runtime::nearest_landmark(landmarks, rest[at]);
      std::size_t many = 0;
      for (std::size_t v = 0; v < rest.size(); ++v) many += distance(rest[v], moved[v]) > 0.2 * m.largest_m ? 1U : 0U;
      m.share = static_cast<double>(many) / static_cast<double>(rest.size());
    }
    result.push_back(std::move(m));
  }
  return result;
}

std::vector<Lookalikes> lookalikes(const program::Program& program, std::span<const program::Clip* const> clips,
                                   FaceVertices& vertices, double threshold_m) {
  std::vector<glm::vec3> one(vertices.size());
  std::vector<glm::vec3> other(vertices.size());
  std::vector<std::uint32_t> probes;
  const std::size_t stride = std::max<std::size_t>(vertices.size() / kProbesOfAll, 1);
  for (std::size_t v = 0; v < vertices.size(); v += stride) probes.push_back(static_cast<std::uint32_t>(v));
  // Where a unit moves the face most, two clips differ first.
  std::vector<float> values(program.channels.size(), 0.0F);
  vertices.at(values, one);
  for (std::size_t c = 0; c < values.size(); ++c) {
    values[c] = 1.0F;
    vertices.at(values, other);
    values[c] = 0.0F;
    std::size_t best = 0;
    for (std::size_t v = 1; v < one.size(); ++v)
      if (distance(one[v], other[v]) > distance(one[best], other[best])) best = v;
    probes.push_back(static_cast<std::uint32_t>(best));
  }
  std::sort(probes.begin(), probes.end());
  probes.erase(std::unique(probes.begin(), probes.end()), probes.end());

  std::vector<Frames> frames;
  std::vector<std::vector<glm::vec3>> seen;  // by clip: probes, frame by frame
  for (const program::Clip* clip : clips) {
    frames.emplace_back(program, *clip);
    std::vector<glm::vec3>& out = seen.emplace_back();
    for (std::size_t i = 0; i < frames.back().count(); ++i) {
      vertices.at(frames.back().at(i), one);
      for (const std::uint32_t v : probes) out.push_back(one[v]);
    }
  }
  const auto probe = [&](std::size_t clip, std::size_t frame, std::size_t k) {
    return seen[clip][std::min(frame, frames[clip].count() - 1) * probes.size() + k];
  };
  const auto differ_at_probes = [&](std::size_t a, std::size_t b, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t k = 0; k < probes.size(); ++k)
        if (distance(probe(a, i, k), probe(b, i, k)) > threshold_m) return true;
    return false;
  };
  std::vector<Lookalikes> pairs;
  for (std::size_t a = 0; a < clips.size(); ++a) {
    for (std::size_t b = a + 1; b < clips.size(); ++b) {
      const std::size_t count = std::max(frames[a].count(), frames[b].count());
      if (differ_at_probes(a, b, count)) continue;
      double largest = 0.0;
      for (std::size_t i = 0; i < count && largest <= threshold_m; ++i) {
        vertices.at(frames[a].at(i), one);
        vertices.at(frames[b].at(i), other);
        for (std::size_t v = 0; v < one.size(); ++v) largest = std::max(largest, distance(one[v], other[v]));
      }
      if (largest <= threshold_m)
        pairs.push_back(
            {std::string(program.string(clips[a]->name)), std::string(program.string(clips[b]->name)), largest});
    }
  }
  return pairs;
}

}  // namespace nms::cli
