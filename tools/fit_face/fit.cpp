#include "fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <optional>

#include <fmt/format.h>
#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>
#include <glm/geometric.hpp>

#include "pieces.h"

namespace nms::fit_face {

using runtime::Derivative;
using runtime::Row;
using runtime::RowEntry;

namespace {

// Weight of the pull along the surface, round by round: first the parameters hold the samples, then the normals do.
constexpr std::array<double, 6> kTangential = {1.0, 0.5, 0.3, 0.2, 0.2, 0.2};
// A seam that slides freely folds.
constexpr double kLeastSeamTangential = 0.35;
// Second differences of control points: 1.5 sqrt(2e-4). Twice that misses the bars at the ear, half of it folds
// more triangles.
constexpr double kFairness = 1.5 * 0.014142135623730951;
// A twist shows more than a bend.
constexpr double kTwist = 1.4;
constexpr double kTangentPlane = 1.0;
constexpr double kFeature = 0.7;
constexpr double kMidline = 1e3;  // as good as exact
constexpr double kRingCut = 3.0;
// Furthest a foot point goes in one round, in spans.
constexpr double kStep = 0.3;

struct Sample {
  std::uint32_t surface = 0;
  double u = 0.0, v = 0.0;
  glm::dvec3 p{0.0}, n{0.0};
  double area = 0.0;
  bool seam = false;
};

/// Rows of a least-squares problem over the coordinates x, y, z of every independent point.
struct Equations {
  std::vector<Eigen::Triplet<double>> triplets;
  std::vector<double> rhs;
  void row(const Row& points, const glm::dvec3& direction, double target, double weight) {
    const int i = static_cast<int>(rhs.size());
    for (const RowEntry& e : points) {
      for (int k = 0; k < 3; ++k) {
        if (direction[k] != 0.0)
          triplets.emplace_back(i, static_cast<int>(3 * e.point) + k, weight * e.weight * direction[k]);
      }
    }
    rhs.push_back(weight * target);
  }
  void all(const Row& r, const glm::dvec3& target, double weight) {
    row(r, {1, 0, 0}, target.x, weight);
    row(r, {0, 1, 0}, target.y, weight);
    row(r, {0, 0, 1}, target.z, weight);
  }
};

class Fitter {
 public:
  Fitter(const Scan& scan, const Layout& layout) : scan_(scan) { model_.layout = layout; }

  Model run() {
    pieces_.emplace(scan_, model_.layout);
    make_net();
    collect();
    for (std::size_t round = 0; round < kTangential.size(); ++round) {
      if (round > 0) foot_points();
      solve(kTangential[round]);
    }
    fmt::print("rms to samples {:.4f} mm\n", rms());
    for (std::uint32_t p = 0; p < model_.x.size(); ++p) {
      if (midline_[p]) model_.x[p].x = 0.0;
    }
    return std::move(model_);
  }

