#include <nms/runtime/muscle.h>

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include <nms/runtime/trigonometry.h>

namespace nms::runtime {
namespace {

using program::Falloff;
using program::Muscle;
using program::MuscleKind;

constexpr double kSharp = 1e-12;
// The records are in single precision.
constexpr double kSingle = 1e-8;

double length(glm::dvec3 v) { return std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z); }

Muscle linear(Falloff law) {
  Muscle m;
  m.kind = MuscleKind::linear;
  m.falloff = law;
  m.side = program::Side::left;
  m.angle = 0.7F;
  m.dissipation_radius = 0.08F;
  m.limit = 0.25F;
  return m;
}

const MusclePlaces kPlaces{{0.056, 0.009, 0.085}, {0.025, -0.035, 0.100}};

// A point at distance d from the attachment, phi off the muscle's axis.
glm::dvec3 around(const MusclePlaces& places, double d, double phi) {
  const glm::dvec3 m = places.insertion - places.attachment;
  const glm::dvec3 axis = m / length(m);
  glm::dvec3 side(axis.y, -axis.x, 0.0);
  side = side / length(side);
  return places.attachment + d * (std::cos(phi) * axis + std::sin(phi) * side);
}

class Laws : public testing::TestWithParam<Falloff> {};
INSTANTIATE_TEST_SUITE_P(Muscle, Laws, testing::Values(Falloff::thesis, Falloff::smooth));

TEST_P(Laws, LinearFollowsItsClosedForm) {
  const Muscle muscle = linear(GetParam());
  const double m = length(kPlaces.insertion - kPlaces.attachment);
  const double angle = static_cast<double>(muscle.angle);
  const double limit = static_cast<double>(muscle.limit);
  const double outer = static_cast<double>(muscle.dissipation_radius);
  for (int i = 0; i <= 200; ++i) {
    for (int j = 0; j <= 100; ++j) {
      const double d = i * 0.0005;
      const double phi = j * 0.01;
      const glm::dvec3 p = around(kPlaces, d, phi);
      double r = d <= m ? std::sin(d / m * kPi / 2) : d < outer ? std::cos((d - m) / (outer - m) * kPi / 2) : 0.0;
      double a = phi <= angle ? std::cos(phi) : 0.0;
      if (GetParam() == Falloff::smooth) {
        r *= r;
        const double t = (1.0 - std::cos(phi)) / (1.0 - std::cos(angle));
        a *= t < 1.0 ? 1.0 - t * t * (3.0 - 2.0 * t) : 0.0;
      }
      if (std::abs(phi - angle) < 1e-6) continue;
      const double expected = std::min(limit * m * a * r, d);
      const glm::dvec3 pull = linear_pull(muscle, kPlaces, p);
      EXPECT_NEAR(length(pull), expected, kSingle);
      // Towards the attachment, never past it.
      EXPECT_NEAR(length(p + pull - kPlaces.attachment), d - expected, kSingle);
    }
  }
}

TEST_P(Laws, LinearStandsStillAtTheAttachmentAndPullsMostAtTheInsertion) {
  const Muscle muscle = linear(GetParam());
  const double m = length(kPlaces.insertion - kPlaces.attachment);
  EXPECT_EQ(length(linear_pull(muscle, kPlaces, kPlaces.attachment)), 0.0);
  EXPECT_NEAR(length(linear_pull(muscle, kPlaces, kPlaces.insertion)), 0.25 * m, kSharp);
  EXPECT_NEAR(length(linear_pull(muscle, kPlaces, around(kPlaces, 0.08001, 0.0))), 0.0, kSharp);
}

TEST_P(Laws, RadialFactorIsContinuousAtIAndD) {
  const double e = 1e-9;
  for (const double at : {0.04, 0.06}) {
    EXPECT_NEAR(radial_factor(GetParam(), at - e, 0.04, 0.06), radial_factor(GetParam(), at + e, 0.04, 0.06), 1e-6);
  }
}

double slope(double before, double after, double step) { return (after - before) / step; }

TEST(Muscle, SmoothLawHasNoKinks) {
  const double e = 1e-7;
  const auto r = [](double d) { return radial_factor(Falloff::smooth, d, 0.04, 0.06); };
  for (const double at : {0.04, 0.06}) {
    EXPECT_NEAR(slope(r(at - e), r(at), e), slope(r(at), r(at + e), e), 0.01);
  }
  const double cos_angle = std::cos(0.7);
  EXPECT_NEAR(angular_factor(Falloff::smooth, cos_angle + 1e-9, cos_angle), 0.0, 1e-6);
  EXPECT_NEAR(slope(0.0, angular_factor(Falloff::smooth, cos_angle + e, cos_angle), e), 0.0, 0.01);
  // The printed law jumps there, and must be had by name.
  EXPECT_NEAR(angular_factor(Falloff::thesis, cos_angle + 1e-9, cos_angle), cos_angle, 1e-6);
  EXPECT_EQ(angular_factor(Falloff::thesis, cos_angle - 1e-9, cos_angle), 0.0);
}

TEST_P(Laws, NoLinearMusclePullsPastItsAttachment) {
  Muscle muscle = linear(GetParam());
  muscle.limit = 5.0F;  // far beyond anatomy
  for (int i = 1; i < 160; ++i) {
    const glm::dvec3 p = around(kPlaces, i * 0.0005, 0.2);
    const glm::dvec3 v = p - kPlaces.attachment;
    const glm::dvec3 moved = v + linear_pull(muscle, kPlaces, p);
    EXPECT_GE(moved.x * v.x + moved.y * v.y + moved.z * v.z, -kSharp);
  }
}

Muscle sheet(Falloff law) {
  Muscle m;
  m.kind = MuscleKind::sheet;
  m.falloff = law;
  m.insertion_radius = 0.030F;
  m.dissipation_radius = 0.050F;
  m.perpendicular_radius = 0.020F;
  m.limit = 0.2F;
  return m;
}

const MusclePlaces kSheet{{0.014, 0.090, 0.09}, {0.014, 0.060, 0.09}};

TEST_P(Laws, SheetFollowsItsClosedForm) {
  const Muscle muscle = sheet(GetParam());
  const double m = 0.03;
  for (int i = 1; i <= 60; ++i) {
    for (int j = 0; j <= 25; ++j) {
      const double along = i * 0.001;
      const double across = j * 0.001;
      const glm::dvec3 p = kSheet.attachment + glm::dvec3(across, -along, 0.0);
      double parallel = along <= 0.03  ? std::sin(along / 0.03 * kPi / 2)
                        : along < 0.05 ? std::cos((along - 0.03) / 0.02 * kPi / 2)
                                       : 0.0;
      double perpendicular = across < 0.02 ? std::cos(across / 0.02 * kPi / 2) : 0.0;
      if (GetParam() == Falloff::smooth) {
        parallel *= parallel;
        perpendicular *= perpendicular;
      }
      const glm::dvec3 pull = sheet_pull(muscle, kSheet, p);
      EXPECT_NEAR(pull.y, 0.2 * m * parallel * perpendicular, 1e-7);
      EXPECT_EQ(pull.x, 0.0);
    }
  }
  EXPECT_EQ(length(sheet_pull(muscle, kSheet, kSheet.attachment)), 0.0);
  EXPECT_NEAR(length(sheet_pull(muscle, kSheet, kSheet.insertion)), 0.2 * m, kSingle);
}

TEST(Muscle, SmoothSheetLeavesWhatIsBehindTheAttachment) {
  EXPECT_EQ(length(sheet_pull(sheet(Falloff::smooth), kSheet, kSheet.attachment + glm::dvec3(0, 0.01, 0))), 0.0);
  EXPECT_GT(length(sheet_pull(sheet(Falloff::thesis), kSheet, kSheet.attachment + glm::dvec3(0, 0.01, 0))), 0.0);
}

Muscle sphincter(Falloff law) {
  Muscle m;
  m.kind = MuscleKind::sphincter;
  m.falloff = law;
  m.major_radius = 0.04F;
  m.minor_radius = 0.02F;
  m.limit = 0.5F;
  return m;
}

const MusclePlaces kMouth{{0.0, -0.035, 0.1}, {0.025, -0.035, 0.1}};

TEST_P(Laws, SphincterFollowsWatersFormAndEndsOnTheEllipse) {
  const Muscle muscle = sphincter(GetParam());
  const double major = static_cast<double>(muscle.major_radius);
  const double minor = static_cast<double>(muscle.minor_radius);
  for (int i = -50; i <= 50; ++i) {
    for (int j = -30; j <= 30; ++j) {
      const glm::dvec3 v(i * 0.001, j * 0.001, 0.0);
      const glm::dvec3 pull = sphincter_pull(muscle, kMouth, kMouth.attachment + v);
      const double a = 1.0 - std::sqrt(minor * minor * v.x * v.x + major * major * v.y * v.y) / (major * minor);
      double s = std::max(a, 0.0);
      if (GetParam() == Falloff::smooth) s = s * s * (3.0 - 2.0 * s);
      EXPECT_NEAR(length(pull), 0.5 * s * length(v), kSingle);
      // On the same side of the centre as before.
      EXPECT_GE((v + pull).x * v.x + (v + pull).y * v.y, 0.0);
    }
  }
  EXPECT_EQ(length(sphincter_pull(muscle, kMouth, kMouth.attachment)), 0.0);
  EXPECT_NEAR(length(sphincter_pull(muscle, kMouth, kMouth.attachment + glm::dvec3(major, 0, 0))), 0.0, kSingle);
  EXPECT_NEAR(length(sphincter_pull(muscle, kMouth, kMouth.attachment + glm::dvec3(0, minor, 0))), 0.0, kSingle);
}

TEST(Muscle, SphincterPushesForwardByItsAmount) {
  Muscle muscle = sphincter(Falloff::smooth);
  muscle.amount = 0.009F;
  muscle.limit = 3.0F;  // counts as 1: nothing crosses the centre
  const glm::dvec3 pull = sphincter_pull(muscle, kMouth, kMouth.attachment);
  EXPECT_NEAR(pull.z, 0.009, kSingle);
  const glm::dvec3 v(0.004, 0.001, 0.0);
  const glm::dvec3 moved = v + sphincter_pull(muscle, kMouth, kMouth.attachment + v);
  EXPECT_GE(moved.x, 0.0);
}

TEST(Muscle, AMuscleOfNoSideIsMirrored) {
  Muscle muscle = sphincter(Falloff::smooth);
  const MusclePlaces places{{0.0, -0.035, 0.11}, {0.025, -0.036, 0.1}};
  for (int i = 0; i < 30; ++i) {
    const glm::dvec3 p(i * 0.001, -0.03, 0.105);
    const glm::dvec3 left = sphincter_pull(muscle, places, p);
    const glm::dvec3 right = sphincter_pull(muscle, places, {-p.x, p.y, p.z});
    EXPECT_EQ(left.x, -right.x);
    EXPECT_EQ(left.y, right.y);
    EXPECT_EQ(left.z, right.z);
  }
}

TEST(Muscle, BulgePushesAlongTheNormalAndEndsSmoothly) {
  Muscle muscle;
  muscle.kind = MuscleKind::bulge;
  muscle.side = program::Side::left;
  muscle.major_radius = 0.03F;
  muscle.minor_radius = 0.02F;
  muscle.amount = 0.01F;
  const MusclePlaces places{{0.046, -0.016, 0.09}, {0.046, -0.016, 0.09}};
  const glm::dvec3 normal(0.6, 0.0, 0.8);
  EXPECT_NEAR(length(bulge_push(muscle, places, places.attachment, normal) - 0.01 * normal), 0.0, kSingle);
  for (int i = 0; i < 40; ++i) {
    const double x = i * 0.001;
    const double q2 = x * x / 0.0009;
    const double expected = q2 < 1.0 ? 0.01 * (1.0 - q2) * (1.0 - q2) : 0.0;
    EXPECT_NEAR(length(bulge_push(muscle, places, places.attachment + glm::dvec3(x, 0, 0), normal)), expected, kSingle);
  }
}

TEST(Muscle, ActivationSetTakesTheWeights) {
  const Muscle muscle = linear(Falloff::smooth);
  const std::vector<glm::dvec3> points{kPlaces.insertion, kPlaces.insertion, kPlaces.insertion, {1.0, 1.0, 1.0}};
  const std::vector<float> weights{1.0F, 0.5F, 0.0F, 1.0F};
  const std::vector<Pull> set = activation_set(muscle, kPlaces, points, {}, weights);
  ASSERT_EQ(set.size(), 2U);
  EXPECT_EQ(set[1].point, 1U);
  EXPECT_NEAR(length(set[1].displacement), 0.5 * length(set[0].displacement), kSharp);
}

TEST(Muscle, LidsTurnAtTheirDistanceAndMeet) {
  const glm::dvec3 centre(0.031, 0.036, 0.08);
  std::vector<glm::dvec3> upper;
  std::vector<glm::dvec3> lower;
  for (int i = -6; i <= 6; ++i) {
    const double x = i * 0.002;
    const double r = std::sqrt(0.0155 * 0.0155 - x * x);
    const double open = 1.0 - i * i / 36.0;
    upper.push_back(centre + glm::dvec3(x, r * std::sin(0.25 * open), r * std::cos(0.25 * open)));
    lower.push_back(centre + glm::dvec3(x, r * std::sin(-0.3 * open), r * std::cos(-0.3 * open)));
    upper.push_back(centre + glm::dvec3(x, r * std::sin(0.25 * open + 0.2), r * std::cos(0.25 * open + 0.2)));
  }
  const LidMargin u(LidMargin::Lid::upper, upper, centre);
  const LidMargin l(LidMargin::Lid::lower, lower, centre);
  EXPECT_NEAR(closing_angle(u, l, centre.x), 0.55, 1e-9);
  EXPECT_EQ(closing_angle(u, l, centre.x + 0.02), 0.0);
  for (std::size_t i = 0; i < upper.size(); i += 2) {
    const double angle = closing_angle(u, l, upper[i].x);
    const glm::dvec3 moved = turn_about_x(upper[i], centre, sine(angle), cosine(angle));
    EXPECT_NEAR(length(moved - centre), length(upper[i] - centre), kSharp);
    EXPECT_NEAR(length(moved - lower[i / 2]), 0.0, 1e-9);
  }
}

}  // namespace
}  // namespace nms::runtime
