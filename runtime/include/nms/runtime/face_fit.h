#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include <tl/expected.hpp>

#include <nms/program/failure.h>
#include <nms/runtime/face_x3d.h>
#include <nms/runtime/polygon_mesh.h>

namespace nms::runtime {

/// Places by name; sided ones end in _L and _R.  [m]
using Places = std::map<std::string, glm::dvec3, std::less<>>;

/// How the two halves of a face follow a scan.
enum class Halves : std::uint8_t { each, alike };

/// A face laid onto a scan: the same surfaces, the same names, other places.
struct FittedFace {
  FaceFile file;                ///< in the face's axes, as large as the scan
  Places landmarks;             ///< all that the face had, moved along
  glm::dmat3 rotation{1.0};     ///< from there to the scan: q = rotation p + translation
  glm::dvec3 translation{0.0};  ///< [m]
  std::size_t landmarks_used = 0;
  double before_mean_m = 0.0;  ///< distance of the skin from the scan, by landmarks alone
  double mean_m = 0.0;         ///< in the end
  double p95_m = 0.0;
  std::string furthest_mark;         ///< which landmark is furthest off as the face is turned, scaled and shifted whole
  double furthest_mark_off_m = 0.0;  ///< how far
  double median_mark_off_m = 0.0;    ///< how far landmarks are off there
  std::size_t measured = 0;  ///< vertices that stand before the scan and were compared
};

/// Lays the surfaces of a face onto a scan (Hoch's and Zhang's individualised faces).
///
/// A rotation brings the scan into the face's axes (Horn 1987). Then the whole space is bent, in rounds: first so that
/// the landmarks meet, then so that the skin meets the nearest places of the scan that face the same way; each time by
/// the smoothest map through samples about 8 mm apart, behind the ears 20 (thin plates of three dimensions: a sum of
/// distances and an affine part, least bent). Control points go with space, so seams stay shut and what lies inside
/// goes along; eyeballs stay round: they are shifted and scaled.
///
/// Each half is fitted to its own side of the scan; what the face's file shows under a mirror is written out for that
/// (a file with other transforms than that mirror is fitted alike).
/// A landmark that is given on one side only counts, mirrored, for the other too. With Halves::alike both are fitted to
/// the mean of what they meet: the face stays as symmetric as it was.
///
/// @param x3d        the face's file
/// @param landmarks  the face's
/// @param scan       polygons, counter-clockwise from outside
/// @param unit_m     metres in one of the scan's units
/// @param marks      landmarks on the scan, in metres; those that the face has too are used, at least 6
/// Failures: those of reading the face; fit_few_landmarks, fit_flat_landmarks (they lie in one plane), fit_other_size
/// (not 0.4 to 2 times the face's), fit_mirrored (left and right are exchanged), fit_far (the scan has nothing near the
/// face: wrong unit or landmarks).
[[nodiscard]] tl::expected<FittedFace, program::Failure> fit_face(std::string_view x3d, std::string_view name,
                                                                  const Places& landmarks, const PolygonMesh& scan,
                                                                  double unit_m, const Places& marks,
                                                                  Halves halves = Halves::each);

}  // namespace nms::runtime
