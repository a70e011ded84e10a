#include <nms/runtime/face_fit.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/matrix.hpp>

#include <nms/runtime/mesh_normals.h>
#include <nms/runtime/places_at_rest.h>
#include <nms/runtime/region_shares.h>
#include <nms/runtime/seams.h>
#include <nms/runtime/space_cells.h>

#include "face_scene.h"
#include "space_warp.h"

namespace nms::runtime {

using program::Failure;

namespace {

constexpr int kRounds = 7;
constexpr double kReach = 0.015;         // how far a vertex looks for the scan                        [m]
constexpr double kSample = 0.008;        // distance of the warp's samples                             [m]
constexpr double kSampleBehind = 0.020;  // behind the ears                                            [m]
constexpr double kSameWay = 0.6;         // cosine of the largest angle between normals that match
constexpr double kStiffFirst = 0.004;    // of the first round, less in each                           [m]
constexpr double kStiffLast = 0.0002;    // [m]
constexpr double kSmallest = 0.4;        // of the face's size: a newborn's head is 0.6 of an adult's
constexpr double kLargest = 2.0;
constexpr std::size_t kFewest = 6;       // landmarks
constexpr std::size_t kFewestMet = 100;  // vertices that find the scan
constexpr double kInside = 0.1;          // share of a region inside the head from which on a vertex is not compared

glm::dvec3 mirror(const glm::dvec3& p) { return {-p.x, p.y, p.z}; }

std::string other_side(const std::string& name) {
  if (name.ends_with("_L")) return name.substr(0, name.size() - 1) + "R";
  if (name.ends_with("_R")) return name.substr(0, name.size() - 1) + "L";
  return name;
}

/// The scan's triangles in cells as wide as the reach.
class Scan {
 public:
  Scan(std::vector<glm::dvec3> points, const PolygonMesh& mesh) : points_(std::move(points)) {
    for (const PolygonMesh::Piece& piece : mesh.pieces) {
      triangles_.insert(triangles_.end(), piece.triangles.begin(), piece.triangles.end());
    }
    for (std::uint32_t i = 0; i < triangles_.size(); ++i) {
      const auto& t = triangles_[i];
      Sphere sphere{(points_[t[0]] + points_[t[1]] + points_[t[2]]) / 3.0, 0.0};
      for (const std::uint32_t v : t) sphere.radius = std::max(sphere.radius, glm::distance(points_[v], sphere.middle));
      spheres_.push_back(sphere);
      // A triangle as large as a house is no part of a face, and left out.
      const auto [a, b, c] = std::tuple(points_[t[0]], points_[t[1]], points_[t[2]]);
      cells_.add(i, glm::min(glm::min(a, b), c), glm::max(glm::max(a, b), c));
    }
  }

  /// The nearest place within reach whose triangle faces about the same way.
  [[nodiscard]] std::optional<glm::dvec3> nearest(const glm::dvec3& p, const glm::dvec3& normal) const {
    double best = kReach * kReach;
    std::optional<glm::dvec3> found;
    cells_.visit_near(p, [&](std::uint32_t i) {
      const auto& t = triangles_[i];
      // Further than its own size and what was found already.
      const glm::dvec3 to_middle = spheres_[i].middle - p;
      const double far = std::sqrt(best) + spheres_[i].radius;
      if (glm::dot(to_middle, to_middle) > far * far) return;
      const glm::dvec3 q = on_triangle(p, points_[t[0]], points_[t[1]], points_[t[2]]);
      const glm::dvec3 d = q - p;
      const double squared = glm::dot(d, d);
      if (squared >= best) return;
      const glm::dvec3 n = glm::cross(points_[t[1]] - points_[t[0]], points_[t[2]] - points_[t[0]]);
      const double length = std::sqrt(glm::dot(n, n));
      if (length <= 0.0 || glm::dot(n, normal) < kSameWay * length) return;
      best = squared;
      found = q;
    });
    return found;
  }