 private:
  void make_net() {
    std::map<std::uint32_t, std::pair<std::string, double>> inner;  // vertices inside a curve
    for (const auto& c : model_.layout.curves) {
      for (std::size_t k = 1; k + 1 < c.knots.size(); ++k) {
        if (!inner.try_emplace(c.knots[k].first, c.name, c.knots[k].second).second) fail("two curves own a node");
      }
    }
    std::map<std::uint32_t, std::uint32_t> nodes;
    std::map<std::string, std::uint32_t> index;
    for (std::uint32_t i = 0; i < model_.layout.curves.size(); ++i) index[model_.layout.curves[i].name] = i;
    for (const auto& c : model_.layout.curves) {
      runtime::MasterCurve curve{
          c.name, 3, runtime::clamped_uniform_knots(3, static_cast<std::size_t>(c.knots.back().second)), {}};
      for (std::size_t e = 0; e < 2; ++e) {
        const std::uint32_t v = e == 0 ? c.knots.front().first : c.knots.back().first;
        if (const auto found = inner.find(v); found != inner.end()) {
          curve.ends[e].curve = index[found->second.first];
          curve.ends[e].at = found->second.second;
          continue;
        }
        const auto [found, fresh] = nodes.try_emplace(v, static_cast<std::uint32_t>(model_.nodes.size()));
        if (fresh) model_.nodes.push_back(fmt::format("n{}", v));
        curve.ends[e].node = found->second;
      }
      model_.net.curves.push_back(std::move(curve));
    }
    model_.net.node_count = static_cast<std::uint32_t>(model_.nodes.size());
    for (const auto& s : model_.layout.surfaces) {
      runtime::NetSurface surface;
      surface.name = s.name;
      const auto spans = [&](std::size_t k) { return std::abs(s.sides[k].to - s.sides[k].from); };
      surface.knots_u = runtime::clamped_uniform_knots(3, static_cast<std::size_t>(std::max(spans(0), spans(2))));
      surface.knots_v = runtime::clamped_uniform_knots(3, static_cast<std::size_t>(std::max(spans(1), spans(3))));
      surface.sides.emplace();
      for (std::size_t k = 0; k < 4; ++k)
        (*surface.sides)[k] = {index[s.sides[k].curve], s.sides[k].from, s.sides[k].to};
      model_.net.surfaces.push_back(std::move(surface));
    }
    auto seams = runtime::build_seams(model_.net);
    if (!seams) fail(seams.error().place + ": " + seams.error().cause);
    model_.seams = std::move(*seams);
    model_.x.assign(model_.seams.points.size(), glm::dvec3(0.0));
    midline_.assign(model_.x.size(), 0);
    std::size_t controls = 0;
    for (std::uint32_t c = 0; c < model_.net.curves.size(); ++c) {
      if (!model_.layout.curves[c].midline) continue;
      for (const Row& row : model_.seams.curves[c]) {
        for (const RowEntry& e : row) midline_[e.point] = 1;
      }
    }
    for (const auto& s : model_.seams.surfaces) controls += s.size();
    fmt::print("{} control points, {} independent\n", controls, model_.x.size());
  }

  // Vertices and triangle centres of the scan, each with half the area around it.
  void collect() {
    for (const auto& [s, r] : pieces_->pieces()) {
      if (model_.layout.surfaces[s].part == "lid_back") continue;  // built by rule
      std::vector<double> area(r.vertex.size(), 0.0);
      std::vector<char> seam(r.vertex.size(), 0);
      for (const auto l : r.loop) seam[l] = 1;
      const auto p = [&](std::uint32_t l) {
        return seam[l] ? pieces_->place(r.vertex[l]) : scan_.positions[r.vertex[l]];
      };
      for (const auto& t : r.triangles) {
        const glm::dvec3 n = glm::cross(p(t[1]) - p(t[0]), p(t[2]) - p(t[0]));
        const double size = 0.5 * glm::length(n);
        for (const auto l : t) area[l] += size / 3.0;
        Sample c{s,
                 (r.u[t[0]] + r.u[t[1]] + r.u[t[2]]) / 3.0,
                 (r.v[t[0]] + r.v[t[1]] + r.v[t[2]]) / 3.0,
                 (p(t[0]) + p(t[1]) + p(t[2])) / 3.0,
                 size > 1e-12 ? glm::normalize(n) : glm::dvec3(0, 0, 1),
                 0.5 * size,
                 false};
        samples_.push_back(c);
      }
      for (std::uint32_t l = 0; l < r.vertex.size(); ++l) {
        samples_.push_back({s, r.u[l], r.v[l], p(l), scan_.normals[r.vertex[l]], 0.5 * area[l], seam[l] != 0});
      }
    }
  }

