// No artefacts: every unit alone, every pair that a face can do together, and a thousand mixtures of up to six, on all
// vertices. Nothing here shares code with what holds the surfaces apart (runtime/src/contact.cpp): depths are found on
// the triangles of skin, teeth and tongue themselves.
//
// A finding names the units, what goes through what, the nearest landmark, and by how much. NMS_REPORT=1 prints all
// kinds with their worst cases.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "ada_fixture.h"
#include "under_sanitizers.h"

#include "../tools/fit_face/poses.h"

namespace {

using namespace nms;
using namespace nms::ada;

constexpr double kDepth_mm = 0.2;
// A triangle thinner than this is a line but for the rounding of single precision: it has no side to turn over.
constexpr double kLeastHeight_mm = 1e-4;
// Nothing folds at rest and under any unit. Of pairs and mixtures few do, on each side, in triangles whose area is
// below that of a square of these sides: AU12 + 28 (upper lip's edge, 0.96 mm) the largest; beside the nose's wing
// under AU10 with AU12, and in the mouth's corner under AU24 with AU30, below 0.2.
constexpr double kLeastFoldOfPairs_mm = 1.0;
constexpr double kLeastFoldOfMixtures_mm = 0.2;
constexpr float kLipShare = 0.9F;

struct Finding {
  std::string kind;
  std::string place;
  double mm = 0.0;
};

double distance_to_triangle(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
  const auto to_segment = [&](const glm::dvec3& u, const glm::dvec3& v) {
    const glm::dvec3 d = v - u;
    const double l = glm::dot(d, d);
    const double t = l > 0.0 ? std::clamp(glm::dot(p - u, d) / l, 0.0, 1.0) : 0.0;
    return glm::distance(p, u + t * d);
  };
  const double edges = std::min({to_segment(a, b), to_segment(b, c), to_segment(c, a)});
  const glm::dvec3 n = glm::cross(b - a, c - a);
  const double area = glm::length(n);
  if (area <= 0.0) return edges;
  for (const auto& [u, v] : {std::pair(a, b), std::pair(b, c), std::pair(c, a)}) {
    if (glm::dot(glm::cross(v - u, p - u), n) < 0.0) return edges;
  }
  return std::min(edges, std::abs(glm::dot(p - a, n)) / area);
}

/// Triangles by the cell of a plane that they cover.
class Cells {
 public:
  Cells(double cell_m, double low, double high)
      : cell_(cell_m), low_(low), count_(static_cast<int>((high - low) / cell_m) + 1) {
    cells_.resize(static_cast<std::size_t>(count_ * count_));
  }
  void clear() {
    for (auto& c : cells_) c.clear();
  }
  void add(std::size_t index, double u0, double u1, double v0, double v1) {
    for (int i = at(u0); i <= at(u1); ++i) {
      for (int j = at(v0); j <= at(v1); ++j) cells_[static_cast<std::size_t>(i * count_ + j)].push_back(index);
    }
  }
  [[nodiscard]] const std::vector<std::size_t>& find(double u, double v) const {
    return cells_[static_cast<std::size_t>(at(u) * count_ + at(v))];
  }

