// Projective dynamics (Bouaziz and others 2014) on the net: a triangle that has turned over, or nearly so, under some
// pose says where its corners ought to be; one linear solve for all of them moves the control points, which are held by
// their places and by the smoothness of what they move by. Then the face is bound and posed again.
#include "unfold.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include <nms/runtime/rig.h>
#include <nms/runtime/tessellate.h>

#include "lids.h"
#include "poses.h"
#include "skin_mesh.h"

namespace nms::fit_face {

namespace {

constexpr int kRounds = 150;
// So many rounds look at every pose, and after them one in kFullEvery; the others look at what was near then.
constexpr int kFullRounds = 5;
constexpr int kFullEvery = 30;
// Least cosine between a triangle and its corners' normals; a triangle that is thinner than kThin counts for what it
// would be at that height.
constexpr double kLeastCosine = 0.15;
constexpr double kThin_mm = 0.02;
// Triangles this thin are of rounding.
constexpr double kRounding_mm = 1e-4;
// What lies nearer to the midline is on it: both halves share it.
constexpr double kMiddle_mm = 1e-5;
constexpr std::uint32_t kSeed = 11;
constexpr int kMixtures = 20000;
constexpr int kFullMixtures = 3000;  // whose units are all at 100 %
// What holds a point: its place, and that its neighbours move alike.
constexpr double kStay = 0.05;
constexpr double kSmooth = 0.05;
// Furthest that a point goes from where it began. The lips are looked at closely; their corner, so many spans of their
// curve to either side, is what has to move.
constexpr double kFurthest_mm = 1.5;
constexpr double kFurthestOfLips_mm = 0.05;
constexpr double kFurthestOfCorner_mm = 0.4;
constexpr double kCornerSpans = 5.0;
constexpr float kHeld_mm = 0.05F;
constexpr double kFew = 1.0;       // wishes that count half
constexpr double kStep_mm = 0.15;  // furthest that one round asks of a vertex

using Triangle = std::array<std::uint32_t, 3>;

// What comes first: a vertex listens to the rarer kinds of poses where none of the kinds before them asks.
enum Kind { pairs, usual_mixtures, full_mixtures, kinds };
using Counts = std::array<std::size_t, kinds>;

struct Wish {
  glm::dvec3 sum{0.0};  // of displacements, each weighted by its length [mm2]
  double weight = 0.0;  // [mm]
  int count = 0;        // of triangles in poses
  Kind kind = kinds;
};

struct Seen {
  FacePose pose;
  Kind kind = pairs;
  bool near = true;  // when all poses were looked at
};

class Unfolder {
 public:
  Unfolder(Model& model, const program::Program& program, const std::function<runtime::Face(const Model&)>& face_of)
      : model_(model), program_(program), face_of_(face_of), start_(model.x) {
    limit_lips();
  }

  /// Keeps the best of all rounds that look at every pose.
  void run() {
    Counts least{};
    least.fill(std::numeric_limits<std::size_t>::max());
    std::vector<glm::dvec3> best;
    for (int round = 0; round <= kRounds; ++round) {
      const bool full = round < kFullRounds || round % kFullEvery == 0;
      look(full);
      if (full) {
        fmt::print("folds: {} in units and pairs, {} in mixtures, {} at full strength; {} triangles nearly\n",
                   folds_[pairs], folds_[usual_mixtures], folds_[full_mixtures], near_);
        if (folds_ < least) {
          least = folds_;
          best = model_.x;
          told_ = std::move(still_);
        }
        if (near_ == 0) break;
      }
      move();
    }
    model_.x = best;
    for (const std::string& line : told_) fmt::print("{}\n", line);
  }

 private:
  void limit_lips() {
    furthest_mm_.assign(model_.x.size(), kFurthest_mm);
    const double corner = mouth_corner(model_);
    for (const char* name : {"lip", "lining"}) {
      const runtime::NetSurface& surface = model_.net.surfaces[model_.surface(name)];
      const std::vector<runtime::Row>& rows = model_.seams.surfaces[model_.surface(name)];
      for (std::size_t i = 0; i < rows.size(); ++i) {
        const Beside b = beside(model_, surface, "margin", greville(surface.knots_u, i % surface.count_u()),
                                greville(surface.knots_v, i / surface.count_u()));
        const double most = std::abs(b.along - corner) < kCornerSpans ? kFurthestOfCorner_mm : kFurthestOfLips_mm;
        for (const runtime::RowEntry& e : rows[i]) furthest_mm_[e.point] = most;
      }
    }
  }

