#include "test_face.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>
#include <tuple>

#include <nms/program/text.h>
#include <nms/runtime/rig.h>
#include <nms/runtime/trigonometry.h>

namespace nms::runtime {
namespace {

constexpr double kEyeX = 0.031;
constexpr double kEyeY = 0.036;
constexpr double kEyeZ = 0.080;

struct Builder {
  Face face;

  // Points and quads of a grid; `place` gives the point of column i, row j.
  template <typename Place, typename Weigh>
  void grid(int columns, int rows, std::uint32_t material, bool flip, Place place, Weigh weigh) {
    const std::uint32_t first = static_cast<std::uint32_t>(face.skin.points.size());
    for (int j = 0; j < rows; ++j) {
      for (int i = 0; i < columns; ++i) {
        face.skin.points.push_back(place(i, j));
        for (auto& [name, values] : face.regions) values.resize(face.skin.points.size(), 0.0F);
        weigh(i, j, first + static_cast<std::uint32_t>(j * columns + i));
      }
    }
    std::vector<std::uint32_t>& t = face.skin.primitives[material].triangles;
    for (int j = 0; j + 1 < rows; ++j) {
      for (int i = 0; i + 1 < columns; ++i) {
        const std::uint32_t a = first + static_cast<std::uint32_t>(j * columns + i);
        const std::uint32_t b = a + 1;
        const std::uint32_t c = a + static_cast<std::uint32_t>(columns);
        const std::uint32_t d = c + 1;
        if (flip) {
          t.insert(t.end(), {a, c, b, b, c, d});
        } else {
          t.insert(t.end(), {a, b, c, b, d, c});
        }
      }
    }
  }
};

}  // namespace

Face test_face() {
  Builder b;
  Face& face = b.face;
  face.materials.resize(3);
  face.materials[0].name = "skin";
  face.materials[1].name = "lids";
  face.materials[2].name = "white of the eye";
  face.skin.primitives = {{0, {}}, {1, {}}};
  for (const char* name : {"jaw", "neck", "lid_upper_left", "lid_upper_right", "lid_lower_left", "lid_lower_right",
                           "lip_upper", "lip_lower"}) {
    face.regions[name];
  }

  // The mask: a paraboloid, columns mirrored about x = 0.
  b.grid(
      41, 49, 0, false,
      [](int i, int j) {
        const double x = (i - 20) * 0.0035;
        const double y = (j - 32) * 0.005;
        return glm::dvec3(x, y, 0.105 - 6.0 * x * x - 2.0 * y * y);
      },
      [&](int, int j, std::uint32_t point) {
        const double y = (j - 32) * 0.005;
        face.regions["jaw"][point] = static_cast<float>(std::clamp((-0.03 - y) / 0.02, 0.0, 1.0));
        face.regions["neck"][point] = static_cast<float>(std::clamp((y + 0.15) / 0.06, 0.0, 1.0));
      });
  // Lids: bands on a sphere about each eye, from the edge (row 0) outwards; columns run with |x|.
  for (const double side : {1.0, -1.0}) {
    for (const bool upper : {true, false}) {
      const std::string region = std::string(upper ? "lid_upper" : "lid_lower") + (side > 0.0 ? "_left" : "_right");
      b.grid(
          13, 7, 1, (side > 0.0) != upper,
          [&](int i, int j) {
            const double x = (i - 6) * 0.002;
            const double opening = 1.0 - static_cast<double>((i - 6) * (i - 6)) / 40.0;
            const double edge = (upper ? 14.0 : -20.0) * opening * kRadian;
            const double e = edge + (upper ? 6.0 : -6.0) * j * kRadian;
            const double radius = kTestEyeRadius + 0.0006 * j;
            const double r = std::sqrt(radius * radius - x * x);
            return glm::dvec3(side * (kEyeX + x), kEyeY + r * sine(e), kEyeZ + r * cosine(e));
          },
          [&](int, int j, std::uint32_t point) {
            face.regions[region][point] = 1.0F - static_cast<float>(j) / 6.0F;
            face.regions["neck"][point] = 1.0F;
          });
    }
  }
  // Lips: two bands before the mask, 0.8 mm apart, thinner towards the corners.
  for (const bool upper : {true, false}) {
    b.grid(
        21, 6, 1, !upper,
        [&](int i, int j) {
          const double x = (i - 10) * 0.0025;
          const double height = (upper ? 0.002 : -0.002) * (1.0 - static_cast<double>((i - 10) * (i - 10)) / 101.0);
          return glm::dvec3(x, -0.035 + (upper ? 0.0004 : -0.0004) + height * j, 0.112 - 6.0 * x * x);
        },
        [&](int, int j, std::uint32_t point) {
          face.regions[upper ? "lip_upper" : "lip_lower"][point] = j < 4 ? 1.0F : 0.5F;
          face.regions["jaw"][point] = upper ? 0.0F : 1.0F;
          face.regions["neck"][point] = 1.0F;
        });
  }
  const std::uint32_t count = static_cast<std::uint32_t>(face.skin.points.size());
  SparseMatrix& t = face.skin.surface;
  t.rows = t.columns = count;
  for (std::uint32_t i = 0; i < count; ++i) {
    t.row_begin.push_back(i);
    t.column.push_back(i);
    t.value.push_back(1.0F);
  }
  t.row_begin.push_back(count);
  face.skin.offsets.assign(count, glm::vec3(0.0F));
  face.skin.colors.assign(count, glm::vec3(0.9F, 0.8F, 0.7F));

  const auto tetrahedron = [&](const char* name, Frame frame, glm::vec3 at) {
    RigidMesh mesh;
    mesh.name = name;
    mesh.frame = frame;
    for (const glm::vec3 d : {glm::vec3(1, 1, 1), glm::vec3(1, -1, -1), glm::vec3(-1, 1, -1), glm::vec3(-1, -1, 1)}) {
      mesh.positions.push_back(at + 0.008F * d);
    }
    mesh.primitives = {{2, {0, 1, 2, 0, 3, 1, 0, 2, 3, 1, 3, 2}}};
    mesh.normals.resize(4);
    area_weighted_normals(mesh.primitives, mesh.positions, mesh.normals);
    face.rigid.push_back(mesh);
  };
  tetrahedron("eyeball", Frame::eye_left, {kEyeX, kEyeY, kEyeZ});
  tetrahedron("eyeball", Frame::eye_right, {-kEyeX, kEyeY, kEyeZ});
  tetrahedron("teeth_upper", Frame::head, {0.0F, -0.025F, 0.08F});
  tetrahedron("teeth_lower", Frame::jaw, {0.0F, -0.045F, 0.08F});
  tetrahedron("tongue", Frame::jaw, {0.0F, -0.04F, 0.06F});
  tetrahedron("collar", Frame::torso, {0.0F, -0.16F, 0.0F});
  return face;
}

program::Image test_program(const char* clips) {
  std::string text = R"(nms program 1

channels
  AU1L action_unit au 1 side left
  AU1R action_unit au 1 side right
  AU5L action_unit au 5 side left
  AU5R action_unit au 5 side right
  AU7L action_unit au 7 side left
  AU7R action_unit au 7 side right
  AU12L action_unit au 12 side left
  AU12R action_unit au 12 side right
  AU18 action_unit au 18
  AU19 action_unit au 19
  AU24 action_unit au 24
  AU26 action_unit au 26
  AU34L action_unit au 34 side left
  AU34R action_unit au 34 side right
  AU45L action_unit au 45 side left
  AU45R action_unit au 45 side right
  AU66 action_unit au 66
  head_yaw axis positive AU51 negative AU52 au 51 motion rotate_y frame head full_scale 1.3
  head_pitch axis positive AU53 negative AU54 au 53 motion rotate_x frame head full_scale -0.8
  gaze_pitch axis positive AU63 negative AU64 au 63 motion rotate_x frame eyes full_scale -0.5
  head_thrust axis positive AU57 negative AU58 au 57 motion translate_z frame head full_scale 0.04

)";
  text += clips;
  text += R"(
face test surface test.x3d

landmarks
  forehead_L 0.016 0.085 0.088
  forehead_R -0.016 0.085 0.088
  brow_L 0.014 0.056 0.0975
  brow_R -0.014 0.056 0.0975
  zygomatic_L 0.056 0.009 0.085
  zygomatic_R -0.056 0.009 0.085
  mouth_corner_L 0.025 -0.035 0.0988
  mouth_corner_R -0.025 -0.035 0.0988
  stomion 0 -0.035 0.1025
  cheek_L 0.046 -0.016 0.0918
  cheek_R -0.046 -0.016 0.0918
  eye_centre_L 0.031 0.036 0.08
  eye_centre_R -0.031 0.036 0.08
  lid_upper_mid_L 0.031 0.04 0.095
  lid_upper_mid_R -0.031 0.04 0.095
  lid_lower_mid_L 0.031 0.031 0.0946
  lid_lower_mid_R -0.031 0.031 0.0946
  jaw_hinge_L 0.06 -0.0055 0.0182
  jaw_hinge_R -0.06 -0.0055 0.0182
  head_pivot 0 -0.01 0.009
  torso_pivot 0 -0.175 -0.01
)";
  for (const char side : {'L', 'R'}) {
    std::string muscles = R"(
muscle frontalis_? sheet
  side $
  attachment forehead
  insertion brow
  dissipation_radius 0.045
  perpendicular_radius 0.024
  limit 0.25

muscle levator_? eyelid
  side $
  attachment eye_centre
  insertion lid_upper_mid
  region lid_upper
  angle -0.2

muscle lid_? eyelid
  side $
  attachment eye_centre
  insertion lid_upper_mid
  region lid_upper
  closes 1

muscle lid_lower_? eyelid
  side $
  attachment eye_centre
  insertion lid_lower_mid
  region lid_lower
  closes 0.3

muscle zygomatic_? linear
  side $
  attachment zygomatic
  insertion mouth_corner
  angle 0.7
  dissipation_radius 0.08
  limit 0.25

muscle puff_? bulge
  side $
  attachment cheek
  major_radius 0.03
  minor_radius 0.03
  amount 0.01
)";
    for (std::size_t at = 0; (at = muscles.find('?', at)) != std::string::npos;) muscles[at] = side;
    for (std::size_t at = 0; (at = muscles.find('$', at)) != std::string::npos;) {
      muscles.replace(at, 1, side == 'L' ? "left" : "right");
    }
    text += muscles;
  }
  text += R"(