 private:
  [[nodiscard]] int at(double x) const { return std::clamp(static_cast<int>((x - low_) / cell_), 0, count_ - 1); }
  double cell_, low_;
  int count_;
  std::vector<std::vector<std::size_t>> cells_;
};

/// A row of teeth with its gums, in its frame at rest: how deep a place is inside.
class Row {
 public:
  Row(runtime::Frame frame, bool gums) : cells_(0.02, -1.0, 1.0) {
    for (const runtime::RigidMesh& mesh : face().rigid) {
      const bool teeth = mesh.name.rfind("teeth", 0) == 0;
      if (mesh.frame != frame || !(teeth || (gums && mesh.name.rfind("gums", 0) == 0))) continue;
      for (const glm::vec3& p : mesh.positions) back_ = std::min(back_, static_cast<double>(p.z) - 1e-3);
      for (const runtime::Primitive& primitive : mesh.primitives) {
        for (std::size_t i = 0; i + 2 < primitive.triangles.size(); i += 3) {
          std::array<glm::dvec3, 3> t;
          for (std::size_t k = 0; k < 3; ++k) t[k] = glm::dvec3(mesh.positions[primitive.triangles[i + k]]);
          triangles_.push_back(t);
        }
      }
    }
    for (std::size_t i = 0; i < triangles_.size(); ++i) {
      double a0 = 1.0, a1 = -1.0, y0 = 1.0, y1 = -1.0;
      for (const glm::dvec3& p : triangles_[i]) {
        a0 = std::min(a0, along(p)), a1 = std::max(a1, along(p));
        y0 = std::min(y0, p.y), y1 = std::max(y1, p.y);
        largest_ = std::max(largest_, std::hypot(p.x, p.z - back_));
      }
      cells_.add(i, a0, a1, y0 * kStretch, y1 * kStretch);
    }
  }

  /// 0 outside.
  [[nodiscard]] double depth_m(const glm::dvec3& p) const {
    const double z = p.z - back_;
    const double distance = std::hypot(p.x, z);
    if (z <= 0.0 || distance >= largest_) return 0.0;
    const glm::dvec3 from(0.0, p.y, back_);
    const glm::dvec3 ray(p.x / distance, 0.0, z / distance);
    int beyond = 0;
    double furthest = 0.0;
    for (const std::size_t i : cells_.find(along(p), p.y * kStretch)) {
      const auto& [a, b, c] = triangles_[i];
      const glm::dvec3 e1 = b - a, e2 = c - a, h = glm::cross(ray, e2);
      const double det = glm::dot(e1, h);
      if (std::abs(det) < 1e-16) continue;
      const glm::dvec3 s = from - a;
      const double u = glm::dot(s, h) / det;
      const glm::dvec3 q = glm::cross(s, e1);
      const double v = glm::dot(ray, q) / det;
      if (u < 0.0 || v < 0.0 || u + v > 1.0) continue;
      const double t = glm::dot(e2, q) / det;
      if (t <= distance) continue;
      ++beyond;
      furthest = std::max(furthest, t);
    }
    // Behind an even number of sheets is behind the whole row.
    if (beyond % 2 == 0 || furthest - distance < kDepth_mm / 1000.0) return 0.0;
    double least = furthest - distance;
    for (const auto& t : triangles_) least = std::min(least, distance_to_triangle(p, t[0], t[1], t[2]));
    return least;
  }

 private:
  static constexpr double kStretch = 10.0;
  [[nodiscard]] double along(const glm::dvec3& p) const {
    const double z = std::max(p.z - back_, 1e-6);
    return p.x / (std::abs(p.x) + z);
  }
  double back_ = 1.0;
  double largest_ = 0.0;
  std::vector<std::array<glm::dvec3, 3>> triangles_;
  Cells cells_;
};

class Inspector {
 public:
  /// Folds of triangles below `least_fold_mm` are let pass.
  explicit Inspector(const Bound& b, double least_fold_mm = 0.0)
      : b_(b),
        least_fold_mm_(least_fold_mm),
        pose_(runtime::make_pose(face(), b.rig)),
        upper_row_(runtime::Frame::head, true),
        lower_row_(runtime::Frame::jaw, true),
        upper_cells_(0.002, -0.05, 0.13),
        lower_cells_(0.002, -0.05, 0.13) {
    const auto upper = vertex_weights("lip_upper");
    const auto lower = vertex_weights("lip_lower");
    const auto& places = rest();
    std::vector<char> skin(places.size(), 0);
    for (const Triangle& t : skin_triangles()) {
      for (const std::uint32_t v : t) skin[v] = 1;
      const auto all = [&](const std::vector<float>& w) { return std::min({w[t[0]], w[t[1]], w[t[2]]}) >= kLipShare; };
      if (all(upper)) upper_triangles_.push_back(t);
      if (all(lower)) lower_triangles_.push_back(t);
    }
    eye_ = landmark(b, "eye_centre_L");
    for (const runtime::RigidMesh& mesh : face().rigid) {
      if (mesh.frame != runtime::Frame::eye_left) continue;
      for (const glm::vec3& p : mesh.positions) radius_ = std::max(radius_, glm::distance(glm::dvec3(p), eye_));
    }
    for (std::uint32_t v = 0; v < places.size(); ++v) {
      if (!skin[v]) continue;
      if (upper[v] >= kLipShare) upper_lip_.push_back(v);
      if (lower[v] >= kLipShare) lower_lip_.push_back(v);
      if (places[v].z > 0.06 && places[v].y < 0.01 && places[v].y > -0.085 && std::abs(places[v].x) < 0.055) {
        mouth_.push_back(v);
      }
      const double side = std::copysign(1.0, places[v].x);
      if (glm::distance(places[v], glm::dvec3(side * eye_.x, eye_.y, eye_.z)) < 0.04) near_eye_.push_back(v);
    }
    for (std::size_t i = 0; i < face().rigid.size(); ++i) {
      if (face().rigid[i].name == "tongue") tongue_ = i;
    }
  }