  void make_mesh() {
    // Anew in each round: which way a cell is cut in two depends on where the points are.
    mesh_ = runtime::tessellate(model_.net, model_.seams, samples(model_.layout), model_.x);
    triangles_.clear();
    for (const auto& t : mesh_.triangles) {
      for (std::size_t i = 0; i + 2 < t.size(); i += 3) triangles_.push_back({t[i], t[i + 1], t[i + 2]});
    }
  }

  void make_poses(const runtime::Rig& rig) {
    const auto add = [&](std::vector<FacePose> poses, Kind kind) {
      for (FacePose& p : poses) poses_.push_back({std::move(p), kind});
    };
    add(each_unit(program_, rig), pairs);
    add(each_pair(program_, rig), pairs);
    add(mixtures(program_, kSeed, kMixtures), usual_mixtures);
    add(mixtures(program_, kSeed, kFullMixtures, 1.0F), full_mixtures);
  }

  void look(bool full) {
    make_mesh();
    wishes_.assign(mesh_.vertices.size(), {});
    folds_.fill(0);
    near_ = 0;
    still_.clear();
    const runtime::Face face = face_of_(model_);
    auto rig = runtime::bind(face, program_);
    if (!rig) fail(rig.error().place + ": " + rig.error().cause);
    runtime::Pose pose = runtime::make_pose(face, *rig);
    for (std::size_t v = 0; v < mesh_.vertices.size(); ++v) {
      const glm::dvec3 at = model_.at(mesh_.vertices[v]) * kMillimetres / 1000.0;
      if (glm::distance(at, glm::dvec3(pose.positions[v])) > 1e-6) fail("the face's vertices are not the model's");
    }
    if (poses_.empty()) make_poses(*rig);
    for (Seen& seen : poses_) {
      if (!full && !seen.near) continue;
      runtime::pose_face(face, *rig, seen.pose.values, pose);
      const std::size_t near = near_;
      for (const Triangle& t : triangles_) look_at(t, face, pose, seen);
      if (full) seen.near = near_ > near;
    }
  }

  // What lies against teeth, an eyeball or the other lip lies there wherever it rests.
  static bool is_held(const Triangle& t, const runtime::Face& face, const runtime::Pose& pose) {
    const runtime::SparseMatrix& surface = face.skin.surface;
    return std::any_of(t.begin(), t.end(), [&](std::uint32_t v) {
      glm::vec3 p = face.skin.offsets[v];
      for (std::uint32_t k = surface.row_begin[v]; k < surface.row_begin[v + 1]; ++k) {
        p += surface.value[k] * pose.x[surface.column[k]];
      }
      return glm::distance(p, pose.positions[v]) * 1000.0F > kHeld_mm;
    });
  }

  void look_at(const Triangle& t, const runtime::Face& face, const runtime::Pose& pose, const Seen& seen_in) {
    std::array<glm::dvec3, 3> p;
    glm::dvec3 welded(0.0);
    for (std::size_t k = 0; k < 3; ++k) {
      p[k] = glm::dvec3(pose.positions[t[k]]) * 1000.0;
      welded += glm::dvec3(pose.normals[t[k]]);
    }
    const double length = glm::length(welded);
    if (length <= 0.0) return;
    welded /= length;
    const glm::dvec3 area = glm::cross(p[1] - p[0], p[2] - p[0]);
    const double longest = std::max({glm::distance(p[0], p[1]), glm::distance(p[1], p[2]), glm::distance(p[2], p[0])});
    const double size = glm::length(area);
    const double seen = glm::dot(area, welded);
    if (longest <= 0.0 || size < kRounding_mm * longest) return;
    if (seen < 0.0) {
      ++folds_[seen_in.kind];
      const glm::dvec3 at = model_.at(mesh_.vertices[t[0]]) * kMillimetres;
      still_.push_back(
          fmt::format("still folds: {} at {:.1f}, {:.1f}, {:.1f} mm", seen_in.pose.what, at.x, at.y, at.z));
    }
    const double wanted = kLeastCosine * std::max(size, kThin_mm * longest);
    if (seen >= wanted || is_held(t, face, pose)) return;
    ++near_;
    // The way of each corner in which the seen area grows most.
    const std::array<glm::dvec3, 3> way = {glm::cross(p[1] - p[2], welded), glm::cross(p[2] - p[0], welded),
                                           glm::cross(p[0] - p[1], welded)};
    const double squared = glm::dot(way[0], way[0]) + glm::dot(way[1], way[1]) + glm::dot(way[2], way[2]);
    if (squared <= 0.0) return;
    for (std::size_t k = 0; k < 3; ++k) {
      const glm::dvec3 by = (wanted - seen) / squared * way[k];
      const double far = glm::length(by);
      Wish& wish = wishes_[t[k]];
      if (seen_in.kind > wish.kind) continue;
      if (seen_in.kind < wish.kind) wish = {};
      wish.kind = seen_in.kind;
      wish.sum += far * by;
      wish.weight += far;
      ++wish.count;
    }
  }