 private:
  /// Ericson, Real-Time Collision Detection, 5.1.5.
  static glm::dvec3 on_triangle(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
    const glm::dvec3 ab = b - a, ac = c - a, ap = p - a;
    const double d1 = glm::dot(ab, ap), d2 = glm::dot(ac, ap);
    if (d1 <= 0.0 && d2 <= 0.0) return a;
    const glm::dvec3 bp = p - b;
    const double d3 = glm::dot(ab, bp), d4 = glm::dot(ac, bp);
    if (d3 >= 0.0 && d4 <= d3) return b;
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) return a + d1 / (d1 - d3) * ab;
    const glm::dvec3 cp = p - c;
    const double d5 = glm::dot(ab, cp), d6 = glm::dot(ac, cp);
    if (d6 >= 0.0 && d5 <= d6) return c;
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) return a + d2 / (d2 - d6) * ac;
    const double va = d3 * d6 - d5 * d4;
    if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0) return b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b);
    const double sum = va + vb + vc;
    return sum > 0.0 ? a + vb / sum * ab + vc / sum * ac : a;
  }

  std::vector<glm::dvec3> points_;
  struct Sphere {
    glm::dvec3 middle{0.0};
    double radius = 0.0;
  };

  std::vector<std::array<std::uint32_t, 3>> triangles_;
  std::vector<Sphere> spheres_;  // about each
  SpaceCells cells_{kReach};
};

/// The rotation that turns `from` about its middle best onto `to` about its own (Horn 1987): the quaternion to the
/// largest eigenvalue of a symmetric matrix, by the power method on the matrix shifted to be positive.
glm::dmat3 rotation_between(std::span<const glm::dvec3> from, std::span<const glm::dvec3> to, glm::dvec3 from_middle,
                            glm::dvec3 to_middle) {
  double s[3][3] = {};
  for (std::size_t i = 0; i < from.size(); ++i) {
    const glm::dvec3 a = from[i] - from_middle;
    const glm::dvec3 b = to[i] - to_middle;
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) s[r][c] += a[r] * b[c];
    }
  }
  double n[4][4] = {
      {s[0][0] + s[1][1] + s[2][2], s[1][2] - s[2][1], s[2][0] - s[0][2], s[0][1] - s[1][0]},
      {0, s[0][0] - s[1][1] - s[2][2], s[0][1] + s[1][0], s[2][0] + s[0][2]},
      {0, 0, -s[0][0] + s[1][1] - s[2][2], s[1][2] + s[2][1]},
      {0, 0, 0, -s[0][0] - s[1][1] + s[2][2]},
  };
  double shift = 0.0;
  for (int r = 0; r < 4; ++r) {
    for (int c = 0; c < r; ++c) n[r][c] = n[c][r];
  }
  for (const auto& row : n)
    shift = std::max(shift, std::abs(row[0]) + std::abs(row[1]) + std::abs(row[2]) + std::abs(row[3]));
  double q[4] = {1.0, 0.1, 0.2, 0.3};
  for (int step = 0; step < 500; ++step) {
    double next[4];
    double length = 0.0;
    for (int r = 0; r < 4; ++r) {
      next[r] = shift * q[r];
      for (int c = 0; c < 4; ++c) next[r] += n[r][c] * q[c];
      length += next[r] * next[r];
    }
    length = std::sqrt(length);
    if (length <= 0.0) break;
    for (int r = 0; r < 4; ++r) q[r] = next[r] / length;
  }
  return glm::mat3_cast(glm::dquat(q[0], q[1], q[2], q[3]));
}

/// Puts every control point that a border owns where the border has it: a bent sum is not the sum of what is bent.
class Borders {
 public:
  tl::expected<void, Failure> read(const FaceFile& file) {
    SurfaceNet net;
    net.node_count = static_cast<std::uint32_t>(file.nodes.size());
    for (const FaceFileCurve& curve : file.curves) net.curves.push_back(curve.curve);
    for (std::size_t s = 0; s < file.surfaces.size(); ++s) {
      if (!file.surfaces[s].frame.empty() || !file.surfaces[s].rides.empty()) continue;
      net.surfaces.push_back(file.surfaces[s].geometry);
      surfaces_.push_back(s);
    }
    auto seams = build_seams(net);
    if (!seams) return tl::unexpected(seams.error());
    seams_ = std::move(*seams);
    return {};
  }