  std::vector<Finding> look(const std::vector<float>& values) {
    runtime::pose_face(face(), b_.rig, values, pose_);
    found_.clear();
    for (std::uint32_t v = 0; v < pose_.positions.size(); ++v) {
      const glm::vec3 p = pose_.positions[v];
      if (!(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z))) add("NaN", v, 1e9);
    }
    look_for_folds();
    look_at_eyes();
    look_at_lips();
    look_at_teeth();
    look_at_tongue();
    std::vector<Finding> out;
    for (const auto& [kind, worst] : found_) {
      out.push_back({kind, nearest_landmark(b_, worst.second), worst.first});
    }
    return out;
  }

 private:
  void add(const std::string& kind, std::uint32_t vertex, double mm) { add_at(kind, rest()[vertex], mm); }
  void add_at(const std::string& kind, const glm::dvec3& place, double mm) {
    auto& worst = found_[kind];
    if (mm > worst.first) worst = {mm, place};
  }

  // Whether the triangle is turned by more than 90 degrees against its vertices' normals together.
  [[nodiscard]] bool is_folded(const Triangle& t) const {
    const glm::dvec3 a(pose_.positions[t[0]]), b(pose_.positions[t[1]]), c(pose_.positions[t[2]]);
    const glm::dvec3 n = glm::cross(b - a, c - a);
    const double longest = std::max({glm::distance(a, b), glm::distance(b, c), glm::distance(c, a)});
    if (glm::length(n) <= longest * kLeastHeight_mm / 1000.0) return false;
    return glm::dot(n, glm::dvec3(pose_.normals[t[0]] + pose_.normals[t[1]] + pose_.normals[t[2]])) < 0.0;
  }

  void look_for_folds() {
    for (const Triangle& t : skin_triangles()) {
      if (!is_folded(t)) continue;
      // How large: the side of a square of its area.
      const glm::dvec3 a(pose_.positions[t[0]]), b(pose_.positions[t[1]]), c(pose_.positions[t[2]]);
      const double side_mm = 1000.0 * std::sqrt(0.5 * glm::length(glm::cross(b - a, c - a)));
      if (side_mm > least_fold_mm_) add("folded skin", t[0], side_mm);
    }
  }

  void look_at_eyes() {
    for (const std::uint32_t v : near_eye_) {
      const double side = std::copysign(1.0, rest()[v].x);
      const double depth =
          radius_ - glm::distance(glm::dvec3(pose_.positions[v]), glm::dvec3(side * eye_.x, eye_.y, eye_.z));
      if (depth * 1000.0 > kDepth_mm) add("skin in eyeball", v, depth * 1000.0);
    }
  }

  template <typename Cell>
  void fill(Cell& cells, const std::vector<Triangle>& triangles) {
    cells.clear();
    for (std::size_t i = 0; i < triangles.size(); ++i) {
      const Triangle& t = triangles[i];
      const auto p = [&](std::size_t k) { return pose_.positions[t[k]]; };
      cells.add(i, std::min({p(0).x, p(1).x, p(2).x}), std::max({p(0).x, p(1).x, p(2).x}),
                std::min({p(0).z, p(1).z, p(2).z}), std::max({p(0).z, p(1).z, p(2).z}));
    }
  }

