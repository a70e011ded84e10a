#include "synthetic_head.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nms/program/enum_names.h>
#include <nms/runtime/landmark_set.h>
#include <nms/runtime/muscle.h>

namespace nms::test {

namespace {

using program::FacePartKind;

// All in millimetres.
constexpr double kMouthY = -34.0;
constexpr double kMouthHalf = 25.0;
constexpr double kEyeX = 31.2;
constexpr double kEyeY = 34.0;
constexpr double kEyeHalf = 13.0;
constexpr double kLiningDepth = 16.0;
constexpr double kBallRadius = 12.5;

double bump(double x, double y, double z, double at_x, double at_y, double width, double height) {
  const double u = (x - at_x) / width;
  const double v = (y - at_y) / height;
  return z * std::exp(-(u * u + v * v));
}

// The skin's depth: an ellipsoid with nose, lips and chin.
double depth(double x, double y) {
  const double u = x / 80.0;
  const double v = (y - 5.0) / 135.0;
  const double base = 10.0 + 90.0 * std::sqrt(std::max(1.0 - u * u - v * v, 0.0));
  return base + bump(x, y, 26.0, 0, 0, 11, 20) + bump(x, y, 8.0, 0, kMouthY, 22, 12) + bump(x, y, 7.0, 0, -64, 16, 11);
}

double eye_open(double x) {
  const double s = (std::abs(x) - kEyeX) / kEyeHalf;
  return std::abs(s) < 1.0 ? 1.0 - s * s : 0.0;
}

class Builder {
 public:
  explicit Builder(double spacing) : steps_(std::max(2, static_cast<int>(std::lround((kEyeY - kMouthY) / spacing)))) {
    step_ = (kEyeY - kMouthY) / steps_;
  }

  SyntheticHead run() {
    skin();
    for (const double side : {1.0, -1.0}) ball(side);
    landmarks();
    return std::move(out_);
  }

 private:
  enum class Lip { none, upper, lower };

  // Slits open the grid: of the vertices on one, the upper belongs to what is above it.
  bool on_mouth(int i, int j) const { return j == 0 && std::abs(i * step_) < kMouthHalf - 0.25 * step_; }
  bool on_eye(int i, int j) const {
    return j == steps_ && std::abs(std::abs(i * step_) - kEyeX) < kEyeHalf - 0.25 * step_;
  }

  std::uint32_t add(const glm::dvec3& p) {
    out_.mesh.positions.push_back(p * 0.001);
    return static_cast<std::uint32_t>(out_.mesh.positions.size() - 1);
  }

  glm::dvec3 place(int i, int j, bool above) const {
    const double x = i * step_;
    double y = kMouthY + j * step_;
    const double z = depth(x, y);
    // The eye's opening pushes its neighbourhood away.
    const double from = y - kEyeY;
    const bool up = from > 0.0 || (from == 0.0 && above);
    y += (up ? 4.5 : -3.5) * eye_open(x) * runtime::smooth_fall(std::abs(from) / 18.0);
    return {x, y, z};
  }

  std::uint32_t vertex(int i, int j, bool above) {
    const bool slit = on_mouth(i, j) || on_eye(i, j);
    const auto [at, fresh] = index_.try_emplace({i, j, slit && above}, 0U);
    if (fresh) at->second = add(place(i, j, above));
    return at->second;
  }

  void quad(runtime::PolygonMesh::Piece& piece, std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d,
            bool mirrored) {
    // Cut alike on both sides.
    if (mirrored) {
      piece.triangles.push_back({a, b, d});
      piece.triangles.push_back({b, c, d});
    } else {
      piece.triangles.push_back({a, b, c});
      piece.triangles.push_back({a, c, d});
    }
  }

  void skin() {
    out_.mesh.pieces.push_back({{"skin"}, "", std::nullopt, {}});
    runtime::PolygonMesh::Piece& piece = out_.mesh.pieces.back();
    const int columns = static_cast<int>(76.0 / step_);
    const int low = -static_cast<int>(76.0 / step_);
    const int high = static_cast<int>(150.0 / step_);
    for (int j = low; j < high; ++j) {
      for (int i = -columns; i < columns; ++i) {
        quad(piece, vertex(i, j, true), vertex(i + 1, j, true), vertex(i + 1, j + 1, false), vertex(i, j + 1, false),
             i < 0);
      }
    }
    lining(piece, true);
    lining(piece, false);
  }

  // A lip's back, from its edge inwards.
  void lining(runtime::PolygonMesh::Piece& piece, bool upper) {
    const int rows = std::max(2, static_cast<int>(kLiningDepth / step_));
    const int most = static_cast<int>(std::ceil(kMouthHalf / step_)) - 1;
    std::map<std::pair<int, int>, std::uint32_t> made;
    const auto at = [&](int i, int k) {
      if (k == 0) return vertex(i, 0, upper);
      const auto [found, fresh] = made.try_emplace({i, k}, 0U);
      if (fresh) {
        const glm::dvec3 edge = place(i, 0, upper);
        const double in = kLiningDepth * k / rows;
        found->second = add({edge.x * (1.0 - 0.01 * in), edge.y + (upper ? 0.35 : -0.35) * in, edge.z - in});
      }
      return found->second;
    };
    for (int k = 0; k < rows; ++k) {
      for (int i = -most; i < most; ++i) {
        if (!on_mouth(i, 0) || !on_mouth(i + 1, 0)) continue;
        if (upper)
          quad(piece, at(i, k + 1), at(i + 1, k + 1), at(i + 1, k), at(i, k), i < 0);
        else
          quad(piece, at(i, k), at(i + 1, k), at(i + 1, k + 1), at(i, k + 1), i < 0);
      }
    }
  }