  void move() {
    PointSolver solver(model_);
    std::vector<char> free(model_.x.size(), 0);
    for (std::size_t v = 0; v < wishes_.size(); ++v) {
      if (wishes_[v].weight <= 0.0) continue;
      for (const runtime::RowEntry& e : mesh_.vertices[v]) free[e.point] = 1;
    }
    // A ring more, so that what moves passes smoothly into what stays.
    std::vector<char> ring = free;
    for (const auto& rows : model_.seams.surfaces) {
      for (const runtime::Row& row : rows) {
        if (std::any_of(row.begin(), row.end(), [&](const runtime::RowEntry& e) { return free[e.point] != 0; })) {
          for (const runtime::RowEntry& e : row) ring[e.point] = 1;
        }
      }
    }
    for (std::uint32_t p = 0; p < ring.size(); ++p) {
      if (ring[p] == 0) continue;
      solver.release(p);
      solver.want({{p, 1.0}}, model_.x[p], kStay);
    }
    keep_smooth(ring, solver);
    for (std::size_t v = 0; v < wishes_.size(); ++v) {
      const Wish& wish = wishes_[v];
      if (wish.weight <= 0.0) continue;
      glm::dvec3 by = wish.sum / wish.weight;
      const double far = glm::length(by);
      if (far > kStep_mm) by *= kStep_mm / far;
      if (on_midline(mesh_.vertices[v])) by.x = 0.0;
      solver.want(mesh_.vertices[v], model_.at(mesh_.vertices[v]) + by / kMillimetres,
                  wish.count / (wish.count + kFew));
    }
    solver.solve();
    for (std::size_t p = 0; p < start_.size(); ++p) {
      const glm::dvec3 by = model_.x[p] - start_[p];
      const double far = glm::length(by) * kMillimetres;
      if (far > furthest_mm_[p]) model_.x[p] = start_[p] + by * (furthest_mm_[p] / far);
      if (is_middle(start_[p])) model_.x[p].x = 0.0;
    }
  }

  static bool is_middle(const glm::dvec3& p) { return std::abs(p.x) * kMillimetres < kMiddle_mm; }

  bool on_midline(const runtime::Row& row) const {
    return std::all_of(row.begin(), row.end(), [&](const runtime::RowEntry& e) { return is_middle(start_[e.point]); });
  }

  void keep_smooth(const std::vector<char>& moves, PointSolver& solver) const {
    for (std::size_t s = 0; s < model_.seams.surfaces.size(); ++s) {
      const auto& rows = model_.seams.surfaces[s];
      const std::size_t nu = model_.net.surfaces[s].count_u();
      const std::size_t nv = model_.net.surfaces[s].count_v();
      const auto alike = [&](std::size_t a, std::size_t b) {
        const runtime::Row* both[] = {&rows[a], &rows[b]};
        const double weights[] = {1.0, -1.0};
        const runtime::Row difference = runtime::combine(both, weights);
        if (std::none_of(difference.begin(), difference.end(),
                         [&](const runtime::RowEntry& e) { return moves[e.point] != 0; }))
          return;
        solver.want(difference, model_.at(difference), kSmooth);
      };
      for (std::size_t v = 0; v < nv; ++v) {
        for (std::size_t u = 0; u < nu; ++u) {
          if (u + 1 < nu) alike(u + nu * v, u + 1 + nu * v);
          if (v + 1 < nv) alike(u + nu * v, u + nu * (v + 1));
        }
      }
    }
  }

  Model& model_;
  const program::Program& program_;
  const std::function<runtime::Face(const Model&)>& face_of_;
  std::vector<glm::dvec3> start_;
  runtime::NetMesh mesh_;
  std::vector<Triangle> triangles_;
  std::vector<double> furthest_mm_;  // of each point
  std::vector<Wish> wishes_;
  std::vector<Seen> poses_;
  Counts folds_{};
  std::size_t near_ = 0;
  std::vector<std::string> still_;  // folded in this round
  std::vector<std::string> told_;   // in the best one
};

}  // namespace

void unfold(Model& model, const program::Program& program, const std::function<runtime::Face(const Model&)>& face_of) {
  Unfolder(model, program, face_of).run();
}

}  // namespace nms::fit_face