  // How far p is past the lip: below the highest sheet of the lower lip at its x and z, or above the lowest of the
  // upper.
  double past_lip(const Cells& cells, const std::vector<Triangle>& triangles, const glm::dvec3& p,
                  bool lower_lip) const {
    double most = 0.0;
    for (const std::size_t i : cells.find(p.x, p.z)) {
      const Triangle& t = triangles[i];
      const glm::dvec3 a(pose_.positions[t[0]]), b(pose_.positions[t[1]]), c(pose_.positions[t[2]]);
      const double area = (b.x - a.x) * (c.z - a.z) - (c.x - a.x) * (b.z - a.z);
      if (std::abs(area) < 1e-14) continue;
      const double u = ((p.x - a.x) * (c.z - a.z) - (c.x - a.x) * (p.z - a.z)) / area;
      const double v = ((b.x - a.x) * (p.z - a.z) - (p.x - a.x) * (b.z - a.z)) / area;
      if (u < 0.0 || v < 0.0 || u + v > 1.0) continue;
      const double y = a.y + u * (b.y - a.y) + v * (c.y - a.y);
      most = std::max(most, lower_lip ? y - p.y : p.y - y);
    }
    if (most * 1000.0 <= kDepth_mm) return 0.0;
    double least = most;
    for (const Triangle& t : triangles) {
      least =
          std::min(least, distance_to_triangle(p, glm::dvec3(pose_.positions[t[0]]), glm::dvec3(pose_.positions[t[1]]),
                                               glm::dvec3(pose_.positions[t[2]])));
    }
    return least;
  }

  void look_at_lips() {
    fill(upper_cells_, upper_triangles_);
    fill(lower_cells_, lower_triangles_);
    for (const std::uint32_t v : upper_lip_) {
      const double depth = past_lip(lower_cells_, lower_triangles_, glm::dvec3(pose_.positions[v]), true);
      if (depth * 1000.0 > kDepth_mm) add("upper lip in lower lip", v, depth * 1000.0);
    }
    for (const std::uint32_t v : lower_lip_) {
      const double depth = past_lip(upper_cells_, upper_triangles_, glm::dvec3(pose_.positions[v]), false);
      if (depth * 1000.0 > kDepth_mm) add("lower lip in upper lip", v, depth * 1000.0);
    }
  }

  [[nodiscard]] glm::dvec3 to_jaw(const glm::dvec3& p) const {
    const runtime::FrameMotion& m = pose_.motions[static_cast<std::size_t>(runtime::Frame::jaw)];
    const glm::dvec3 pivot = b_.rig.pivot(runtime::Frame::jaw);
    return glm::inverse(m.rotation) * (p - pivot - m.translation) + pivot;
  }
  [[nodiscard]] glm::dvec3 from_jaw(const glm::dvec3& p) const {
    const runtime::FrameMotion& m = pose_.motions[static_cast<std::size_t>(runtime::Frame::jaw)];
    const glm::dvec3 pivot = b_.rig.pivot(runtime::Frame::jaw);
    return m.rotation * (p - pivot) + pivot + m.translation;
  }

  void look_at_teeth() {
    for (const std::uint32_t v : mouth_) {
      const glm::dvec3 p(pose_.positions[v]);
      const double depth = std::max(upper_row_.depth_m(p), lower_row_.depth_m(to_jaw(p)));
      if (depth * 1000.0 > kDepth_mm) add("skin in teeth", v, depth * 1000.0);
    }
  }