  void solve(double t) {
    Equations b;
    for (const Sample& s : samples_) {
      const Row row = runtime::surface_row(model_.net, model_.seams, s.surface, s.u, s.v);
      const double w = std::sqrt(std::max(s.area, 1e-6));
      b.row(row, s.n, glm::dot(s.n, s.p), w);
      b.all(row, s.p, w * (s.seam ? std::max(t, kLeastSeamTangential) : t));
    }
    const double fair = kFairness;
    for (std::uint32_t s = 0; s < model_.net.surfaces.size(); ++s) {
      const auto& rows = model_.seams.surfaces[s];
      const std::size_t nu = model_.net.surfaces[s].count_u(), nv = model_.net.surfaces[s].count_v();
      const auto at = [&](std::size_t u, std::size_t v) { return &rows[u + nu * v]; };
      for (std::size_t v = 0; v < nv; ++v) {
        for (std::size_t u = 0; u < nu; ++u) {
          if (u + 2 < nu) {
            const Row* r[] = {at(u, v), at(u + 1, v), at(u + 2, v)};
            const double w[] = {1, -2, 1};
            b.all(runtime::combine(r, w), glm::dvec3(0), fair);
          }
          if (v + 2 < nv) {
            const Row* r[] = {at(u, v), at(u, v + 1), at(u, v + 2)};
            const double w[] = {1, -2, 1};
            b.all(runtime::combine(r, w), glm::dvec3(0), fair);
          }
          if (u + 1 < nu && v + 1 < nv) {
            const Row* r[] = {at(u, v), at(u + 1, v), at(u, v + 1), at(u + 1, v + 1)};
            const double w[] = {1, -1, -1, 1};
            b.all(runtime::combine(r, w), glm::dvec3(0), kTwist * fair);
          }
        }
      }
      if (model_.layout.surfaces[s].part == "lid_back") continue;
      seam_planes(s, b);
    }
    for (std::uint32_t c = 0; c < model_.net.curves.size(); ++c) {
      const LayoutCurve& curve = model_.layout.curves[c];
      if (!curve.feature) continue;
      const auto& at = pieces_->parameters(curve.name);
      for (std::size_t i = 0; i < at.size(); ++i) {
        const double length =
            0.5 * (glm::length(pieces_->place(curve.vertices[i]) - pieces_->place(curve.vertices[i > 0 ? i - 1 : 0])) +
                   glm::length(pieces_->place(curve.vertices[i]) -
                               pieces_->place(curve.vertices[std::min(i + 1, at.size() - 1)])));
        b.all(runtime::curve_row(model_.net, model_.seams, c, at[i]), pieces_->place(curve.vertices[i]),
              kFeature * std::sqrt(std::max(length, 0.02)));
      }
    }
    for (std::uint32_t p = 0; p < model_.x.size(); ++p) {
      if (midline_[p]) b.row({{p, 1.0}}, {1, 0, 0}, 0.0, kMidline);
    }
    Eigen::SparseMatrix<double> a(static_cast<Eigen::Index>(b.rhs.size()),
                                  static_cast<Eigen::Index>(3 * model_.x.size()));
    a.setFromTriplets(b.triplets.begin(), b.triplets.end());
    const Eigen::Map<Eigen::VectorXd> rhs(b.rhs.data(), static_cast<Eigen::Index>(b.rhs.size()));
    Eigen::SparseMatrix<double> normal = a.transpose() * a;
    Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(normal);
    if (solver.info() != Eigen::Success) fail("the equations have no solution");
    const Eigen::VectorXd y = solver.solve(a.transpose() * rhs);
    for (std::size_t p = 0; p < model_.x.size(); ++p) {
      const auto i = static_cast<Eigen::Index>(3 * p);
      model_.x[p] = {y[i], y[i + 1], y[i + 2]};
    }
  }

