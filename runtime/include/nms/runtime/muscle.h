#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include <nms/program/records.h>

namespace nms::runtime {

/// Muscle models: Barker 2005, 4.4.2, after Waters 1987, put right where the printed formulas jump.
///
/// Every function here is pure. With ap the attachment, ip the insertion, m = ip - ap and v = p - ap, each gives how
/// far a point p at rest moves at full activation; k of that at an activation k in [0, 1]. A muscle pulls *towards* its
/// attachment, so displacements run against v or m. Lengths in metres, angles in radians.

/// A muscle's places, landmarks looked up and offsets added.
struct MusclePlaces {
  glm::dvec3 attachment{0.0};  ///< [m]
  glm::dvec3 insertion{0.0};   ///< [m]; equal to attachment: the muscle has none
};

/// One point of an activation set.
struct Pull {
  std::uint32_t point = 0;
  glm::dvec3 displacement{0.0};  ///< at full activation [m]
};

/// Falls from 1 at t <= 0 to 0 at t >= 1 with no slope at either end: 1 - 3t^2 + 2t^3.
[[nodiscard]] double smooth_fall(double t);
/// Rises from 0 at `from` to 1 at `to` in the same way.
[[nodiscard]] double smooth_rise(double from, double to, double at);

/// How far a lip goes with the jaw between the mouth's corner (t = 0) and the lip's middle (t = 1), as a share of the
/// way from what the corner does to what the middle does: 1 - (1 - t)^2. A mouth that opens is round: CASSI's parabolic
/// track, as for rolls below.
[[nodiscard]] double lip_opening(double t);

/// Radial factor r of a linear muscle: 0 at the attachment, 1 at distance `insertion`, 0 from `dissipation` on.
/// thesis: sin(d/I pi/2) inside, cos((d-I)/(D-I) pi/2) outside. smooth: its square, so that the slope is continuous at
/// I and D, and next to the attachment the skin does not crease.
[[nodiscard]] double radial_factor(program::Falloff law, double distance, double insertion, double dissipation);

/// Angular factor a of a linear muscle: cos(phi) inside the angle of influence. smooth: times a smooth fall, from 1 on
/// the muscle's axis to 0 at the edge of the zone (thesis jumps there from cos(angle) to 0).
[[nodiscard]] double angular_factor(program::Falloff law, double cos_phi, double cos_angle);

/// p' = p - k limit |m| a r v/|v|. Never further than the attachment itself.
[[nodiscard]] glm::dvec3 linear_pull(const program::Muscle& muscle, const MusclePlaces& places, glm::dvec3 p);

/// p' = p - k limit |m| a_parallel a_perpendicular m/|m|, with r_parallel = |v| cos(phi), r_perpendicular its rest:
/// thesis: a_parallel = sin(r/I pi/2) inside, cos((r-I)/(D-I) pi/2) outside (the printed sin(r/D pi) is continuous at I
/// only for D = 2I), a_perpendicular = cos(r_perpendicular/D_perpendicular pi/2), both sides of the attachment alike.
/// smooth: each of the three squared, and nothing behind the attachment.
[[nodiscard]] glm::dvec3 sheet_pull(const program::Muscle& muscle, const MusclePlaces& places, glm::dvec3 p);

/// p' = p + k s(a) (amount z - limit v), a = 1 - sqrt(r_min^2 s_maj^2 + r_maj^2 s_min^2) / (r_maj r_min) (Waters' own
/// form; the thesis pairs the radii the other way, and its a is not 0 on the ellipse). s(a) is a itself (thesis), or
/// rises smoothly (smooth). `limit` is a share of the way to the centre and counts as 1 at most, so no point crosses
/// it. A muscle of no side sees both halves alike: x is folded to |x|.
[[nodiscard]] glm::dvec3 sphincter_pull(const program::Muscle& muscle, const MusclePlaces& places, glm::dvec3 p);

/// p' = p + k amount (1 - q^2)^2 n, q^2 = (s_maj/r_maj)^2 + (s_min/r_min)^2, n the surface's normal at p. A rig gives
/// the way the skin about p faces instead, so that the mouth's lining goes with the cheek; a bulge that leaves the
/// lining out is a swelling and keeps each point's own normal. Without an insertion the major axis lies along x.
[[nodiscard]] glm::dvec3 bulge_push(const program::Muscle& muscle, const MusclePlaces& places, glm::dvec3 p,
                                    glm::dvec3 normal);

/// A lip turned about its own length: the parabola with its vertex at the lip's middle (`from`) that runs through the
/// mouth's corner (`to`), CASSI's parabolic track. With s = |x - from.x|, w the corner's s, c the track's point at x
/// and t its direction: p' = c + R(t, k f g angle) (p - c) + k f g slide at k = 1, and straight there below. The
/// slide in x leads away from the middle on both sides, and grows from 0 there to the whole half-way to the corner. f =
/// 1 within `insertion` of the track, 0 from `dissipation` on; g = 1 to s = `perpendicular`, 0 at the corner.
[[nodiscard]] glm::dvec3 roll_shift(const program::Muscle& muscle, const MusclePlaces& places, glm::dvec3 p);

/// The activation set of a linear, sheet, sphincter, bulge or roll muscle, points ascending; empty for the other kinds.
/// @param points   P, at rest                                                      [m]
/// @param normals  P, unit; only a bulge reads them
/// @param weights  P in [0, 1], how much of the muscle's pull each point takes, or empty: all of it
[[nodiscard]] std::vector<Pull> activation_set(const program::Muscle& muscle, const MusclePlaces& places,
                                               std::span<const glm::dvec3> points, std::span<const glm::dvec3> normals,
                                               std::span<const float> weights);

// ------------------------------------------------------------------------------------------------ eyelids

/// Turns p about the axis through `centre` along x; + turns the front down. Distance from the centre is kept, so a
/// point outside the eyeball stays outside.
[[nodiscard]] glm::dvec3 turn_about_x(glm::dvec3 p, glm::dvec3 centre, double sine_of_angle, double cosine_of_angle);

/// The same about the axis along y; + turns the front to +x.
[[nodiscard]] glm::dvec3 turn_about_y(glm::dvec3 p, glm::dvec3 centre, double sine_of_angle, double cosine_of_angle);

/// Elevation of p as seen from the eyeball's centre, about the same axis: 0 forward, + up. [rad]
[[nodiscard]] double elevation(glm::dvec3 p, glm::dvec3 centre);

/// A lid's edge: elevation as a function of x, which the turn of a lid leaves alone. So what brings one column of the
/// upper lid onto the lower lid's edge is the difference of the two elevations at its x.
class LidMargin {
 public:
  enum class Lid : std::uint8_t { upper, lower };

  /// Of the points given, each column's lowest (upper lid) or highest (lower lid) make the edge.
  /// @param points the lid's points of full weight, at rest
  LidMargin(Lid lid, std::span<const glm::dvec3> points, glm::dvec3 centre);

  /// Straight between the columns; beyond the ends the end's own.
  [[nodiscard]] double elevation_at(double x) const;
  [[nodiscard]] double first_x() const { return x_.empty() ? 0.0 : x_.front(); }
  [[nodiscard]] double last_x() const { return x_.empty() ? 0.0 : x_.back(); }
  [[nodiscard]] bool empty() const { return x_.empty(); }

 private:
  std::vector<double> x_;          // ascending
  std::vector<double> elevation_;  // one for each x
};

/// The turn that brings the upper lid's column at x onto the lower lid's edge: 0 outside the fissure. [rad]
[[nodiscard]] double closing_angle(const LidMargin& upper, const LidMargin& lower, double x);

}  // namespace nms::runtime