  // In front of the teeth's backs; what lies behind them is not seen.
  void look_at_tongue() {
    const std::vector<glm::vec3>& positions = pose_.parts[tongue_];
    static const Row upper_teeth(runtime::Frame::head, false);
    static const Row lower_teeth(runtime::Frame::jaw, false);
    for (std::size_t v = 0; v < positions.size(); ++v) {
      const glm::dvec3 in_jaw(positions[v]);
      const glm::dvec3 p = from_jaw(in_jaw);
      if (p.z < 0.098) continue;
      // What is still behind the lower row is not seen either.
      const double depth = std::max(upper_teeth.depth_m(p), in_jaw.z < 0.098 ? 0.0 : lower_teeth.depth_m(in_jaw));
      if (depth * 1000.0 > kDepth_mm) add_at("tongue in teeth", p, depth * 1000.0);
      const double past = std::max(past_lip(lower_cells_, lower_triangles_, p, true),
                                   past_lip(upper_cells_, upper_triangles_, p, false));
      if (past * 1000.0 > kDepth_mm) add_at("tongue in lip", p, past * 1000.0);
    }
  }

  const Bound& b_;
  double least_fold_mm_ = 0.0;
  runtime::Pose pose_;
  Row upper_row_, lower_row_;
  std::vector<Triangle> upper_triangles_, lower_triangles_;
  std::vector<std::uint32_t> upper_lip_, lower_lip_, mouth_, near_eye_;
  Cells upper_cells_, lower_cells_;
  glm::dvec3 eye_{0.0};
  double radius_ = 0.0;
  std::size_t tongue_ = 0;
  std::map<std::string, std::pair<double, glm::dvec3>> found_;
};

class Tally {
 public:
  void add(const std::vector<Finding>& findings, const std::string& what) {
    for (const Finding& f : findings) {
      ++count_[f.kind];
      auto& worst = worst_[f.kind];
      worst.emplace_back(f.mm, fmt::format("{}: {} near {}, {:.2f} mm", what, f.kind, f.place, f.mm));
    }
  }
  void report(const std::string& title) {
    for (auto& [kind, all] : worst_) {
      std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
      for (std::size_t i = 0; i < std::min<std::size_t>(all.size(), std::getenv("NMS_REPORT") != nullptr ? 60 : 4); ++i)
        ADD_FAILURE() << all[i].second;
      ADD_FAILURE() << title << ": " << kind << " in " << count_[kind] << " poses";
    }
  }

 private:
  std::map<std::string, int> count_;
  std::map<std::string, std::vector<std::pair<double, std::string>>> worst_;
};

TEST(AdaArtefacts, NoneAtRest) {
  Inspector inspector(all_units());
  Tally tally;
  tally.add(inspector.look(std::vector<float>(all_units().rig.channel_count(), 0.0F)), "rest");
  tally.report("at rest");
}

Tally inspect(const std::vector<fit_face::FacePose>& poses, double least_fold_mm = 0.0) {
  Inspector inspector(all_units(), least_fold_mm);
  Tally tally;
  for (const fit_face::FacePose& pose : poses) tally.add(inspector.look(pose.values), pose.what);
  return tally;
}

/// All, or under the sanitizers a few.
std::vector<fit_face::FacePose> some_of(const std::vector<fit_face::FacePose>& poses) {
  const std::size_t every = one_case_of(5);
  std::vector<fit_face::FacePose> some;
  for (std::size_t i = 0; i < poses.size(); i += every) some.push_back(poses[i]);
  return some;
}

TEST(AdaArtefacts, NoneUnderAnyUnit) {
  const auto poses = fit_face::each_unit(all_units().image.program(), all_units().rig);
  EXPECT_GT(poses.size(), 200U);
  inspect(poses).report("units");
}

TEST(AdaArtefacts, NoneUnderAnyPair) {
  const auto poses = fit_face::each_pair(all_units().image.program(), all_units().rig);
  EXPECT_GT(poses.size(), 1000U);
  inspect(some_of(poses), kLeastFoldOfPairs_mm).report("pairs");
}

TEST(AdaArtefacts, NoneUnderAThousandMixtures) {
  inspect(some_of(fit_face::mixtures(all_units().image.program(), 7, 1000)), kLeastFoldOfMixtures_mm)
      .report("mixtures");
}

}  // namespace
