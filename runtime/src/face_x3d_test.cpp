#include <gtest/gtest.h>

#include <nms/runtime/face_x3d.h>

namespace nms::runtime {
namespace {

std::string scene(const std::string& inside) { return "<X3D version='3.3'><Scene>" + inside + "</Scene></X3D>"; }

std::string plain(const std::string& attributes = "uDimension='2' vDimension='2' uOrder='2' vOrder='2'",
                  const std::string& points = "0 0 0, 1 0 0, 0 1 0, 1 1 0") {
  return "<Shape><NurbsPatchSurface " + attributes + "><Coordinate containerField='controlPoint' point='" + points +
         "'/></NurbsPatchSurface></Shape>";
}

TEST(FaceX3d, APlainSurfaceIsAFace) {
  const auto face = read_face_x3d(scene(plain()), "plain.x3d");
  ASSERT_TRUE(face) << face.error().cause;
  EXPECT_EQ(face->skin.points.size(), 4U);
  EXPECT_EQ(face->skin.surface.rows, 9U);
}

TEST(FaceX3d, MirroredHalvesShareThePlane) {
  const auto face = read_face_x3d(
      scene("<Group DEF='h'>" + plain() + "</Group><Transform scale='-1 1 1'><Group USE='h'/></Transform>"), "m.x3d");
  ASSERT_TRUE(face) << face.error().cause;
  EXPECT_EQ(face->skin.points.size(), 6U);
  EXPECT_EQ(face->skin.surface.rows, 15U);
}

std::string kind(const std::string& text) {
  const auto face = read_face_x3d(text, "hostile.x3d");
  if (face) return "none";
  EXPECT_FALSE(face.error().place.empty() || face.error().cause.empty() || face.error().remedy.empty());
  return face.error().kind;
}

TEST(FaceX3d, HostileFilesAreRefused) {
  EXPECT_EQ(kind(""), "face_not_xml");
  EXPECT_EQ(kind("<X3D"), "face_not_xml");
  EXPECT_EQ(kind("<html/>"), "face_not_x3d");
  EXPECT_EQ(kind(scene("")), "face_empty");
  EXPECT_EQ(kind(scene(plain("uDimension='4000000000' vDimension='4000000000'"))), "face_bad_surface");
  EXPECT_EQ(kind(scene(plain("uDimension='1000000' vDimension='1000000'"))), "face_too_large");
  EXPECT_EQ(kind(scene(plain("uDimension='-2' vDimension='2'"))), "face_bad_surface");
  EXPECT_EQ(kind(scene(plain("vDimension='2'"))), "face_bad_surface");
  EXPECT_EQ(kind(scene(plain("uDimension='2' vDimension='2' uOrder='2' vOrder='2' uKnot='0 0 nan 1'"))),
            "face_bad_number");
  EXPECT_EQ(kind(scene(plain("uDimension='2' vDimension='2' uOrder='2' vOrder='2' uKnot='1 1 0 0'"))),
            "face_bad_surface");
  EXPECT_EQ(kind(scene(plain("uDimension='2' vDimension='2' uOrder='2' vOrder='2' weight='1 1 0 1'"))),
            "face_bad_surface");
  EXPECT_EQ(kind(scene(plain("uDimension='2' vDimension='2' uOrder='2' vOrder='2'", "0 0 0, 1 0 inf, 0 1 0, 1 1 0"))),
            "face_bad_number");
  EXPECT_EQ(kind(scene(plain("uDimension='2' vDimension='2' uOrder='2' vOrder='2'", "0 0 0"))), "face_bad_surface");
  EXPECT_EQ(kind(scene("<Group USE='nobody'/>")), "face_bad_reference");
  EXPECT_EQ(kind(scene("<Group DEF='a'><Group USE='a'/></Group>")), "face_bad_reference");
  std::string laughs = "<Group DEF='g0'>" + plain() + "</Group>";
  for (int i = 0; i < 40; ++i) {
    const std::string inner = "<Group USE='g" + std::to_string(i) + "'/>";
    laughs += "<Group DEF='g" + std::to_string(i + 1) + "'>" + inner + inner + "</Group>";
  }
  EXPECT_EQ(kind(scene(laughs)), "face_too_large");
  std::string deep;
  for (int i = 0; i < 100000; ++i) deep += "<Group>";
  EXPECT_EQ(kind(scene(deep)), "face_not_xml");
}

}  // namespace
}  // namespace nms::runtime