muscle oris sphincter
  attachment stomion
  insertion mouth_corner
  major_radius 0.045
  minor_radius 0.035
  limit 0.4
  amount 0.008

muscle press sheet
  attachment stomion
  attachment_offset 0 0.03 0.01
  insertion stomion
  insertion_offset 0 0 0.01
  dissipation_radius 0.045
  perpendicular_radius 0.06
  region lip_lower
  limit 0.2

muscle jaw_opener hinge
  frame jaw
  attachment jaw_hinge
  region jaw
  angle 0.44

muscle genioglossus hinge
  frame jaw
  attachment jaw_hinge
  region tongue
  slide 0 0 0.02

actuations
  AU1L frontalis_L 1
  AU1R frontalis_R 1
  AU5L levator_L 1
  AU5R levator_R 1
  AU7L lid_L 0.12
  AU7L lid_lower_L 1
  AU7R lid_R 0.12
  AU7R lid_lower_R 1
  AU12L zygomatic_L 1
  AU12R zygomatic_R 1
  AU18 oris 1
  AU19 genioglossus 1
  AU24 press 1
  AU26 jaw_opener 0.5
  AU34L puff_L 1
  AU34R puff_R 1
  AU45L lid_L 1
  AU45R lid_R 1
)";
  const auto draft = program::from_text(text, "test_face");
  if (!draft) {
    std::fprintf(stderr, "%s: %s\n", draft.error().place.c_str(), draft.error().cause.c_str());
    std::abort();
  }
  auto image = program::Image::from(*draft);
  if (!image) {
    std::fprintf(stderr, "%s: %s\n", image.error().place.c_str(), image.error().cause.c_str());
    std::abort();
  }
  return std::move(*image);
}

std::vector<std::uint32_t> mirrored_points(const Face& face) {
  const auto key = [](glm::dvec3 p) {
    return std::tuple(std::llround(p.x * 1e7), std::llround(p.y * 1e7), std::llround(p.z * 1e7));
  };
  // The lids' points lie in front of the mask's, so places are unique.
  std::map<std::tuple<long long, long long, long long>, std::uint32_t> places;
  for (std::uint32_t i = 0; i < face.skin.points.size(); ++i) places[key(face.skin.points[i])] = i;
  std::vector<std::uint32_t> mirrored(face.skin.points.size(), 0);
  for (std::uint32_t i = 0; i < face.skin.points.size(); ++i) {
    const glm::dvec3 p = face.skin.points[i];
    const auto it = places.find(key({-p.x, p.y, p.z}));
    if (it == places.end()) std::abort();
    mirrored[i] = it->second;
  }
  return mirrored;
}

}  // namespace nms::runtime