  void shut(FaceFile& file) const {
    std::vector<glm::dvec3> nodes(file.nodes.size(), glm::dvec3(0.0));
    for (const FaceFileCurve& c : file.curves) {
      if (c.curve.ends[0].node != kNoIndex) nodes[c.curve.ends[0].node] = c.points.front();
      if (c.curve.ends[1].node != kNoIndex) nodes[c.curve.ends[1].node] = c.points.back();
    }
    std::vector<glm::dvec3> x;
    for (const PointOwner& o : seams_.points) {
      x.push_back(o.kind == PointOwner::Kind::node    ? nodes[o.owner]
                  : o.kind == PointOwner::Kind::curve ? file.curves[o.owner].points[o.index]
                                                      : file.surfaces[surfaces_[o.owner]].points[o.index]);
    }
    const auto put = [&](const std::vector<Row>& rows, std::vector<glm::dvec3>& points) {
      for (std::size_t i = 0; i < rows.size(); ++i) {
        points[i] = glm::dvec3(0.0);
        for (const RowEntry& e : rows[i]) points[i] += e.weight * x[e.point];
      }
    };
    for (std::size_t c = 0; c < file.curves.size(); ++c) put(seams_.curves[c], file.curves[c].points);
    for (std::size_t s = 0; s < surfaces_.size(); ++s) put(seams_.surfaces[s], file.surfaces[surfaces_[s]].points);
  }

 private:
  Seams seams_;
  std::vector<std::size_t> surfaces_;  // of the file, by surface of the net
};

class Fit {
 public:
  Fit(FaceScene scene, std::string_view name, const Places& landmarks, Halves halves)
      : scene_(std::move(scene)), name_(name), places_(landmarks), alike_(halves == Halves::alike) {}

  tl::expected<FittedFace, Failure> run(const PolygonMesh& scan, double unit_m, const Places& marks) {
    if (auto read = borders_.read(scene_.file); !read) return tl::unexpected(read.error());
    if (auto failure = align(marks)) return tl::unexpected(std::move(*failure));
    std::vector<glm::dvec3> points;
    for (const glm::dvec3& p : scan.positions) points.push_back(back_ * (unit_m * p - result_.translation));
    const Scan target(std::move(points), scan);
    if (auto failure = meet_landmarks()) return tl::unexpected(std::move(*failure));
    for (int round = 0; round < kRounds; ++round) {
      auto failure = compare(target);
      if (failure) return tl::unexpected(std::move(*failure));
      if (round == 0) result_.before_mean_m = result_.mean_m;
      const double done = round / static_cast<double>(kRounds - 1);
      const auto warp = SpaceWarp::through(from_, to_, kStiffFirst + done * (kStiffLast - kStiffFirst));
      if (!warp) break;
      apply(*warp);
    }
    if (auto failure = compare(target)) return tl::unexpected(std::move(*failure));
    // A surface that is shown under a mirror too is written once.
    for (const SurfaceUse& use : scene_.uses) {
      if (glm::determinant(glm::dmat3(scene_.transforms[use.transform])) < 0.0) {
        scene_.file.surfaces[use.surface].mirrored = true;
      }
    }
    result_.file = std::move(scene_.file);
    result_.landmarks = std::move(places_);
    return std::move(result_);
  }

