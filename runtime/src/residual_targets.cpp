#include "residual_targets.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include <nms/runtime/face_file.h>

namespace nms::runtime {

using program::Clip;

namespace {

constexpr double kWeightTolerance = 0.002;  // of an AU
// Of the error that is asked for, one weight's keys may take so much.
constexpr double kKeyShare = 0.08;
constexpr double kCorrectionTolerance = 0.02;  // of a correction, itself below 3 mm
// Of what the error allowed, targets may use so much; the rest is for keys.
constexpr double kResidualShare = 0.75;
// What lacks less than this share of what may be lacking stays as it is: a correction is as small as its cause, also
// where vertices stand on a grid and lack some of its rounding everywhere.
constexpr float kLeftAlone = 0.1F;
constexpr std::size_t kWorkingFields = 256;
constexpr std::size_t kFieldsAtATime = 24;
constexpr std::int64_t kApart_ns = 40'000'000;
// A moment that lacks less is looked at again only in the end.
constexpr double kNear = 0.6;
constexpr std::size_t kSome = 6;
constexpr double kUnknown = 1e9;

class ResidualSearch {
 public:
  ResidualSearch(MorphTargets& morphs, ClipStage& stage, MorphedMesh& m, std::span<const Clip* const> clips,
                 double bound_m, std::size_t most)
      : morphs_(morphs), stage_(stage), m_(m), clips_(clips), most_(most) {
    m.lack_m = bound_m;
    m.basis.emplace(2 * m.linear.positions.size());
  }
  void run();

 private:
  struct Moment {
    const Clip* clip = nullptr;
    std::int64_t time_ns = 0;
    double error = 0.0;  // as last seen; 1: what may be lacking
  };

  void find_moments();
  /// Looks at every so-many-th moment whose error was above that. Whether any lacks something.
  bool look_again(std::size_t every, double above);
  /// The moments that lack most, none near another: what lacks there differs.
  std::vector<Moment> peaks() const;

  void append(std::span<const glm::vec3> lacking, std::size_t at);
  /// What is lacking before residuals.
  const std::vector<glm::vec3>& lacking_at(const Clip& clip, std::int64_t time_ns);
  /// What is lacking after them.
  std::vector<glm::vec3> remaining(std::vector<glm::vec3> lacking);

