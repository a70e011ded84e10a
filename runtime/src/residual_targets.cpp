#include "residual_targets.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <fmt/format.h>

#include <nms/runtime/trigonometry.h>

namespace nms::runtime {

using program::Clip;

namespace {

constexpr double kWeightTolerance = 0.002;        // of an AU
constexpr double kExactWeightTolerance = 0.0005;  // where an error is asked for
constexpr double kKeyShare = 0.05;                // of that error, for one weight of a residual
constexpr double kCorrectionTolerance = 0.02;     // of a correction, itself below 3 mm
// Of what the error allowed, targets may use so much; the rest is for keys.
constexpr double kResidualShare = 0.75;
constexpr std::size_t kMostResiduals = 96;  // of one mesh; a primitive holds 256 targets
constexpr std::size_t kWorkingFields = 128;
constexpr std::size_t kFieldsAtATime = 12;

class ResidualSearch {
 public:
  ResidualSearch(MorphTargets& morphs, ClipStage& stage, MorphedMesh& m, std::span<const Clip* const> clips,
                 double bound_m)
      : morphs_(morphs), stage_(stage), m_(m), clips_(clips), bound_m_(bound_m) {}
  void run();

 private:
  struct Moment {
    const Clip* clip = nullptr;
    std::int64_t time_ns = 0;
    double error_m = 0.0;
  };
  struct Field {
    Moment moment;
    std::vector<glm::vec3> lacking;
  };

  void append(const Moment& moment, std::vector<glm::vec3> lacking, std::size_t at);

  MorphTargets& morphs_;
  ClipStage& stage_;
  MorphedMesh& m_;
  std::span<const Clip* const> clips_;
  double bound_m_;
};

std::string nearest_landmark(const program::Program& program, const glm::vec3& p) {
  std::string name = "face";
  float least = 1e9F;
  for (const program::Landmark& mark : program.landmarks) {
    const glm::vec3 d = p - glm::vec3(mark.position[0], mark.position[1], mark.position[2]);
    const float squared = d.x * d.x + d.y * d.y + d.z * d.z;
    if (squared >= least) continue;
    least = squared;
    name = program.string(mark.name);
  }
  return name;
}

void ResidualSearch::run() {
  MorphedMesh& m = m_;
  m.basis.emplace(m.linear.positions.size());
  std::vector<Field> working;
  std::vector<double> fitted;
  const auto remaining = [&](std::vector<glm::vec3> field) {
    fitted.resize(m.basis->size());
    m.basis->fit(field, fitted);
    m.basis->subtract(fitted, field);
    return field;
  };
  while (true) {
    // Fit what is known, worst first.
    while (m.basis->size() < kMostResiduals) {
      std::size_t worst = 0;
      Largest most;
      for (std::size_t f = 0; f < working.size(); ++f) {
        const Largest l = largest(remaining(working[f].lacking));
        if (l.length > most.length) {
          most = l;
          worst = f;
        }
      }
      if (most.length <= bound_m_) break;
      append(working[worst].moment, remaining(working[worst].lacking), most.index);
    }
    if (m.basis->size() >= kMostResiduals || working.size() >= kWorkingFields) return;
    // Look for moments that still lack something.
    std::vector<Moment> moments;
    for (const Clip* clip : clips_) {
      visit_moments(stage_.program, *clip, [&](std::int64_t t) {
        std::vector<float> weights(m.count());
        stage_.evaluate(*clip, t);
        morphs_.straight_weights(m, weights);
        morphs_.find_residual(m, weights);
        const double error = largest(remaining(morphs_.field())).length;
        if (error > bound_m_) moments.push_back({clip, t, error});
      });
    }
    if (moments.empty()) return;
    std::stable_sort(moments.begin(), moments.end(),
                     [](const Moment& a, const Moment& b) { return a.error_m > b.error_m; });
    if (moments.size() > kFieldsAtATime) moments.resize(kFieldsAtATime);
    for (const Moment& moment : moments) {
      std::vector<float> weights(m.count());
      stage_.evaluate(*moment.clip, moment.time_ns);
      morphs_.straight_weights(m, weights);
      morphs_.find_residual(m, weights);
      working.push_back({moment, morphs_.field()});
    }
  }
}

void ResidualSearch::append(const Moment& moment, std::vector<glm::vec3> lacking, std::size_t at) {
  MorphedMesh& m = m_;
  LinearMesh::Target straight = still_target(m);
  straight.moved = std::move(lacking);
  // The normals of that moment, less what the others give.
  std::vector<float> weights(m.count());
  morphs_.weights_at(m, *moment.clip, moment.time_ns, weights);
  m.linear.turn(weights, straight.turned);
  for (std::size_t v = 0; v < straight.turned.size(); ++v) {
    const bool still = straight.moved[v] == glm::vec3(0.0F);
    straight.turned[v] = still ? glm::vec3(0.0F) : m.posed_normals(stage_.pose)[v] - straight.turned[v];
  }
  straight = without_dust(std::move(straight));
  m.residuals.push_back(
      fmt::format("fix.{}.{}", nearest_landmark(stage_.program, m.linear.positions[at]), m.residuals.size() + 1));
  m.basis->add(straight.moved);
  m.linear.targets.push_back(std::move(straight));
}

}  // namespace

void add_residual_targets(MorphTargets& morphs, ClipStage& stage, MorphedMesh& m, std::span<const Clip* const> clips,
                          double error_m) {
  ResidualSearch(morphs, stage, m, clips, kResidualShare * error_m).run();
}

std::vector<double> key_tolerances(const MorphedMesh& m, double error_m) {
  const bool exact = error_m > 0.0;
  std::vector<double> tolerance(m.targets.size(), exact ? kExactWeightTolerance : kWeightTolerance);
  tolerance.resize(tolerance.size() + m.corrections.size(), exact ? kExactWeightTolerance : kCorrectionTolerance);
  for (std::size_t j = 0; j < m.residuals.size(); ++j) {
    const double reach = largest(m.basis->field(j)).length;
    tolerance.push_back(reach > 0.0 ? kKeyShare * error_m / reach : 1.0);
  }
  return tolerance;
}

void measure_clip(MorphTargets& morphs, ClipStage& stage, const Clip& clip, const MorphedMesh& m, const Keys& keys,
                  GltfClipError& error) {
  const std::size_t count = m.count();
  std::vector<float> weights(count);
  std::vector<glm::vec3> normals(m.linear.normals.size());
  std::size_t key = 0;
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
    morphs.find_residual(m, weights);
    const Largest most = largest(morphs.field());
    ++error.samples;
    m.linear.turn(weights, normals);
    for (std::size_t v = 0; v < normals.size(); ++v) {
      const glm::vec3 n = normals[v];
      const double length = std::sqrt(static_cast<double>(n.x * n.x + n.y * n.y + n.z * n.z));
      const glm::vec3 o = m.posed_normals(stage.pose)[v];
      const double c = length > 0.0 ? static_cast<double>(n.x * o.x + n.y * o.y + n.z * o.z) / length : 1.0;
      error.normal_rad = std::max(error.normal_rad, arc_cosine(std::min(c, 1.0)));
    }
    if (most.length <= error.largest_m) return;
    error.largest_m = most.length;
    error.time_s = static_cast<double>(at);
    error.mesh = m.name;
    error.place = nearest_landmark(stage.program, m.linear.positions[most.index]);
  };
  visit_moments(stage.program, clip, look);
}

}  // namespace nms::runtime