 private:
  // Turns and shifts the scan into the face's axes; its size stays.
  std::optional<Failure> align(const Places& marks) {
    std::vector<glm::dvec3> from;
    std::vector<glm::dvec3> to;
    for (const auto& [mark, place] : marks) {
      const auto own = places_.find(mark);
      if (own == places_.end()) continue;
      names_.push_back(mark);
      from.push_back(own->second);
      to.push_back(place);
    }
    result_.landmarks_used = from.size();
    if (from.size() < kFewest) {
      return Failure{
          "fit_few_landmarks", name_,
          fmt::format("only {} of its landmarks {} the face's too", from.size(), from.size() == 1 ? "is" : "are"),
          fmt::format("give at least {}, by the face's own names: nasion, mouth_corner_L ...", kFewest)};
    }
    glm::dvec3 from_middle(0.0);
    glm::dvec3 to_middle(0.0);
    for (std::size_t i = 0; i < from.size(); ++i) {
      from_middle += from[i] / static_cast<double>(from.size());
      to_middle += to[i] / static_cast<double>(from.size());
    }
    double own_size = 0.0;
    double scan_size = 0.0;
    for (std::size_t i = 0; i < from.size(); ++i) {
      own_size += glm::dot(from[i] - from_middle, from[i] - from_middle);
      scan_size += glm::dot(to[i] - to_middle, to[i] - to_middle);
    }
    // Spread out by less than a millimetre: one place, but for rounding.
    if (!(own_size > 1e-6) || !(scan_size > 1e-6)) {
      return Failure{"fit_flat_landmarks", name_, "the landmarks lie in one place", "give landmarks that are apart"};
    }
    const double scale = std::sqrt(scan_size / own_size);
    if (scale < kSmallest || scale > kLargest) {
      return Failure{"fit_other_size", name_,
                     fmt::format("the scan's landmarks are {:.3g} times as far apart as the face's", scale),
                     "look at the scan's unit"};
    }
    const std::vector<double> off = distances_off(from, to, from_middle, to_middle, scale);
    if (auto failure = look_for_mirror(from, to, from_middle, to_middle, scale)) return failure;
    note_furthest(off);
    result_.rotation = rotation_between(from, to, from_middle, to_middle);
    back_ = glm::transpose(result_.rotation);
    result_.translation = to_middle - scale * (result_.rotation * from_middle);
    for (const glm::dvec3& p : to) marks_.push_back(back_ * (p - result_.translation));
    return std::nullopt;
  }

  /// How far each landmark of the face, turned, scaled and shifted as a whole, is from where the scan has it.
  static std::vector<double> distances_off(std::span<const glm::dvec3> from, std::span<const glm::dvec3> to,
                                           glm::dvec3 from_middle, glm::dvec3 to_middle, double scale) {
    const glm::dmat3 turn = rotation_between(from, to, from_middle, to_middle);
    std::vector<double> off;
    for (std::size_t i = 0; i < from.size(); ++i)
      off.push_back(glm::distance(to[i] - to_middle, scale * (turn * (from[i] - from_middle))));
    return off;
  }

  /// A face and its mirror image are nearly alike, but no rotation takes one to the other: left and right exchanged, or
  /// a scan that was mirrored, turns the face inside out.
  std::optional<Failure> look_for_mirror(std::span<const glm::dvec3> from, std::span<const glm::dvec3> to,
                                         glm::dvec3 from_middle, glm::dvec3 to_middle, double scale) const {
    const auto mean = [&](std::span<const glm::dvec3> own, glm::dvec3 middle) {
      double sum = 0.0;
      for (const double d : distances_off(own, to, middle, to_middle, scale)) sum += d;
      return sum / static_cast<double>(to.size());
    };
    std::vector<glm::dvec3> mirrored;
    for (const glm::dvec3& p : from) mirrored.push_back(mirror(p));
    const double as_given = mean(from, from_middle);
    const double exchanged = mean(mirrored, mirror(from_middle));
    if (exchanged > 0.5 * as_given || as_given < 0.005) return std::nullopt;
    return Failure{
        "fit_mirrored", name_,
        fmt::format("left and right are exchanged: the face's landmarks are {:.0f} mm from the scan's in the "
                    "mean, their mirror images {:.0f} mm",
                    1000.0 * as_given, 1000.0 * exchanged),
        "_L is the subject's own left; if the names are right, the scan is mirrored"};
  }

  void note_furthest(const std::vector<double>& off) {
    std::vector<double> sorted = off;
    std::sort(sorted.begin(), sorted.end());
    result_.median_mark_off_m = sorted[sorted.size() / 2];
    const auto furthest = std::max_element(off.begin(), off.end());
    result_.furthest_mark_off_m = *furthest;
    result_.furthest_mark = names_[static_cast<std::size_t>(furthest - off.begin())];
  }