  MorphTargets& morphs_;
  ClipStage& stage_;
  MorphedMesh& m_;
  std::span<const Clip* const> clips_;
  std::size_t most_;
  std::vector<Moment> moments_;  // of the clips, in their order
  std::vector<double> fitted_;
};

const std::vector<glm::vec3>& ResidualSearch::lacking_at(const Clip& clip, std::int64_t time_ns) {
  std::vector<float> weights(m_.count());
  stage_.evaluate(clip, time_ns);
  morphs_.straight_weights(m_, weights);
  morphs_.find_lacking(m_, weights);
  return morphs_.lacking();
}

std::vector<glm::vec3> ResidualSearch::remaining(std::vector<glm::vec3> lacking) {
  fitted_.resize(m_.basis->size());
  m_.basis->fit(lacking, fitted_);
  m_.basis->subtract(fitted_, lacking);
  return lacking;
}

void ResidualSearch::run() {
  find_moments();
  std::vector<std::vector<glm::vec3>> working;
  while (true) {
    // Fit what is known, worst first.
    while (m_.basis->size() < most_) {
      std::size_t worst = 0;
      Largest most;
      for (std::size_t f = 0; f < working.size(); ++f) {
        const Largest l = largest(remaining(working[f]));
        if (l.length > most.length) {
          most = l;
          worst = f;
        }
      }
      if (most.length <= 1.0) break;
      append(remaining(working[worst]), most.index);
    }
    if (m_.basis->size() >= most_ || working.size() >= kWorkingFields) return;
    // Some moments stand for those about them, and what was nearly well stays so, as a rule; all are looked at before
    // the end.
    if (!look_again(kSome, kNear) && !look_again(1, kNear) && !look_again(1, 0.0)) return;
    for (const Moment& moment : peaks()) working.push_back(lacking_at(*moment.clip, moment.time_ns));
  }
}

void ResidualSearch::find_moments() {
  for (const Clip* clip : clips_) {
    visit_moments(stage_.program, *clip, [&](std::int64_t t) { moments_.push_back({clip, t, kUnknown}); });
  }
}

bool ResidualSearch::look_again(std::size_t every, double above) {
  bool lacks = false;
  const Moment* last = nullptr;
  std::vector<float> last_values;
  for (std::size_t i = 0; i < moments_.size(); i += every) {
    Moment& moment = moments_[i];
    if (moment.error <= above) continue;
    stage_.evaluate(*moment.clip, moment.time_ns);
    if (morphs_.at_rest(m_)) {
      moment.error = 0.0;
      continue;
    }
    // A face that holds still needs no second look.
    if (last == nullptr || last_values != stage_.values) {
      last_values = stage_.values;
      moment.error = largest(remaining(lacking_at(*moment.clip, moment.time_ns))).length;
    } else {
      moment.error = last->error;
    }
    last = &moment;
    lacks = lacks || moment.error > 1.0;
  }
  return lacks;
}

std::vector<ResidualSearch::Moment> ResidualSearch::peaks() const {
  std::vector<Moment> worst;
  for (const Moment& moment : moments_) {
    if (moment.error > 1.0 && moment.error < kUnknown) worst.push_back(moment);
  }
  std::stable_sort(worst.begin(), worst.end(), [](const Moment& a, const Moment& b) { return a.error > b.error; });
  std::vector<Moment> found;
  for (const Moment& moment : worst) {
    const bool near = std::any_of(found.begin(), found.end(), [&](const Moment& other) {
      return other.clip == moment.clip && std::abs(other.time_ns - moment.time_ns) < kApart_ns;
    });
    if (!near) found.push_back(moment);
    if (found.size() == kFieldsAtATime) break;
  }
  return found;
}

void ResidualSearch::append(std::span<const glm::vec3> lacking, std::size_t at) {
  const std::size_t count = m_.linear.positions.size();
  LinearMesh::Target target = still_target(m_);
  for (std::size_t v = 0; v < count; ++v) {
    if (glm::length(lacking[v]) > kLeftAlone) target.moved[v] = static_cast<float>(m_.lack_m) * lacking[v];
    if (glm::length(lacking[count + v]) > kLeftAlone) target.turned[v] = m_.lack_turn * lacking[count + v];
  }
  target = without_dust(std::move(target));
  if (m_.grid) {
    fill_range(*m_.grid, target);
    put_on(*m_.grid, target);
  }
  std::vector<glm::vec3> field(2 * count);
  for (std::size_t v = 0; v < count; ++v) {
    field[v] = static_cast<float>(1.0 / m_.lack_m) * target.moved[v];
    field[count + v] = target.turned[v] / m_.lack_turn;
  }
  const glm::vec3& place = m_.linear.positions[at % count];
  m_.residuals.push_back(fmt::format("fix.{}.{}", nearest_landmark(stage_.landmarks, place), m_.residuals.size() + 1));
  m_.basis->add(std::move(field));
  m_.linear.targets.push_back(std::move(target));
  m_.linear.note_reach();
}

}  // namespace

void add_residual_targets(MorphTargets& morphs, ClipStage& stage, MorphedMesh& m, std::span<const Clip* const> clips,
                          double error_m, std::size_t most) {
  ResidualSearch(morphs, stage, m, clips, kResidualShare * error_m, most).run();
}

std::vector<double> key_tolerances(const MorphedMesh& m, double error_m) {
  std::vector<double> tolerance(m.targets.size(), kWeightTolerance);
  tolerance.resize(tolerance.size() + m.corrections.size(), kCorrectionTolerance);
  if (error_m <= 0.0) return tolerance;
  for (std::size_t t = 0; t < tolerance.size(); ++t) {
    const double reach_m = largest(m.linear.targets[t].moved).length;
    if (reach_m > 0.0) tolerance[t] = std::min(tolerance[t], kKeyShare * error_m / reach_m);
  }
  for (std::size_t j = 0; j < m.residuals.size(); ++j) {
    const double reach = largest(m.basis->field(j)).length;
    tolerance.push_back(reach > 0.0 ? kKeyShare / (kResidualShare * reach) : 1.0);
  }
  return tolerance;
}

}  // namespace nms::runtime
