#include "face_artefacts.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <nms/runtime/face_file.h>
#include <nms/runtime/places_at_rest.h>
#include <nms/runtime/region_shares.h>

namespace nms::test {

namespace {

// A triangle thinner than this is a line but for the rounding of single precision: it has no side to turn over.
constexpr double kLeastHeight = 1e-7;  // [m]
constexpr float kLipShare = 0.9F;
// Skin about an eyeball, and about the rows of teeth. [m], as all below on a head of ada's size
constexpr double kAboutEye = 0.040;
constexpr double kAboutTeeth = 0.025;
// What of the tongue is further behind the front of a row of teeth is not seen.
constexpr double kSeenBehindTeeth = 0.0075;
// Cells of lips' triangles, by x and z.
constexpr double kLipCell = 0.002;
constexpr int kLipCells = 90;
constexpr double kLipLow = -0.05;
// Cells of rows of teeth: along the arch, and by height.
constexpr int kAlong = 100;
constexpr int kHeights = 128;
constexpr double kHeightLow = -0.16;
constexpr double kHeightStep = 0.002;
// A shut eye is looked at from the front along lines that stand so far apart.
constexpr double kLineX = 0.0005;
constexpr double kLineY = 0.0001;

glm::dvec3 nearest_on_segment(const glm::dvec3& p, const glm::dvec3& u, const glm::dvec3& v) {
  const glm::dvec3 d = v - u;
  const double l = glm::dot(d, d);
  return u + (l > 0.0 ? std::clamp(glm::dot(p - u, d) / l, 0.0, 1.0) : 0.0) * d;
}

/// The triangle's nearest place, and the edge it lies on; 3: on none.
struct Nearest {
  glm::dvec3 place{0.0};
  std::size_t edge = 3;
};

Nearest nearest_on_triangle(const glm::dvec3& p, const std::array<glm::dvec3, 3>& t) {
  const glm::dvec3 n = glm::cross(t[1] - t[0], t[2] - t[0]);
  const double area = glm::dot(n, n);
  bool above = area > 0.0;
  for (std::size_t k = 0; k < 3 && above; ++k) above = glm::dot(glm::cross(t[(k + 1) % 3] - t[k], p - t[k]), n) >= 0.0;
  if (above) return {p - glm::dot(p - t[0], n) / area * n, 3};
  Nearest best;
  double least = 1e300;
  for (std::size_t k = 0; k < 3; ++k) {
    const glm::dvec3 q = nearest_on_segment(p, t[k], t[(k + 1) % 3]);
    const double d = glm::distance(p, q);
    if (d >= least) continue;
    least = d;
    best = {q, k};
  }
  return best;
}

double distance_to_triangle(const glm::dvec3& p, const std::array<glm::dvec3, 3>& t) {
  return glm::distance(p, nearest_on_triangle(p, t).place);
}

/// A lower bound that costs little.
bool further_than(double limit, const glm::dvec3& p, const std::array<glm::dvec3, 3>& t) {
  for (int k = 0; k < 3; ++k) {
    if (std::min({t[0][k], t[1][k], t[2][k]}) - p[k] >= limit) return true;
    if (p[k] - std::max({t[0][k], t[1][k], t[2][k]}) >= limit) return true;
  }
  return false;
}

bool is_shell(const std::string& material) { return material == "brow" || material == "hair" || material == "lashes"; }

}  // namespace

// ------------------------------------------------------------------------------------------------ rows of teeth

TeethRow::TeethRow(const runtime::Face& face, runtime::Frame frame, bool gums, double scale) : scale_(scale) {
  for (const runtime::RigidMesh& mesh : face.rigid) {
    const bool teeth = mesh.name.rfind("teeth", 0) == 0;
    if (mesh.frame != frame || !(teeth || (gums && mesh.name.rfind("gums", 0) == 0))) continue;
    for (const glm::vec3& p : mesh.positions) {
      low_ = glm::min(low_, glm::dvec3(p));
      high_ = glm::max(high_, glm::dvec3(p));
    }
    std::map<std::tuple<float, float, float>, std::uint32_t> place;
    std::vector<std::uint32_t> one;
    for (const glm::vec3& p : mesh.positions)
      one.push_back(place.try_emplace({p.x, p.y, p.z}, static_cast<std::uint32_t>(place.size())).first->second);
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    const auto each = [&](const auto& visit) {
      for (const runtime::Primitive& primitive : mesh.primitives)
        for (std::size_t i = 0; i + 2 < primitive.triangles.size(); i += 3) visit(&primitive.triangles[i]);
    };
    const auto edge = [&](const std::uint32_t* t, std::size_t k) {
      return std::pair(std::minmax(one[t[k]], one[t[(k + 1) % 3]]));
    };
    each([&](const std::uint32_t* t) {
      for (std::size_t k = 0; k < 3; ++k) ++edges[edge(t, k)];
    });
    each([&](const std::uint32_t* t) {
      Face f;
      for (std::size_t k = 0; k < 3; ++k) {
        f.corners[k] = glm::dvec3(mesh.positions[t[k]]);
        f.border[k] = edges[edge(t, k)] == 1;
      }
      triangles_.push_back(f);
    });
  }
  if (triangles_.empty()) return;
  back_ = low_.z - 1e-3 * scale_;
  front_ = high_.z;
  cells_.resize(static_cast<std::size_t>(kAlong * kHeights));
  for (std::size_t i = 0; i < triangles_.size(); ++i) {
    double a0 = 1.0, a1 = -1.0, y0 = 1e9, y1 = -1e9;
    for (const glm::dvec3& p : triangles_[i].corners) {
      a0 = std::min(a0, along(p)), a1 = std::max(a1, along(p));
      y0 = std::min(y0, p.y), y1 = std::max(y1, p.y);
      largest_ = std::max(largest_, std::hypot(p.x, p.z - back_));
    }
    const auto [from, to] = columns(a0, a1);
    for (int c = from; c <= to; ++c)
      for (int r = row_at(y0); r <= row_at(y1); ++r) cells_[cell(c, r)].push_back(static_cast<std::uint32_t>(i));
  }
}

// -1 at the far right of the arch, 0 in front, 1 at the far left.
double TeethRow::along(const glm::dvec3& p) const {
  const double z = std::max(p.z - back_, 1e-6);
  return p.x / (std::abs(p.x) + z);
}

std::pair<int, int> TeethRow::columns(double from, double to) {
  const auto at = [](double a) { return std::clamp(static_cast<int>((a + 1.0) * 0.5 * kAlong), 0, kAlong - 1); };
  return {at(from), at(to)};
}

int TeethRow::row_at(double y) const {
  return std::clamp(static_cast<int>((y / scale_ - kHeightLow) / kHeightStep), 0, kHeights - 1);
}

std::size_t TeethRow::cell(int column, int row) const { return static_cast<std::size_t>(column * kHeights + row); }

double TeethRow::depth_m(const glm::dvec3& p) const {
  if (triangles_.empty()) return 0.0;
  const double z = p.z - back_;
  const double distance = std::hypot(p.x, z);
  if (z <= 0.0 || distance >= largest_) return 0.0;
  const glm::dvec3 from(0.0, p.y, back_);
  const glm::dvec3 ray(p.x / distance, 0.0, z / distance);
  // Sheets passed outwards less those passed inwards: teeth may stand in their gums.
  int beyond = 0;
  double furthest = 0.0;
  for (const std::uint32_t i : cells_[cell(columns(along(p), along(p)).first, row_at(p.y))]) {
    const auto& [a, b, c] = triangles_[i].corners;
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
    beyond += det < 0.0 ? 1 : -1;
    furthest = std::max(furthest, t);
  }
  if (beyond <= 0 || furthest - distance < kArtefactDepth_mm * scale_ / 1000.0) return 0.0;
  return behind_nearest_m(p, furthest - distance);
}

double TeethRow::behind_nearest_m(const glm::dvec3& p, double at_most) const {
  double least = at_most;
  bool behind = true;
  for (const Face& f : triangles_) {
    if (further_than(least, p, f.corners)) continue;
    const Nearest nearest = nearest_on_triangle(p, f.corners);
    const double d = glm::distance(p, nearest.place);
    if (d >= least) continue;
    least = d;
    behind = nearest.edge == 3 || !f.border[nearest.edge];
  }
  return behind ? least : 0.0;
}

// ------------------------------------------------------------------------------------------------ the face

Inspector::Inspector(const runtime::Face& face, const runtime::Rig& rig, runtime::Landmarks landmarks,
                     InspectorSettings settings)
    : face_(face),
      rig_(rig),
      landmarks_(std::move(landmarks)),
      scale_(runtime::face_scale(landmarks_).length),
      settings_(settings),
      pose_(runtime::make_pose(face, rig)),
      rest_(runtime::places_at_rest(face.skin)),
      upper_row_(face, runtime::Frame::head, true, scale_),
      lower_row_(face, runtime::Frame::jaw, true, scale_),
      upper_teeth_(face, runtime::Frame::head, false, scale_),
      lower_teeth_(face, runtime::Frame::jaw, false, scale_) {
  find_skin();
  find_lips();
  find_eyes();
  for (std::size_t i = 0; i < face_.rigid.size(); ++i) {
    if (face_.rigid[i].name != "tongue") continue;
    tongue_ = i;
    has_tongue_ = !pose_.parts[i].empty();
  }
  if (has_tongue_) {
    rest_tongue_in_teeth_.assign(face_.rigid[tongue_].positions.size(), 0.0);
    rest_tongue_in_lip_ = rest_tongue_in_teeth_;
  }
  folded_at_rest_.assign(skin_.size(), 0);
  at_rest_ = look(std::vector<float>(rig.channel_count(), 0.0F));
  resting_ = false;
}

void Inspector::find_skin() {
  std::vector<char> used(rest_.size(), 0);
  for (const runtime::Primitive& p : face_.skin.primitives) {
    if (is_shell(face_.materials[p.material].name)) continue;
    for (std::size_t i = 0; i + 2 < p.triangles.size(); i += 3) {
      skin_.push_back({p.triangles[i], p.triangles[i + 1], p.triangles[i + 2]});
      for (const std::uint32_t v : skin_.back()) used[v] = 1;
    }
  }
  const std::vector<float> lining = runtime::region_shares(face_, "lining");
  const std::vector<float> upper = runtime::region_shares(face_, "lip_upper");
  const std::vector<float> lower = runtime::region_shares(face_, "lip_lower");
  const double about = kAboutTeeth * scale_;
  const auto near = [&](const TeethRow& row, const glm::dvec3& p) {
    if (row.empty()) return false;
    for (int k = 0; k < 3; ++k)
      if (p[k] < row.low()[k] - about || p[k] > row.high()[k] + about) return false;
    return true;
  };
  for (std::uint32_t v = 0; v < rest_.size(); ++v) {
    if (!settings_.lining && lining[v] > 0.0F && std::max(upper[v], lower[v]) < 0.5F) continue;
    if (used[v] != 0 && (near(upper_row_, rest_[v]) || near(lower_row_, rest_[v]))) mouth_.push_back(v);
  }
  rest_in_teeth_.assign(mouth_.size(), 0.0);
}

void Inspector::find_lips() {
  for (std::size_t i = 0; i < 2; ++i) {
    const std::vector<float> share = runtime::region_shares(face_, i == 0 ? "lip_upper" : "lip_lower");
    Lip& lip = lips_[i];
    lip.cells.resize(static_cast<std::size_t>(kLipCells * kLipCells));
    std::vector<char> used(rest_.size(), 0);
    for (const Triangle& t : skin_) {
      for (const std::uint32_t v : t) used[v] = 1;
      if (std::min({share[t[0]], share[t[1]], share[t[2]]}) >= kLipShare) lip.triangles.push_back(t);
    }
    for (std::uint32_t v = 0; v < rest_.size(); ++v)
      if (used[v] != 0 && share[v] >= kLipShare) lip.vertices.push_back(v);
    rest_past_lip_[i].assign(lip.vertices.size(), 0.0);
  }
}

void Inspector::find_eyes() {
  for (std::size_t e = 0; e < runtime::kEyeCount; ++e) {
    const auto centre = landmarks_.find(e == 0 ? "eye_centre_L" : "eye_centre_R");
    if (centre == landmarks_.end()) continue;
    Eye eye;
    eye.centre = centre->second;
    eye.state = e;
    for (const runtime::RigidMesh& mesh : face_.rigid) {
      if (mesh.frame != (e == 0 ? runtime::Frame::eye_left : runtime::Frame::eye_right)) continue;
      for (const glm::vec3& p : mesh.positions)
        eye.radius = std::max(eye.radius, glm::distance(glm::dvec3(p), eye.centre));
    }
    if (eye.radius == 0.0) continue;
    for (std::uint32_t i = 0; i < skin_.size(); ++i) {
      double nearest = 1e9;
      for (const std::uint32_t v : skin_[i]) nearest = std::min(nearest, glm::distance(rest_[v], eye.centre));
      if (nearest < kAboutEye * scale_) eye.triangles.push_back(i);
    }
    eye.rest_depth.assign(eye.triangles.size(), 0.0);
    eyes_.push_back(std::move(eye));
  }
}

// ------------------------------------------------------------------------------------------------ looking

void Inspector::add(const std::string& kind, std::uint32_t vertex, double metres) {
  add_at(kind, rest_[vertex], metres);
}

void Inspector::add_at(const std::string& kind, const glm::dvec3& place, double metres) {
  auto& worst = found_[kind];
  const double mm = 1000.0 * metres / scale_;
  if (mm > worst.first) worst = {mm, place};
}

// By how much it is deeper than at rest; 0 where that is let pass.
double Inspector::beyond_rest(std::vector<double>& rest, std::size_t i, double depth) const {
  if (resting_) rest[i] = depth;
  const double deeper = resting_ ? depth : depth - rest[i];
  return deeper * 1000.0 > kArtefactDepth_mm * scale_ ? deeper : 0.0;
}

std::vector<Artefact> Inspector::look(std::span<const float> values) {
  runtime::pose_face(face_, rig_, values, pose_);
  found_.clear();
  look_for_lost();
  look_for_folds();
  look_at_eyes();
  look_at_lips();
  look_at_teeth();
  look_at_tongue();
  std::vector<Artefact> out;
  for (const auto& [kind, worst] : found_)
    out.push_back({kind, runtime::nearest_landmark(landmarks_, worst.second), worst.second, worst.first});
  return out;
}

void Inspector::look_for_lost() {
  for (std::uint32_t v = 0; v < pose_.positions.size(); ++v) {
    const glm::vec3 p = pose_.positions[v] + pose_.normals[v];
    if (!(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z))) add("NaN", v, 1e6);
  }
}