  std::optional<Failure> meet_landmarks() {
    std::vector<glm::dvec3> from;
    std::vector<glm::dvec3> to;
    for (std::size_t i = 0; i < names_.size(); ++i) {
      const std::string other = other_side(names_[i]);
      glm::dvec3 place = marks_[i];
      const auto pair = std::find(names_.begin(), names_.end(), other);
      if (other == names_[i]) {
        if (alike_) place.x = 0.0;
      } else if (pair != names_.end()) {
        if (alike_) place = 0.5 * (place + mirror(marks_[static_cast<std::size_t>(pair - names_.begin())]));
      } else if (const auto own = places_.find(other); own != places_.end()) {
        from.push_back(own->second);
        to.push_back(mirror(place));
      }
      from.push_back(places_.at(names_[i]));
      to.push_back(place);
    }
    const auto warp = SpaceWarp::through(from, to, 0.0);
    if (!warp) {
      return Failure{"fit_flat_landmarks", name_, "the landmarks lie in one plane, or two in one place",
                     "give landmarks on the nose and about the eyes, mouth and chin"};
    }
    apply(*warp);
    return std::nullopt;
  }

  // Space is bent; eyeballs go along as balls.
  void apply(const SpaceWarp& warp) {
    std::array<glm::dvec3, 2> centre{};
    std::array<glm::dvec3, 2> moved{};
    std::array<double, 2> scale{1.0, 1.0};
    for (std::size_t e = 0; e < 2; ++e) {
      const auto mark = places_.find(e == 0 ? "eye_centre_L" : "eye_centre_R");
      if (mark == places_.end()) continue;
      centre[e] = mark->second;
      moved[e] = warp(centre[e]);
      constexpr double kSpan = 0.012;  // an eyeball's radius [m]
      double sum = 0.0;
      for (int axis = 0; axis < 3; ++axis) {
        glm::dvec3 d(0.0);
        d[axis] = kSpan;
        sum += glm::length(warp(centre[e] + d) - warp(centre[e] - d)) / (2.0 * kSpan);
      }
      scale[e] = sum / 3.0;
    }
    const auto bend = [&](std::vector<glm::dvec3>& points, const std::string& frame) {
      const bool left = frame == "eye_left";
      const bool ball =
          (left || frame == "eye_right") && scale[left ? 0 : 1] > 0.0 && centre[left ? 0 : 1] != glm::dvec3(0.0);
      for (glm::dvec3& p : points) {
        const std::size_t e = left ? 0 : 1;
        glm::dvec3 q = ball ? moved[e] + scale[e] * (p - centre[e]) : warp(p);
        if (alike_ && p.x == 0.0) q.x = 0.0;  // halves meet there
        p = q;
      }
    };
    for (FaceFileCurve& curve : scene_.file.curves) bend(curve.points, "");
    for (FaceFileSurface& surface : scene_.file.surfaces) bend(surface.points, surface.frame);
    borders_.shut(scene_.file);
    for (auto& [mark, place] : places_) {
      const bool middle = alike_ && place.x == 0.0;
      place = warp(place);
      if (middle) place.x = 0.0;
    }
  }

  /// Places of the skin in one cube of space, and where they meet the scan: sums.
  struct Bin {
    glm::dvec3 from{0.0};
    glm::dvec3 to{0.0};
    double count = 0.0;
  };

  /// What of a face a scan can show: neither brows and hair, nor what lies inside mouth and nostrils.
  struct Outside {
    std::vector<glm::vec3> positions;  ///< V                                   [m]
    std::vector<glm::vec3> normals;    ///< V, of the bare skin
    std::vector<bool> seen;            ///< V
  };

  static Outside outside_of(const Face& face) {
    Outside out;
    for (const glm::dvec3& p : places_at_rest(face.skin)) out.positions.emplace_back(p);
    out.normals.resize(out.positions.size());
    out.seen.assign(out.positions.size(), false);
    std::vector<Primitive> bare;
    for (const Primitive& p : face.skin.primitives) {
      const std::string& material = face.materials[p.material].name;
      if (material == "brow" || material == "hair") continue;
      bare.push_back(p);
      for (const std::uint32_t v : p.triangles) out.seen[v] = true;
    }
    area_weighted_normals(bare, out.positions, out.normals);
    for (const char* inside : {"lining", "nostril"}) {
      const std::vector<float> shares = region_shares(face, inside);
      for (std::size_t v = 0; v < shares.size(); ++v)
        if (static_cast<double>(shares[v]) > kInside) out.seen[v] = false;
    }
    return out;
  }