  // Both neighbours of a seam get the scan's normal there, so they meet without a crease.
  void seam_planes(std::uint32_t s, Equations& b) {
    const LayoutSurface& surface = model_.layout.surfaces[s];
    const double spans_u = model_.net.surfaces[s].knots_u.back(), spans_v = model_.net.surfaces[s].knots_v.back();
    const bool ring =
        surface.sides[1].curve == surface.sides[3].curve || surface.sides[0].curve == surface.sides[2].curve;
    for (std::size_t k = 0; k < 4; ++k) {
      const LayoutCurve& curve = pieces_->layout_curve(surface.sides[k].curve);
      const auto side = pieces_->side_vertices(surface.sides[k]);
      const bool along_u = k % 2 == 0;
      const int points = static_cast<int>(2 * (along_u ? spans_u : spans_v));
      const bool cut_side = ring && surface.sides[k].curve == surface.sides[(k + 2) % 4].curve;
      for (int i = 0; i < points; ++i) {
        const double f = (i + 0.5) / points;
        const double share = k >= 2 ? 1.0 - f : f;
        const double t = surface.sides[k].from + share * (surface.sides[k].to - surface.sides[k].from);
        const double u = along_u ? f * spans_u : (k == 1 ? spans_u : 0.0);
        const double v = along_u ? (k == 2 ? spans_v : 0.0) : f * spans_v;
        const Row across =
            runtime::surface_row(model_.net, model_.seams, s, u, v, along_u ? Derivative::v : Derivative::u);
        if (curve.midline) {
          b.row(across, {0, 1, 0}, 0.0, 1.0);
          b.row(across, {0, 0, 1}, 0.0, 1.0);
          continue;
        }
        if (cut_side) {
          if (k == 1 || k == 2) {
            const Row other = runtime::surface_row(model_.net, model_.seams, s, along_u ? u : 0.0, along_u ? 0.0 : v,
                                                   along_u ? Derivative::v : Derivative::u);
            const Row* r[] = {&across, &other};
            const double w[] = {1, -1};
            b.all(runtime::combine(r, w), glm::dvec3(0), kRingCut);
          }
          continue;
        }
        if (curve.name == "margin" || curve.name == "verm" || curve.name == "Lu" || curve.name == "Ll" ||
            curve.name == "bust")
          continue;
        std::size_t j = 0;
        while (j + 2 < side.size() && (side[j + 1].second - t) * (surface.sides[k].to - surface.sides[k].from) < 0.0)
          ++j;
        const double width = side[j + 1].second - side[j].second;
        const double g = width != 0.0 ? std::clamp((t - side[j].second) / width, 0.0, 1.0) : 0.0;
        const glm::dvec3 n =
            glm::normalize((1 - g) * scan_.normals[side[j].first] + g * scan_.normals[side[j + 1].first]);
        b.row(across, n, 0.0, kTangentPlane);
      }
    }
  }

  void foot_points() {
    for (Sample& s : samples_) {
      if (s.seam) continue;
      const auto& net = model_.net.surfaces[s.surface];
      const glm::dvec3 p = model_.surface_point(s.surface, s.u, s.v);
      const glm::dvec3 du =
          model_.at(runtime::surface_row(model_.net, model_.seams, s.surface, s.u, s.v, Derivative::u));
      const glm::dvec3 dv =
          model_.at(runtime::surface_row(model_.net, model_.seams, s.surface, s.u, s.v, Derivative::v));
      const glm::dvec3 d = s.p - p;
      const double a = glm::dot(du, du), b = glm::dot(du, dv), c = glm::dot(dv, dv);
      const double det = a * c - b * b;
      if (det < 1e-12) continue;
      const double e = glm::dot(d, du), f = glm::dot(d, dv);
      const double u = std::clamp(s.u + std::clamp((c * e - b * f) / det, -kStep, kStep), 0.0, net.knots_u.back());
      const double v = std::clamp(s.v + std::clamp((a * f - b * e) / det, -kStep, kStep), 0.0, net.knots_v.back());
      if (glm::length(model_.surface_point(s.surface, u, v) - s.p) < glm::length(d)) {
        s.u = u;
        s.v = v;
      }
    }
  }

  double rms() const {
    double sum = 0.0, area = 0.0;
    for (const Sample& s : samples_) {
      const double d = glm::dot(s.n, model_.surface_point(s.surface, s.u, s.v) - s.p);
      sum += s.area * d * d;
      area += s.area;
    }
    return kMillimetres * std::sqrt(sum / area);
  }

  const Scan& scan_;
  Model model_;
  std::optional<Pieces> pieces_;
  std::vector<Sample> samples_;
  std::vector<char> midline_;
};

}  // namespace

Model fit(const Scan& scan, const Layout& layout) { return Fitter(scan, layout).run(); }

}  // namespace nms::fit_face