  static glm::dvec3 eye_centre(double side) { return {side * kEyeX, kEyeY, depth(kEyeX, kEyeY) - 15.0}; }

  void ball(double side) {
    out_.mesh.pieces.push_back({{side > 0.0 ? "eye_left" : "eye_right"}, "", std::nullopt, {}});
    runtime::PolygonMesh::Piece& piece = out_.mesh.pieces.back();
    constexpr int kAround = 16;
    constexpr int kRings = 10;
    std::vector<std::uint32_t> ids;
    for (int r = 0; r <= kRings; ++r) {
      for (int k = 0; k < kAround; ++k) {
        const double a = 3.14159265358979 * r / kRings;
        const double b = 6.28318530717959 * k / kAround;
        ids.push_back(add(eye_centre(side) + kBallRadius * glm::dvec3(side * std::sin(a) * std::cos(b),
                                                                      std::sin(a) * std::sin(b), std::cos(a))));
      }
    }
    for (int r = 0; r < kRings; ++r) {
      for (int k = 0; k < kAround; ++k) {
        const auto id = [&](int ring, int i) { return ids[static_cast<std::size_t>(ring * kAround + i % kAround)]; };
        if (side > 0.0)
          quad(piece, id(r, k), id(r + 1, k), id(r + 1, k + 1), id(r, k + 1), false);
        else
          quad(piece, id(r, k), id(r, k + 1), id(r + 1, k + 1), id(r + 1, k), false);
      }
    }
  }

  // The reference face's places from the front; their depth is this head's.
  void landmarks() {
    struct Place {
      const char* name;
      double x, y;
    };
    static constexpr Place kPlaces[] = {
        {"trichion", 0, 110},
        {"forehead_mid", 0, 84},
        {"forehead_inner", 16, 90},
        {"forehead_outer", 43, 90},
        {"glabella", 0, 58},
        {"brow_inner", 12.5, 59},
        {"brow_mid", 34, 63.5},
        {"brow_outer", 55, 55.5},
        {"nasion", 0, 39},
        {"temple", 66, 46},
        {"eye_inner", 18.2, kEyeY},
        {"eye_outer", 44.2, kEyeY},
        {"infraorbital", 30, 19},
        {"nasal_bone", 7.5, 28},
        {"nose_tip", 0, 0},
        {"ala", 15, -4},
        {"ala_crease", 19, -1},
        {"nostril", 6, -11},
        {"canine_fossa", 23, 3},
        {"subnasale", 0, -14},
        {"malar", 43, 12},
        {"zygomatic", 56, 9},
        {"zygomatic_minor", 45, 9},
        {"tragion", 71, 12},
        {"cheek_mid", 46, -16},
        {"buccinator_origin", 50, -24},
        {"risorius_origin", 64, -26},
        {"masseter", 64, -30},
        {"lip_upper_mid", 0, -25},
        {"lip_upper_lateral", 17, -28},
        {"mouth_corner", 25, kMouthY},
        {"lip_lower_lateral", 17, -40},
        {"lip_lower_mid", 0, -44},
        {"mentolabial", 0, -53},
        {"pogonion", 0, -64},
        {"menton", 0, -80},
        {"chin_lateral", 19, -61},
        {"chin_tubercle", 26, -69},
        {"jaw_body", 43, -59},
        {"jaw_angle", 60, -46},
        {"cervical", 0, -86},
    };
    const auto put = [&](const std::string& name, const glm::dvec3& mm) {
      out_.form.landmarks.push_back({name, program::kNone, "", mm * 0.001});
    };
    const auto both = [&](const std::string& name, const glm::dvec3& mm) {
      if (mm.x == 0.0) return put(name, mm);
      put(name + "_L", mm);
      put(name + "_R", {-mm.x, mm.y, mm.z});
    };
    for (const Place& p : kPlaces) both(p.name, {p.x, p.y, depth(p.x, p.y)});
    const double lid = depth(kEyeX, kEyeY);
    both("lid_upper_mid", {kEyeX, kEyeY + 4.5, lid});
    both("lid_lower_mid", {kEyeX, kEyeY - 3.5, lid});
    both("jaw_hinge", {60, -5.5, 18.2});
    both("neck_side", {48, -100, 15});
    both("platysma_clavicle", {50, -182, 45});
    put("stomion", {0, kMouthY, depth(0, kMouthY) - 2.0});
    put("head_pivot", {0, -10, 9});
    put("torso_pivot", {0, -175, -10});
    for (const FacePartKind kind : {FacePartKind::skin, FacePartKind::eye_left, FacePartKind::eye_right})
      out_.form.parts.push_back({kind, std::string(program::enum_name(kind)), 0, program::kNone});
  }

  int steps_;    // from the mouth to the eyes
  double step_;  // [mm]
  std::map<std::tuple<int, int, bool>, std::uint32_t> index_;
  SyntheticHead out_;
};

}  // namespace

SyntheticHead synthetic_head(double spacing_mm) { return Builder(spacing_mm).run(); }

std::string obj_text(const runtime::PolygonMesh& mesh) {
  std::string out;
  for (const glm::dvec3& p : mesh.positions) out += fmt::format("v {} {} {}\n", p.x, p.y, p.z);
  for (const runtime::PolygonMesh::Piece& piece : mesh.pieces) {
    out += fmt::format("g {}\n", fmt::join(piece.names, " "));
    for (const auto& t : piece.triangles) out += fmt::format("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
  }
  return out;
}

}  // namespace nms::test