  /// Where a place of the skin meets the scan; where both halves are one, in the mean of both sides.
  std::optional<glm::dvec3> met(const Scan& target, const glm::dvec3& p, const glm::dvec3& n,
                                std::vector<double>& distances) const {
    std::optional<glm::dvec3> q = target.nearest(p, n);
    if (q) distances.push_back(glm::distance(*q, p));
    if (!alike_) return q;
    const auto other = target.nearest(mirror(p), mirror(n));
    if (!other) return q;
    distances.push_back(glm::distance(*other, mirror(p)));
    return q ? 0.5 * (*q + mirror(*other)) : mirror(*other);
  }

  // Distances of the skin from the scan, and samples of where it should go.
  std::optional<Failure> compare(const Scan& target) {
    const auto face = build_face(scene_, name_, {});
    if (!face) return face.error();
    const Outside skin = outside_of(*face);
    std::map<std::array<std::int64_t, 4>, Bin> bins;
    const auto ear = places_.find("tragion_L");
    const double ears = ear != places_.end() ? ear->second.z : 0.0;
    std::vector<double> distances;
    for (std::size_t v = 0; v < skin.positions.size(); ++v) {
      const glm::dvec3 p(skin.positions[v]);
      if (!skin.seen[v] || (alike_ && p.x < 0.0)) continue;
      const std::optional<glm::dvec3> q = met(target, p, glm::dvec3(skin.normals[v]), distances);
      if (!q) continue;
      // What is behind the ears has no features to keep.
      const double width = p.z > ears ? kSample : kSampleBehind;
      const auto part = [&](double at) { return static_cast<std::int64_t>(std::floor(at / width)); };
      Bin& bin = bins[{part(p.x), part(p.y), part(p.z), p.z > ears ? 1 : 0}];
      bin.from += p;
      bin.to += *q;
      bin.count += 1.0;
    }
    if (auto failure = note_distances(std::move(distances))) return failure;
    take_samples(bins);
    return std::nullopt;
  }

  std::optional<Failure> note_distances(std::vector<double> distances) {
    result_.measured = distances.size();
    if (distances.size() < kFewestMet) {
      return Failure{"fit_far", name_,
                     fmt::format("{} places of the face find the scan within 15 mm", distances.size()),
                     "look at the scan's unit, and at the landmarks' names and places"};
    }
    std::sort(distances.begin(), distances.end());
    double sum = 0.0;
    for (const double d : distances) sum += d;
    result_.mean_m = sum / static_cast<double>(distances.size());
    result_.p95_m = distances[distances.size() * 95 / 100];
    return std::nullopt;
  }

  // The mean of what stands in one cube of space; where both halves are one, mirrored too.
  void take_samples(const std::map<std::array<std::int64_t, 4>, Bin>& bins) {
    from_.clear();
    to_.clear();
    for (const auto& [cell, bin] : bins) {
      glm::dvec3 from = bin.from / bin.count;
      glm::dvec3 to = bin.to / bin.count;
      if (alike_ && from.x < 0.25 * kSample) {
        from.x = to.x = 0.0;
      } else if (alike_) {
        from_.push_back(mirror(from));
        to_.push_back(mirror(to));
      }
      from_.push_back(from);
      to_.push_back(to);
    }
  }

  FaceScene scene_;
  Borders borders_;
  std::string name_;
  Places places_;
  bool alike_ = false;  // both halves are one
  FittedFace result_;
  glm::dmat3 back_{1.0};            // from the scan's axes to the face's
  std::vector<std::string> names_;  // landmarks that both have
  std::vector<glm::dvec3> marks_;   // the scan's, in the face's axes
  std::vector<glm::dvec3> from_;    // samples of the skin
  std::vector<glm::dvec3> to_;      // and where they should go
};

}  // namespace

tl::expected<FittedFace, Failure> fit_face(std::string_view x3d, std::string_view name, const Places& landmarks,
                                           const PolygonMesh& scan, double unit_m, const Places& marks, Halves halves) {
  auto scene = read_scene_x3d(x3d, name, NurbsText::xml, {});
  if (!scene) return tl::unexpected(scene.error());
  if (halves == Halves::each && !write_out_halves(*scene)) halves = Halves::alike;
  return Fit(std::move(*scene), name, landmarks, halves).run(scan, unit_m, marks);
}

}  // namespace nms::runtime
