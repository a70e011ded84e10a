#include "target_errors.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include <glm/geometric.hpp>

#include <nms/runtime/face_file.h>
#include <nms/runtime/trigonometry.h>

namespace nms::runtime {

using program::Clip;

namespace {

/// What a sum of targets is off by, at one moment.
struct Miss {
  Largest place;             ///< [m]
  double angle = 0.0;        ///< largest, of normals                                           [rad]
  std::size_t angle_at = 0;  ///< vertex
  double askew_share = 0.0;  ///< of the mesh's area: of what is turned by more than kAskew
};

/// A mesh of the file against the pose of its stage.
class MeshMiss {
 public:
  MeshMiss(const ClipStage& stage, const MorphedMesh& m)
      : stage_(stage),
        m_(m),
        primitives_(m.part ? stage.face.rigid[*m.part].primitives : stage.face.skin.primitives),
        places_(m.linear.positions.size()),
        normals_(places_.size()),
        areas_(places_.size()) {}

  Miss of(std::span<const float> weights) {
    const std::vector<glm::vec3>& truth = m_.posed(stage_.pose);
    m_.linear.place(weights, places_);
    for (std::size_t v = 0; v < places_.size(); ++v) places_[v] = truth[v] - places_[v];
    Miss miss;
    miss.place = largest(places_);
    find_areas(truth);
    m_.linear.turn(weights, normals_);
    double least = 1.0;
    double askew = 0.0;
    double whole = 0.0;
    for (std::size_t v = 0; v < normals_.size(); ++v) {
      const double c = cosine_to(normals_[v], m_.posed_normals(stage_.pose)[v]);
      whole += areas_[v];
      if (c < kCosine) askew += areas_[v];
      if (c >= least) continue;
      least = c;
      miss.angle_at = v;
    }
    miss.angle = arc_cosine(least);
    miss.askew_share = whole > 0.0 ? askew / whole : 0.0;
    return miss;
  }

 private:
  static double cosine_to(const glm::vec3& n, const glm::vec3& unit) {
    const double length = std::sqrt(static_cast<double>(n.x * n.x + n.y * n.y + n.z * n.z));
    return length > 0.0 ? static_cast<double>(n.x * unit.x + n.y * unit.y + n.z * unit.z) / length : 1.0;
  }

  /// Each vertex has a third of what is about it.
  void find_areas(const std::vector<glm::vec3>& truth) {
    std::fill(areas_.begin(), areas_.end(), 0.0);
    for (const Primitive& primitive : primitives_) {
      for (std::size_t i = 0; i + 2 < primitive.triangles.size(); i += 3) {
        const std::uint32_t* t = &primitive.triangles[i];
        const glm::vec3 n = glm::cross(truth[t[1]] - truth[t[0]], truth[t[2]] - truth[t[0]]);
        const double area = std::sqrt(static_cast<double>(n.x * n.x + n.y * n.y + n.z * n.z)) / 6.0;
        for (std::size_t k = 0; k < 3; ++k) areas_[t[k]] += area;
      }
    }
  }

  const double kCosine = cosine(kAskew_rad);
  const ClipStage& stage_;
  const MorphedMesh& m_;
  std::span<const Primitive> primitives_;
  std::vector<glm::vec3> places_;
  std::vector<glm::vec3> normals_;
  std::vector<double> areas_;
};

}  // namespace

void measure_clip(ClipStage& stage, const Clip& clip, const MorphedMesh& m, const Keys& keys, GltfClipError& error) {
  const std::size_t count = m.count();
  std::vector<float> weights(count);
  MeshMiss mesh(stage, m);
  std::size_t key = 0;
  double askew = 0.0;
  std::size_t moments = 0;
  const auto look = [&](std::int64_t t) {
    const float at = static_cast<float>(static_cast<double>(t - clip.start_ns) / 1e9);
    if (at < keys.times.front()) key = 0;
    while (key + 1 < keys.times.size() && keys.times[key + 1] <= at) ++key;
    const std::size_t next = std::min(key + 1, keys.times.size() - 1);
    const float span = keys.times[next] - keys.times[key];
    const float u = span > 0.0F ? std::clamp((at - keys.times[key]) / span, 0.0F, 1.0F) : 0.0F;
    for (std::size_t i = 0; i < count; ++i) {
      const float a = keys.values[key * count + i];
      weights[i] = a + u * (keys.values[next * count + i] - a);
    }
    stage.evaluate(clip, t);
    stage.pose_values();
    const Miss miss = mesh.of(weights);
    ++error.samples;
    ++moments;
    askew += miss.askew_share;
    const auto time_s = static_cast<double>(at);
    if (miss.angle > error.normal_rad) {
      error.normal_rad = miss.angle;
      error.normal_time_s = time_s;
      error.normal_mesh = m.name;
      error.normal_place = nearest_landmark(stage.landmarks, m.linear.positions[miss.angle_at]);
    }
    if (miss.askew_share > error.askew_share) {
      error.askew_share = miss.askew_share;
      error.askew_time_s = time_s;
      error.askew_mesh = m.name;
    }
    if (miss.place.length <= error.largest_m) return;
    error.largest_m = miss.place.length;
    error.time_s = time_s;
    error.mesh = m.name;
    error.place = nearest_landmark(stage.landmarks, m.linear.positions[miss.place.index]);
  };
  visit_moments(stage.program, clip, look);
  if (moments > 0) error.askew_mean = std::max(error.askew_mean, askew / static_cast<double>(moments));
}

void measure_targets(ClipStage& stage, const MorphedMesh& m, std::vector<GltfTargetError>& errors) {
  if (m.posed(stage.pose).empty()) return;  // rides with the jaw and does not bend
  MeshMiss mesh(stage, m);
  std::vector<float> weights(m.count(), 0.0F);
  for (std::size_t t = 0; t < m.targets.size(); ++t) {
    stage.pose_alone(m.targets[t].channel, m.targets[t].sign);
    weights[t] = 1.0F;
    const Miss miss = mesh.of(weights);
    weights[t] = 0.0F;
    errors.push_back({m.targets[t].name, m.name, miss.place.length, miss.angle, miss.askew_share});
  }
}

}  // namespace nms::runtime