// Whether the triangle is turned by more than 90 degrees against its vertices' normals together.
bool Inspector::folded(const Triangle& t) const {
  const glm::dvec3 a = now(t[0]), b = now(t[1]), c = now(t[2]);
  const glm::dvec3 n = glm::cross(b - a, c - a);
  const double longest = std::max({glm::distance(a, b), glm::distance(b, c), glm::distance(c, a)});
  if (glm::length(n) <= longest * kLeastHeight * scale_) return false;
  return glm::dot(n, glm::dvec3(pose_.normals[t[0]] + pose_.normals[t[1]] + pose_.normals[t[2]])) < 0.0;
}

void Inspector::look_for_folds() {
  for (std::size_t i = 0; i < skin_.size(); ++i) {
    const Triangle& t = skin_[i];
    if (!folded(t)) continue;
    if (resting_) folded_at_rest_[i] = 1;
    if (!resting_ && folded_at_rest_[i] != 0) continue;
    const double side = std::sqrt(0.5 * glm::length(glm::cross(now(t[1]) - now(t[0]), now(t[2]) - now(t[0]))));
    add("folded skin", t[0], side);
  }
}

void Inspector::look_at_eyes() {
  for (Eye& eye : eyes_) {
    for (std::size_t i = 0; i < eye.triangles.size(); ++i) {
      const Triangle& t = skin_[eye.triangles[i]];
      // What faces the ball is a lid's back or lies behind it: it is not seen.
      const std::array<glm::dvec3, 3> corners{now(t[0]), now(t[1]), now(t[2])};
      const glm::dvec3 nearest = nearest_on_triangle(eye.centre, corners).place - eye.centre;
      const bool seen = glm::dot(glm::cross(corners[1] - corners[0], corners[2] - corners[0]), nearest) > 0.0;
      const double depth = seen && nearest.z > 0.0 ? eye.radius - glm::length(nearest) : 0.0;
      const double deeper = beyond_rest(eye.rest_depth, i, std::max(depth, 0.0));
      if (deeper > 0.0) add("skin in eyeball", t[0], deeper);
    }
    const runtime::LidState& lids = pose_.lids[eye.state];
    if (lids.upper + lids.lower >= 1.0) look_at_shut(eye);
  }
}

// How much of the eyeball can be seen from the front, by its height.
void Inspector::look_at_shut(const Eye& eye) {
  const int columns = static_cast<int>(2.0 * eye.radius / (kLineX * scale_)) + 1;
  const int rows = static_cast<int>(2.0 * eye.radius / (kLineY * scale_)) + 1;
  const auto x_of = [&](int c) { return eye.centre.x - eye.radius + c * kLineX * scale_; };
  const auto y_of = [&](int r) { return eye.centre.y - eye.radius + r * kLineY * scale_; };
  std::vector<char> covered(static_cast<std::size_t>(columns * rows), 0);
  for (const std::uint32_t i : eye.triangles) {
    const glm::dvec3 a = now(skin_[i][0]), b = now(skin_[i][1]), c = now(skin_[i][2]);
    const double area = (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
    if (std::abs(area) < 1e-16) continue;
    const auto first = [&](double low, double from, double step) {
      return std::max(static_cast<int>(std::ceil((low - from) / step)), 0);
    };
    for (int col = first(std::min({a.x, b.x, c.x}), x_of(0), kLineX * scale_);
         col < columns && x_of(col) <= std::max({a.x, b.x, c.x}); ++col) {
      for (int row = first(std::min({a.y, b.y, c.y}), y_of(0), kLineY * scale_);
           row < rows && y_of(row) <= std::max({a.y, b.y, c.y}); ++row) {
        const double px = x_of(col), py = y_of(row);
        const double u = ((px - a.x) * (c.y - a.y) - (c.x - a.x) * (py - a.y)) / area;
        const double v = ((b.x - a.x) * (py - a.y) - (px - a.x) * (b.y - a.y)) / area;
        if (u < 0.0 || v < 0.0 || u + v > 1.0) continue;
        const double z = a.z + u * (b.z - a.z) + v * (c.z - a.z) - eye.centre.z;
        const double dx = px - eye.centre.x, dy = py - eye.centre.y;
        const double ball = eye.radius * eye.radius - dx * dx - dy * dy;
        if (ball <= 0.0 || z >= std::sqrt(ball) - 1e-5 * scale_)
          covered[static_cast<std::size_t>(col * rows + row)] = 1;
      }
    }
  }
  for (int col = 0; col < columns; ++col) {
    for (int row = 0, open = 0; row < rows; ++row) {
      const double dx = x_of(col) - eye.centre.x, dy = y_of(row) - eye.centre.y;
      const bool ball = dx * dx + dy * dy < eye.radius * eye.radius;
      open = ball && covered[static_cast<std::size_t>(col * rows + row)] == 0 ? open + 1 : 0;
      if (open * kLineY * 1000.0 > kArtefactDepth_mm)
        add_at("shut eye shows", {x_of(col), y_of(row), eye.centre.z + eye.radius}, open * kLineY * scale_);
    }
  }
}

std::size_t Inspector::lip_cell(double x, double z) const {
  const auto at = [&](double w) {
    return std::clamp(static_cast<int>((w / scale_ - kLipLow) / kLipCell), 0, kLipCells - 1);
  };
  return static_cast<std::size_t>(at(x) * kLipCells + at(z));
}

void Inspector::fill(Lip& lip) const {
  for (auto& c : lip.cells) c.clear();
  for (std::uint32_t i = 0; i < lip.triangles.size(); ++i) {
    const Triangle& t = lip.triangles[i];
    const glm::dvec3 low = glm::min(now(t[0]), glm::min(now(t[1]), now(t[2])));
    const glm::dvec3 high = glm::max(now(t[0]), glm::max(now(t[1]), now(t[2])));
    const std::size_t first = lip_cell(low.x, low.z), last = lip_cell(high.x, high.z);
    for (std::size_t x = first / kLipCells; x <= last / kLipCells; ++x)
      for (std::size_t z = first % kLipCells; z <= last % kLipCells; ++z) lip.cells[x * kLipCells + z].push_back(i);
  }
}

// How far p is past the lip: below the highest sheet of the lower lip at its x and z, or above the lowest of the upper.
double Inspector::past_lip(const Lip& lip, const glm::dvec3& p, bool lower_lip) const {
  double most = 0.0;
  for (const std::uint32_t i : lip.cells[lip_cell(p.x, p.z)]) {
    const Triangle& t = lip.triangles[i];
    const glm::dvec3 a = now(t[0]), b = now(t[1]), c = now(t[2]);
    const double area = (b.x - a.x) * (c.z - a.z) - (c.x - a.x) * (b.z - a.z);
    if (std::abs(area) < 1e-14) continue;
    const double u = ((p.x - a.x) * (c.z - a.z) - (c.x - a.x) * (p.z - a.z)) / area;
    const double v = ((b.x - a.x) * (p.z - a.z) - (p.x - a.x) * (b.z - a.z)) / area;
    if (u < 0.0 || v < 0.0 || u + v > 1.0) continue;
    const double y = a.y + u * (b.y - a.y) + v * (c.y - a.y);
    most = std::max(most, lower_lip ? y - p.y : p.y - y);
  }
  if (most * 1000.0 <= kArtefactDepth_mm * scale_) return 0.0;
  double least = most;
  for (const Triangle& t : lip.triangles) {
    const std::array<glm::dvec3, 3> corners{now(t[0]), now(t[1]), now(t[2])};
    if (!further_than(least, p, corners)) least = std::min(least, distance_to_triangle(p, corners));
  }
  return least;
}

void Inspector::look_at_lips() {
  for (Lip& lip : lips_) fill(lip);
  for (std::size_t i = 0; i < 2; ++i) {
    const char* kind = i == 0 ? "upper lip in lower lip" : "lower lip in upper lip";
    for (std::size_t k = 0; k < lips_[i].vertices.size(); ++k) {
      const std::uint32_t v = lips_[i].vertices[k];
      const double deeper = beyond_rest(rest_past_lip_[i], k, past_lip(lips_[1 - i], now(v), i == 0));
      if (deeper > 0.0) add(kind, v, deeper);
    }
  }
}

glm::dvec3 Inspector::to_jaw(const glm::dvec3& p) const {
  const runtime::FrameMotion& m = pose_.motions[static_cast<std::size_t>(runtime::Frame::jaw)];
  const glm::dvec3 pivot = rig_.pivot(runtime::Frame::jaw);
  return glm::inverse(m.rotation) * (p - pivot - m.translation) + pivot;
}

glm::dvec3 Inspector::from_jaw(const glm::dvec3& p) const {
  const runtime::FrameMotion& m = pose_.motions[static_cast<std::size_t>(runtime::Frame::jaw)];
  const glm::dvec3 pivot = rig_.pivot(runtime::Frame::jaw);
  return m.rotation * (p - pivot) + pivot + m.translation;
}

void Inspector::look_at_teeth() {
  for (std::size_t k = 0; k < mouth_.size(); ++k) {
    const glm::dvec3 p = now(mouth_[k]);
    const double depth = std::max(upper_row_.depth_m(p), lower_row_.depth_m(to_jaw(p)));
    const double deeper = beyond_rest(rest_in_teeth_, k, depth);
    if (deeper > 0.0) add("skin in teeth", mouth_[k], deeper);
  }
}

// In front of the teeth's backs; what lies behind them is not seen.
void Inspector::look_at_tongue() {
  if (!has_tongue_) return;
  const std::vector<glm::vec3>& positions = pose_.parts[tongue_];
  const double front = std::min(upper_teeth_.front_z(), lower_teeth_.front_z()) - kSeenBehindTeeth * scale_;
  for (std::size_t v = 0; v < positions.size(); ++v) {
    const glm::dvec3 in_jaw(positions[v]);
    const glm::dvec3 p = from_jaw(in_jaw);
    if (p.z < front) continue;
    // What is still behind the lower row is not seen either.
    const double depth = std::max(upper_teeth_.depth_m(p), in_jaw.z < front ? 0.0 : lower_teeth_.depth_m(in_jaw));
    const double deeper = beyond_rest(rest_tongue_in_teeth_, v, depth);
    if (deeper > 0.0) add_at("tongue in teeth", p, deeper);
    const double past =
        beyond_rest(rest_tongue_in_lip_, v, std::max(past_lip(lips_[1], p, true), past_lip(lips_[0], p, false)));
    if (past > 0.0) add_at("tongue in lip", p, past);
  }
}

// ------------------------------------------------------------------------------------------------ tally

void ArtefactTally::add(const std::vector<Artefact>& found, const std::string& pose) {
  ++poses_;
  for (const Artefact& a : found) {
    of_[a.kind].emplace_back(a.mm, fmt::format("{}: {} near {} ({:.1f}, {:.1f}, {:.1f}), {:.2f} mm", pose, a.kind,
                                               a.place, a.at.x * 1e3, a.at.y * 1e3, a.at.z * 1e3, a.mm));
  }
}

std::string ArtefactTally::past(const std::vector<ArtefactLimit>& limits) const {
  std::string out;
  for (const auto& [kind, all] : of_) {
    const auto limit =
        std::find_if(limits.begin(), limits.end(), [&k = kind](const ArtefactLimit& l) { return l.kind == k; });
    const ArtefactLimit allowed = limit == limits.end() ? ArtefactLimit{kind} : *limit;
    const auto worst = std::max_element(all.begin(), all.end());
    const double share = static_cast<double>(all.size()) / poses_;
    if (worst->first <= allowed.mm && share <= allowed.share) continue;
    out += fmt::format("{}: {} of {} poses, {:.1f} % allowed; worst {:.2f} mm, {:.2f} mm allowed: {}\n", kind,
                       all.size(), poses_, 100.0 * allowed.share, worst->first, allowed.mm, worst->second);
  }
  return out;
}

std::string ArtefactTally::text(std::size_t most) const {
  std::string out;
  for (auto [kind, all] : of_) {
    std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
    out += fmt::format("{} in {} of {} poses, up to {:.2f} mm\n", kind, all.size(), poses_, all[0].first);
    for (std::size_t i = 0; i < std::min(all.size(), most); ++i) out += fmt::format("  {}\n", all[i].second);
  }
  return out;
}

}  // namespace nms::test
