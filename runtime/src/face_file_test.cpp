// Readers of faces: what they take, what they refuse, and that all kinds of file say the same.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <nms/runtime/face_file.h>
#include <nms/runtime/face_x3d.h>
#include <nms/runtime/gltf_export.h>
#include <nms/runtime/nurbs.h>
#include <nms/runtime/places_at_rest.h>
#include <nms/runtime/polygon_mesh.h>

#include "sphere_fit.h"
#include "surface_graph.h"
#include "test_face.h"

namespace nms::runtime {
namespace {

namespace fs = std::filesystem;

std::string read_file(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// The kind of failure, or "none"; whatever fails says where, why and what to do.
std::string kind(std::string_view bytes, std::string_view name, const FaceForm& form = {}) {
  const auto face = read_face(bytes, name, form);
  if (face) return "none";
  EXPECT_FALSE(face.error().place.empty() || face.error().cause.empty() || face.error().remedy.empty());
  return face.error().kind;
}

// ------------------------------------------------------------------------------------------------ OBJ

constexpr const char* kQuad = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\n";

TEST(ObjRead, GroupsObjectsAndMaterialsNameTheirTriangles) {
  const auto mesh =
      read_obj(std::string(kQuad) + "o head\ng a b\nusemtl my skin\nf 1 2 3\ng c\nf 1/2 3//4 4/5/6\n", "q.obj");
  ASSERT_TRUE(mesh) << mesh.error().cause;
  ASSERT_EQ(mesh->pieces.size(), 2U);
  EXPECT_EQ(mesh->pieces[0].names, (std::vector<std::string>{"a", "b", "head", "my skin"}));
  EXPECT_EQ(mesh->pieces[1].names, (std::vector<std::string>{"c", "head", "my skin"}));
  EXPECT_EQ(mesh->pieces[1].triangles[0], (std::array<std::uint32_t, 3>{0, 2, 3}));
}

TEST(ObjRead, CountsBackwardsAndGoesOnAfterABackslash) {
  const auto mesh = read_obj(std::string(kQuad) + "f -4 -3 \\\r\n -2\r\n# f 9 9 9\nvn 0 0 1\nvt 0 0\ns off\n", "q.obj");
  ASSERT_TRUE(mesh) << mesh.error().cause;
  EXPECT_EQ(mesh->pieces[0].triangles[0], (std::array<std::uint32_t, 3>{0, 1, 2}));
}

TEST(ObjRead, NumbersMayHaveASignAndACommentBehindThem) {
  const auto mesh = read_obj("v +1.5 -0 +2e0 # first\nv 0 0 0#\nv 0 1 0\ng #1\nf 1 2 3 # all\n", "q.obj");
  ASSERT_TRUE(mesh) << mesh.error().cause;
  EXPECT_EQ(mesh->positions[0], glm::dvec3(1.5, 0.0, 2.0));
  EXPECT_EQ(mesh->pieces[0].names, std::vector<std::string>{"#1"});
  EXPECT_FALSE(read_obj("v +-1 0 0\nv 0 0 0\nv 0 1 0\nf 1 2 3\n", "q.obj"));
}

// Mirrored quads are cut alike, wherever their corners begin.
TEST(ObjRead, CutsQuadsAlongTheirShorterDiagonal) {
  const std::string slanted = "v 0 0 0\nv 3 0 0\nv 4 1 0\nv 1 1 0\nv 0 0 0\nv -3 0 0\nv -4 1 0\nv -1 1 0\n";
  for (const std::string faces : {"f 1 2 3 4\nf 5 8 7 6\n", "f 2 3 4 1\nf 6 5 8 7\n"}) {
    const auto mesh = read_obj(slanted + faces, "q.obj");
    ASSERT_TRUE(mesh);
    ASSERT_EQ(mesh->pieces[0].triangles.size(), 4U);
    for (const auto& t : mesh->pieces[0].triangles) {
      const auto has = [&](std::uint32_t v) { return t[0] == v || t[1] == v || t[2] == v; };
      EXPECT_TRUE((has(1) && has(3)) || (has(5) && has(7)));
    }
  }
}

TEST(ObjRead, APolygonOfManyCornersIsAFan) {
  const auto mesh = read_obj("v 0 0 0\nv 1 0 0\nv 2 1 0\nv 1 2 0\nv 0 1 0\nf 1 2 3 4 5\n", "p.obj");
  ASSERT_TRUE(mesh);
  EXPECT_EQ(mesh->pieces[0].triangles.size(), 3U);
}

TEST(ObjRead, HostileFilesAreRefused) {
  EXPECT_EQ(kind("", "x.obj"), "face_empty");
  EXPECT_EQ(kind("v 0 0\nf 1 1 1\n", "x.obj"), "face_bad_number");
  EXPECT_EQ(kind("v 0 0 nan\n", "x.obj"), "face_bad_number");
  EXPECT_EQ(kind("v 0 0 1e300\n", "x.obj"), "face_bad_number");
  EXPECT_EQ(kind(std::string(kQuad) + "f 1 2 5\n", "x.obj"), "face_bad_index");
  EXPECT_EQ(kind(std::string(kQuad) + "f 0 1 2\n", "x.obj"), "face_bad_index");
  EXPECT_EQ(kind(std::string(kQuad) + "f -5 1 2\n", "x.obj"), "face_bad_index");
  EXPECT_EQ(kind(std::string(kQuad) + "f 1 2\n", "x.obj"), "face_bad_index");
  EXPECT_EQ(kind(std::string(kQuad) + "f 1 2 99999999999999999999\n", "x.obj"), "face_bad_index");
  std::string many = kQuad;
  many += "f";
  for (int i = 0; i < 300; ++i) many += " 1";
  EXPECT_EQ(kind(many + "\n", "x.obj"), "face_too_large");
  PolygonLimits few;
  few.vertices = 3;
  EXPECT_EQ(read_obj(kQuad, "x.obj", few).error().kind, "face_too_large");
  few = {};
  few.triangles = 1;
  EXPECT_EQ(read_obj(std::string(kQuad) + "f 1 2 3 4\n", "x.obj", few).error().kind, "face_too_large");
  few = {};
  few.bytes = 8;
  EXPECT_EQ(read_obj(kQuad, "x.obj", few).error().kind, "face_too_large");
  EXPECT_EQ(read_obj(std::string(kQuad) + "f 1 2 3\nf 1 2 7\n", "x.obj").error().place, "x.obj:6");
  EXPECT_EQ(kind("anything", "x.txt"), "face_unknown_format");
}

// ------------------------------------------------------------------------------------------------ forms

TEST(PolygonFace, TurnsTheFilesAxesAndUnits) {
  FaceForm form;
  form.unit_m = 0.01;
  form.up = program::Axis::z;
  form.forward = program::Axis::minus_y;
  form.origin = {0.0, 0.5, 0.0};
  form.landmarks.push_back({"nose_tip", 2, "", {}});
  const auto face = read_face("v 0 0 0\nv 1 0 0\nv 1 -2 3\nf 1 2 3\n", "x.obj", form);
  ASSERT_TRUE(face) << face.error().cause;
  const glm::dvec3 p = face->landmarks.at("nose_tip");
  EXPECT_NEAR(glm::distance(p, glm::dvec3(0.01, 0.03 - 0.5, 0.02)), 0.0, 1e-12);
  EXPECT_EQ(face->skin.surface.rows, 3U);
}

TEST(PolygonFace, PartsAreTakenByNameAndByVertices) {
  const std::string text = std::string(kQuad) + "g head_left\nf 1 2 3\ng head_right\nf 1 3 4\ng rest\nf 1 2 4\n";
  FaceForm form;
  form.parts = {{program::FacePartKind::skin, "head_*", 0, program::kNone},
                {program::FacePartKind::teeth_lower, "", 0, 3}};
  const auto face = read_face(text, "x.obj", form);
  ASSERT_TRUE(face) << face.error().cause;
  ASSERT_EQ(face->skin.primitives.size(), 1U);
  EXPECT_EQ(face->skin.primitives[0].triangles.size(), 6U);
  ASSERT_EQ(face->rigid.size(), 1U);
  EXPECT_EQ(face->rigid[0].name, "teeth_lower");
  EXPECT_EQ(face->rigid[0].frame, Frame::jaw);
  form.parts.push_back({program::FacePartKind::tongue, "tongue", 0, program::kNone});
  EXPECT_EQ(kind(text, "x.obj", form), "face_no_part");
  form.parts = {{program::FacePartKind::skin, "*", 0, program::kNone}};
  EXPECT_EQ(kind(std::string(kQuad) + "f 1 2 3\n", "x.obj", form), "none") << "what has no name fits too";
  form.parts = {{program::FacePartKind::skin, "rest", 0, program::kNone}};
  form.bounded = true;
  form.low = glm::dvec3(5.0);
  form.high = glm::dvec3(6.0);
  const auto elsewhere = read_face(text, "x.obj", form);
  ASSERT_FALSE(elsewhere);
  EXPECT_EQ(elsewhere.error().kind, "face_no_part");
  EXPECT_NE(elsewhere.error().cause.find("it lies from ("), std::string::npos) << elsewhere.error().cause;
}

// Lashes get the weights of the skin that they stand on, and are vertices of the skin themselves.
TEST(PolygonFace, LashesGoWithTheSkinNextToThem) {
  std::string text = "g skin\n";
  for (int y = 0; y < 5; ++y)
    for (int x = -3; x <= 3; ++x) text += fmt::format("v {} {} 0.1\n", 0.01 * x, 0.05 * y - 0.1);
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 6; ++x) {
      const int a = 7 * y + x + 1;
      text += fmt::format("f {} {} {} {}\n", a, a + 1, a + 8, a + 7);
    }
  text += "g lash\nv 0 -0.1 0.101\nv 0.001 -0.1 0.102\nv 0 0.1 0.101\nf 36 37 38\n";
  FaceForm form;
  form.parts = {{program::FacePartKind::skin, "skin", 0, program::kNone},
                {program::FacePartKind::lashes, "lash", 0, program::kNone}};
  form.landmarks = {{"menton", program::kNone, "", {0.0, -0.05, 0.1}},
                    {"stomion", program::kNone, "", {0.0, 0.0, 0.1}},
                    {"jaw_hinge_L", program::kNone, "", {0.06, 0.02, 0.0}}};
  const auto face = read_face(text, "x.obj", form);
  ASSERT_TRUE(face) << face.error().cause;
  ASSERT_EQ(face->skin.points.size(), 38U);
  EXPECT_EQ(face->skin.surface.rows, 38U);
  const std::vector<float>& jaw = face->regions.at("jaw");
  ASSERT_EQ(jaw.size(), 38U);
  EXPECT_EQ(jaw[35], jaw[3]);       // the lowest row's middle
  EXPECT_EQ(jaw[37], jaw[28 + 3]);  // the highest's
  EXPECT_NE(jaw[35], jaw[37]);
  EXPECT_EQ(face->skin.colors.size(), 38U);
}

TEST(PolygonFace, LandmarksMustBeThere) {
  FaceForm form;
  form.landmarks.push_back({"nose_tip", 4, "", {}});
  EXPECT_EQ(kind(std::string(kQuad) + "f 1 2 3\n", "x.obj", form), "face_bad_landmark");
  form.landmarks = {{"nose_tip", program::kNone, "dorsum", {0.5, 0.5, 0.0}}};
  EXPECT_EQ(kind(std::string(kQuad) + "f 1 2 3\n", "x.obj", form), "face_bad_landmark");
}

TEST(PolygonFace, PatternsFit) {
  EXPECT_TRUE(fits("helper-*-eye", "helper-l-eye"));
  EXPECT_TRUE(fits("*", ""));
  EXPECT_TRUE(fits("a*b*c", "axxbyybzc"));
  EXPECT_FALSE(fits("a*b", "axxc"));
  EXPECT_FALSE(fits("abc", "abcd"));
  EXPECT_TRUE(fits(std::string(2000, '*') + "b", std::string(2000, 'a') + "b"));
}

TEST(SphereFit, FindsABallAndRefusesAPlane) {
  std::vector<glm::vec3> points;
  const glm::vec3 centre(0.031F, 0.036F, 0.08F);
  for (const glm::vec3& d : {glm::vec3(1, 0, 0), glm::vec3(0, 1, 0), glm::vec3(0, 0, 1), glm::vec3(-1, 0, 0),
                             glm::vec3(0.6F, 0.8F, 0), glm::vec3(0, 0.6F, 0.8F)})
    points.push_back(centre + 0.012F * d);
  const auto ball = fit_sphere(points);
  ASSERT_TRUE(ball);
  EXPECT_NEAR(glm::distance(ball->centre, glm::dvec3(centre)), 0.0, 1e-7);
  EXPECT_NEAR(ball->radius, 0.012, 1e-7);
  for (glm::vec3& p : points) p.z = 0.0F;
  EXPECT_FALSE(fit_sphere(points));
  EXPECT_FALSE(fit_sphere({}));
}

TEST(SurfaceGraph, MeasuresAlongTheSkinAndFindsWhatALineEncloses) {
  // A strip of five by three vertices.
  std::vector<glm::dvec3> p;
  std::vector<std::array<std::uint32_t, 3>> t;
  for (int y = 0; y < 3; ++y)
    for (int x = 0; x < 5; ++x) p.emplace_back(x, y, 0);
  for (std::uint32_t y = 0; y < 2; ++y)
    for (std::uint32_t x = 0; x < 4; ++x) {
      t.push_back({y * 5 + x, y * 5 + x + 1, y * 5 + x + 6});
      t.push_back({y * 5 + x, y * 5 + x + 6, y * 5 + x + 5});
    }
  const SurfaceGraph graph(p, t);
  const std::uint32_t from[] = {0};
  const auto d = graph.distances(from);
  EXPECT_DOUBLE_EQ(d[4], 4.0);
  EXPECT_EQ(graph.distances(from, 1.5)[4], SurfaceGraph::kFar);
  EXPECT_EQ(graph.path(0, 4).size(), 5U);
  const std::uint32_t wall[] = {2, 7, 12};
  const auto seen = graph.reached(0, wall);
  EXPECT_TRUE(seen[11]);
  EXPECT_FALSE(seen[2] || seen[3] || seen[13]);
  EXPECT_EQ(graph.nearest({3.2, 0.9, 5.0}), 8U);
}

// ------------------------------------------------------------------------------------------------ VRML

constexpr const char* kXml = R"(<X3D version='3.3'><Scene>
<Transform translation='1 2 3' scale='2 2 2'><Shape><Appearance><Material diffuseColor='0.5 0.25 1'/></Appearance>
<NurbsPatchSurface DEF='patch' uDimension='3' vDimension='2' uOrder='3' vOrder='2' uKnot='0 0 0 1 1 1' weight='1 2 1 1 2 1' solid='false'>
<Coordinate containerField='controlPoint' point='0 0 0, 1 1 0, 2 0 0, 0 0 1, 1 1 1, 2 0 1'/></NurbsPatchSurface></Shape></Transform>
<Shape><NurbsPatchSurface USE='patch'/></Shape></Scene></X3D>)";

constexpr const char* kClassic = R"(#X3D V3.3 utf8
PROFILE Immersive COMPONENT NURBS:1
META "title" "a patch { [ # not a comment"
# PROTO in a comment {
PROTO Odd [ inputOutput SFInt32 n 3  field MFString s [ "]" "}" ] ] { Shape { geometry NurbsPatchSurface { uDimension IS n } } }
EXTERNPROTO Other [ eventIn SFBool b ] [ "http://nowhere" ]
DEF script Script { inputOnly SFFloat t url "javascript: function f(){ if (a) { b[0] = '}'; } }" }
Transform { translation 1 2 3 scale 2,2,2 children [
  Shape { appearance Appearance { material Material { diffuseColor 0.5 0.25 1 } }
    geometry DEF patch NurbsPatchSurface { uDimension 3 vDimension 2 uOrder 3 vOrder 2
      uKnot [ 0 0,0 ,1 1 1 ] weight [1 2 1 1 2 1] solid FALSE
      controlPoint Coordinate { point [ 0 0 0, 1 1 0, 2 0 0 0 0 1, 1 1 1 , 2 0 1, ] } } } ] }
Shape { geometry USE patch }
ROUTE script.out TO patch.set_weight
)";

constexpr const char* kVrml97 = R"(#VRML V2.0 utf8
Transform { translation 1 2 3 scale 2 2 2 children Shape { appearance Appearance { material Material { diffuseColor 0.5 0.25 1 } }
    geometry DEF patch NurbsSurface { uDimension 3 vDimension 2 uOrder 3 vOrder 2 uTessellation 0
      uKnot [ 0 0 0 1 1 1 ] weight [ 1 2 1 1 2 1 ] solid FALSE
      controlPoint [ 0 0 0, 1 1 0, 2 0 0, 0 0 1, 1 1 1, 2 0 1 ] } } }
Shape { geometry USE patch }
)";

TEST(VrmlRead, AllThreeSpellingsAreOneFace) {
  const auto xml = read_face(kXml, "a.x3d", {});
  ASSERT_TRUE(xml) << xml.error().cause;
  EXPECT_GT(xml->skin.surface.rows, 8U);
  for (const char* other : {kClassic, kVrml97}) {
    const auto face = read_face(other, "a.wrl", {});
    ASSERT_TRUE(face) << face.error().place << ": " << face.error().cause;
    ASSERT_EQ(face->skin.points.size(), xml->skin.points.size());
    for (std::size_t i = 0; i < xml->skin.points.size(); ++i) EXPECT_EQ(face->skin.points[i], xml->skin.points[i]);
    EXPECT_EQ(face->skin.surface.value, xml->skin.surface.value);
    ASSERT_EQ(face->materials.size(), xml->materials.size());
    EXPECT_EQ(face->materials[0].base_color, xml->materials[0].base_color);
  }
}

TEST(VrmlRead, OfSwitchesAndLevelsOneChildIsShown) {
  const auto points = [](const std::string& scene) -> std::size_t {
    const auto patch = [](double x) {
      return fmt::format(
          "Shape {{ geometry NurbsPatchSurface {{ uDimension 2 vDimension 2 uOrder 2 vOrder 2 controlPoint "
          "Coordinate {{ point [ {0} 0 0 {1} 0 0 {0} 1 0 {1} 1 0 ] }} }} }}",
          x, x + 1.0);
    };
    const auto face =
        read_face("#X3D V3.3 utf8\n" + fmt::format(fmt::runtime(scene), patch(0.0), patch(5.0)), "s.x3dv", {});
    return face ? face->skin.points.size() : 0;
  };
  EXPECT_EQ(points("{} {}"), 8U);
  EXPECT_EQ(points("Switch {{ whichChoice 1 children [ {} {} ] }}"), 4U);
  EXPECT_EQ(points("Switch {{ whichChoice 0 choice [ {} {} ] }}"), 4U);
  EXPECT_EQ(points("Switch {{ children [ {} {} ] }}"), 0U);
  EXPECT_EQ(points("Switch {{ whichChoice 7 children [ {} {} ] }}"), 0U);
  EXPECT_EQ(points("LOD {{ range [ 5 ] level [ {} {} ] }}"), 4U);
  EXPECT_EQ(points("Group {{ children {} }} Group {{ visible FALSE children {} }}"), 4U);
  EXPECT_EQ(
      points("Layer {{ children [ Billboard {{ children {} }} CADPart {{ children CADFace {{ shape {} }} }} ] }}"), 8U);
}

// A scale along axes of its own: twice as long along the diagonal, turned by a right angle about a centre.
TEST(VrmlRead, ScalesAlongItsOwnAxes) {
  const std::string patch =
      "Transform { center 1 0 0 rotation 0 0 1 1.5707963267948966 scaleOrientation 0 0 1 0.7853981633974483 scale 2 1 "
      "1 "
      "children Shape { geometry NurbsPatchSurface { uDimension 2 vDimension 2 uOrder 2 vOrder 2 controlPoint "
      "Coordinate { point [ 1 0 0 2 1 0 0 1 0 1 2 0 ] } } } }";
  const auto face = read_face("#X3D V3.3 utf8\n" + patch, "u.x3dv", {});
  ASSERT_TRUE(face) << face.error().cause;
  // (2, 1) is on the diagonal through the centre; (0, 1) across it.
  for (const glm::dvec3 wanted : {glm::dvec3(1, 0, 0), glm::dvec3(-1, 2, 0), glm::dvec3(0, -1, 0)}) {
    double nearest = 10.0;
    for (const glm::dvec3& p : face->skin.points) nearest = std::min(nearest, glm::distance(p, wanted));
    EXPECT_LT(nearest, 1e-12) << wanted.x << ' ' << wanted.y;
  }
}

TEST(VrmlRead, UnitsOfLengthAndAngleCount) {
  const std::string patch =
      "Transform { rotation 0 0 1 90 children Shape { geometry NurbsPatchSurface { uDimension 2 vDimension 2 uOrder 2 "
      "vOrder 2 controlPoint Coordinate { point [ 0 0 0 10 0 0 0 10 0 10 10 0 ] } } } }";
  const auto face =
      read_face("#X3D V3.3 utf8\nUNIT angle degree 0.017453292519943295\nUNIT length cm 0.01\n" + patch, "u.x3dv", {});
  ASSERT_TRUE(face) << face.error().cause;
  ASSERT_EQ(face->skin.points.size(), 4U);
  double nearest = 1.0;
  for (const glm::dvec3& p : face->skin.points)
    nearest = std::min(nearest, glm::distance(p, glm::dvec3(-0.1, 0.1, 0.0)));
  EXPECT_LT(nearest, 1e-9);
}

TEST(VrmlRead, HostileFilesAreRefused) {
  const std::string head = "#VRML V2.0 utf8\n";
  EXPECT_EQ(kind(head, "x.wrl"), "face_empty");
  EXPECT_EQ(kind(head + "Shape {", "x.wrl"), "face_not_vrml");
  EXPECT_EQ(kind(head + "Shape { geometry", "x.wrl"), "face_not_vrml");
  EXPECT_EQ(kind(head + "Shape { geometry [ }", "x.wrl"), "face_not_vrml");
  EXPECT_EQ(kind(head + "12 13", "x.wrl"), "face_not_vrml");
  EXPECT_EQ(kind(head + "}", "x.wrl"), "face_not_vrml");
  EXPECT_EQ(kind(head + "\"open", "x.wrl"), "face_not_vrml");
  EXPECT_EQ(kind(head + "\"\\", "x.wrl"), "face_not_vrml");
  EXPECT_EQ(kind(head + "PROTO a [ } ] { }", "x.wrl"), "face_not_vrml");
  EXPECT_EQ(kind(head + "Script { [ }", "x.wrl"), "face_not_vrml");
  EXPECT_EQ(kind(head + "ROUTE a", "x.wrl"), "face_not_vrml");
  EXPECT_EQ(kind(head + "DEF a Group { children USE a }", "x.wrl"), "face_bad_reference");
  EXPECT_EQ(kind(head + "Shape { geometry NurbsSurface { uDimension 3 } }", "x.wrl"), "face_bad_surface");
  std::string deep = head;
  for (int i = 0; i < 100000; ++i) deep += "Group { children [ ";
  EXPECT_EQ(kind(deep, "x.wrl"), "face_not_vrml");
  const auto face = read_face(head + "\n\nShape { geometry NurbsSurface { uDimension x } }", "x.wrl", {});
  ASSERT_FALSE(face);
  EXPECT_NE(face.error().place.find("x.wrl:4"), std::string::npos) << face.error().place;
}

TEST(NurbsFace, PartsAndPlacesOnSurfaces) {
  FaceForm form;
  form.unit_m = 0.001;
  form.landmarks.push_back({"nose_tip", program::kNone, "patch", {0.0, 1.0, 0.0}});
  auto face = read_face(kXml, "a.x3d", form);
  ASSERT_TRUE(face) << face.error().cause;
  EXPECT_NEAR(glm::distance(face->landmarks.at("nose_tip"), glm::dvec3(0.001, 0.002, 0.005)), 0.0, 1e-9);
  form.landmarks[0].surface = "nothing";
  EXPECT_EQ(kind(kXml, "a.x3d", form), "face_bad_landmark");
  form.landmarks = {{"nose_tip", 3, "", {}}};
  EXPECT_EQ(kind(kXml, "a.x3d", form), "face_bad_landmark");
  form.landmarks.clear();
  form.parts = {{program::FacePartKind::teeth_upper, "pat*", 0, program::kNone}};
  face = read_face(kXml, "a.x3d", form);
  ASSERT_TRUE(face) << face.error().cause;
  EXPECT_EQ(face->rigid.size(), 1U);
  EXPECT_EQ(face->skin.points.size(), 0U);
  form.parts[0].name = "other";
  EXPECT_EQ(kind(kXml, "a.x3d", form), "face_no_part");
}

TEST(NurbsFace, SurfacesAreCalledAsWhatTheyStandIn) {
  const std::string patch =
      "geometry NurbsSurface { uDimension 2 vDimension 2 uOrder 2 vOrder 2 uKnot [ 0 0 1 1 ] vKnot [ 0 0 1 1 ] "
      "controlPoint [ 0 0 0, 1 0 0, 0 1 0, 1 1 0 ] }";
  const std::string text = "#VRML V2.0 utf8\nDEF head Transform { children [ Shape { " + patch +
                           " } DEF teeth Shape { " + patch + " } ] }\nShape { " + patch + " }\n";
  for (const char* name : {"head", "teeth", "surface_2"}) {
    FaceForm form;
    form.parts = {{program::FacePartKind::skin, name, 0, program::kNone}};
    EXPECT_EQ(kind(text, "x.wrl", form), "none") << name;
  }
  FaceForm form;
  form.parts = {{program::FacePartKind::skin, "surface_0", 0, program::kNone}};
  EXPECT_EQ(kind(text, "x.wrl", form), "face_no_part");
}

// Files as they are found, of other programs. NMS_FACES names their folder.
TEST(NurbsFace, FilesFromTheWildAreRead) {
  const char* given = std::getenv("NMS_FACES");
  const fs::path folder = given != nullptr ? fs::path(given) : fs::path(NMS_SOURCE_DIR) / "../shared/data/faces";
  if (!fs::is_directory(folder / "nurbs")) GTEST_SKIP() << "no faces at " << folder << ": set NMS_FACES";
  const std::pair<const char*, std::size_t> kFiles[] = {{"FourDucks.x3dv", 2000},
                                                        {"MobiusNurbs.x3dv", 500},
                                                        {"NurbsPatch.x3dv", 10},
                                                        {"NurbsPatchSurfaceExample.x3dv", 20},
                                                        {"NurbsPrimitives.x3d", 100},
                                                        {"NurbsSphere.x3d", 40},
                                                        {"NurbsSurfaceInterpolator.x3d", 20}};
  for (const auto& [name, least] : kFiles) {
    const auto face = read_face(read_file(folder / "nurbs" / name), name, {});
    ASSERT_TRUE(face) << name << ": " << face.error().cause;
    EXPECT_GE(face->skin.surface.rows, least) << name;
  }
  // Its surfaces are made by a script, which nobody runs.
  EXPECT_EQ(kind(read_file(folder / "nurbs/torus.x3d"), "torus.x3d"), "face_empty");
}

// ------------------------------------------------------------------------------------------------ writing

TEST(FaceX3dWrite, WhatIsWrittenReadsBackTheSame) {
  FaceFile file;
  file.title = "two patches";
  file.materials.push_back({"skin", {0.5F, 0.25F, 0.125F, 1.0F}, 0.5F, 0.0F, false});
  for (int k = 0; k < 2; ++k) {
    FaceFileSurface s;
    s.geometry.name = k == 0 ? "left" : "right";
    s.geometry.degree_u = 2;
    s.geometry.degree_v = 1;
    s.geometry.knots_u = {0, 0, 0, 0.5, 1, 1, 1};
    s.geometry.knots_v = {0, 0, 1, 1};
    s.geometry.weights = {1, 2, 1, 1, 1, 2, 1, 1};
    for (int v = 0; v < 2; ++v)
      for (int u = 0; u < 4; ++u) s.points.emplace_back(0.01 * u + 0.1 * k, 0.02 * v, 0.003 * u * (3 - u));
    s.regions["jaw"] = {0, 0.25F, 0.5F, 1, 0, 0, 0, 0};
    s.samples = {3, 2};
    file.surfaces.push_back(s);
  }
  const std::string once = write_face_x3d(file);
  const auto face = read_face(once, "w.x3d", {});
  ASSERT_TRUE(face) << face.error().cause;
  ASSERT_EQ(face->skin.points.size(), 16U);
  for (const FaceFileSurface& s : file.surfaces)
    for (const glm::dvec3& p : s.points) {
      double least = 1.0;
      for (const glm::dvec3& q : face->skin.points) least = std::min(least, glm::distance(p, q));
      EXPECT_LT(least, 1e-7);
    }
  const std::vector<float>& jaw = face->regions.at("jaw");
  ASSERT_EQ(jaw.size(), 16U);
  std::vector<glm::dvec3> vertices;
  for (const glm::dvec3& p : places_at_rest(face->skin)) vertices.push_back(p);
  const auto away = [](const std::vector<glm::dvec3>& places, const glm::dvec3& p) {
    double least = 1.0;
    for (const glm::dvec3& q : places) least = std::min(least, glm::distance(p, q));
    return least;
  };
  for (const FaceFileSurface& s : file.surfaces) {
    for (std::size_t i = 0; i < s.points.size(); ++i)
      for (std::size_t k = 0; k < 16; ++k)
        if (glm::distance(face->skin.points[k], s.points[i]) < 1e-7) {
          EXPECT_NEAR(jaw[k], s.regions.at("jaw")[i], 1e-3F) << i;
        }
    // The weights are there: without them the surface lies elsewhere.
    const auto at = [&](std::vector<double> weights) {
      const NetSurface& g = s.geometry;
      return evaluate(NurbsSurface{g.degree_u, g.degree_v, 4, 2, g.knots_u, g.knots_v, s.points, std::move(weights)},
                      0.5 / 3.0, 0.0)
          .point;
    };
    EXPECT_LT(away(vertices, at(s.geometry.weights)), 1e-6);
    EXPECT_GT(away(vertices, at(std::vector<double>(8, 1.0))), 1e-4);
  }
  EXPECT_NEAR(face->materials[0].base_color.x, 0.5F, 2e-3F);
}

// ------------------------------------------------------------------------------------------------ glTF

TEST(GltfMeshRead, AFaceThatWasExportedReadsBack) {
  const program::Image image = test_program("");
  const Face face = test_face();
  const auto rig = bind(face, image.program());
  ASSERT_TRUE(rig);
  GltfOptions options;
  options.all_targets = true;
  const auto glb = export_glb(face, *rig, image.program(), options);
  ASSERT_TRUE(glb) << glb.error().cause;
  const std::string_view bytes(reinterpret_cast<const char*>(glb->data()), glb->size());
  const auto mesh = read_gltf_mesh(bytes, "f.glb");
  ASSERT_TRUE(mesh) << mesh.error().cause;
  std::size_t triangles = 0;
  std::size_t wanted = 0;
  for (const PolygonMesh::Piece& p : mesh->pieces) triangles += p.triangles.size();
  for (const Primitive& p : face.skin.primitives) wanted += p.triangles.size() / 3;
  for (const RigidMesh& m : face.rigid)
    for (const Primitive& p : m.primitives) wanted += p.triangles.size() / 3;
  EXPECT_EQ(triangles, wanted);
  // Each vertex where the face has one, and none of the face left out.
  std::vector<glm::dvec3> places = places_at_rest(face.skin);
  for (const RigidMesh& m : face.rigid)
    for (const glm::vec3& p : m.positions) places.emplace_back(p);
  const auto far = [](const std::vector<glm::dvec3>& from, const std::vector<glm::dvec3>& to) {
    double most = 0.0;
    for (const glm::dvec3& p : from) {
      double least = 1.0;
      for (const glm::dvec3& q : to) least = std::min(least, glm::distance(p, q));
      most = std::max(most, least);
    }
    return most;
  };
  EXPECT_LT(far(places, mesh->positions), 1e-6);
  EXPECT_LT(far(mesh->positions, places), 1e-6);
  // Every shorter file, and every byte changed, is refused or read: never more.
  for (std::size_t size = 0; size < bytes.size(); size += 1 + bytes.size() / 97)
    static_cast<void>(read_gltf_mesh(bytes.substr(0, size), "f.glb"));
  std::string changed(bytes);
  for (std::size_t i = 12; i < std::min<std::size_t>(changed.size(), 6000); i += 7) {
    const char before = changed[i];
    changed[i] = static_cast<char>(before ^ 0x15);
    static_cast<void>(read_gltf_mesh(changed, "f.glb"));
    changed[i] = before;
  }
}

// A skin's joints say where its vertices are, and not the mesh's own node: in a quantized file the difference is the
// grid.
TEST(GltfMeshRead, SkinsStandWhereTheirJointsPutThem) {
  const program::Image image = test_program("");
  const Face face = test_face();
  const auto rig = bind(face, image.program());
  ASSERT_TRUE(rig);
  const std::vector<glm::dvec3> wanted = places_at_rest(face.skin);
  for (const bool quantize : {false, true}) {
    GltfOptions options;
    options.all_targets = true;
    options.quantize = quantize;
    const auto glb = export_glb(face, *rig, image.program(), options);
    ASSERT_TRUE(glb) << glb.error().cause;
    const auto mesh = read_gltf_mesh({reinterpret_cast<const char*>(glb->data()), glb->size()}, "f.glb");
    ASSERT_TRUE(mesh) << mesh.error().place << mesh.error().cause;
    ASSERT_GE(mesh->positions.size(), wanted.size());
    double furthest = 0.0;
    for (const glm::dvec3& p : wanted) {
      double nearest = 1.0;
      for (const glm::dvec3& q : mesh->positions) nearest = std::min(nearest, glm::distance(p, q));
      furthest = std::max(furthest, nearest);
    }
    EXPECT_LT(furthest, 2e-5) << quantize;
  }
}

TEST(GltfMeshRead, WhatIsMirroredIsNotInsideOut) {
  const auto corners = [](const char* scale) {
    const auto mesh = read_gltf_mesh(
        std::string(R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0,"scale":)") +
            scale +
            R"(}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"accessors":[)"
            R"({"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],"bufferViews":[{"buffer":0,"byteLength":36}],)"
            R"("buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]})",
        "m.gltf");
    EXPECT_TRUE(mesh) << mesh.error().cause;
    return mesh->pieces.at(0).triangles.at(0);
  };
  EXPECT_EQ(corners("[1,1,1]"), (std::array<std::uint32_t, 3>{0, 1, 2}));
  EXPECT_EQ(corners("[-1,1,1]"), (std::array<std::uint32_t, 3>{0, 2, 1}));
  EXPECT_EQ(corners("[-1,-1,1]"), (std::array<std::uint32_t, 3>{0, 1, 2}));
}

TEST(GltfMeshRead, HostileFilesAreRefused) {
  EXPECT_EQ(kind("glTF", "x.glb"), "face_not_gltf");
  EXPECT_EQ(kind("{}", "x.gltf"), "face_not_gltf");
  EXPECT_EQ(kind("{\"asset\":{\"version\":\"2.0\"}}", "x.gltf"), "face_empty");
  // A triangle of 36 bytes; what follows is wrong in one thing each.
  const auto file = [](const std::string& accessor, const std::string& nodes, const std::string& indices = "") {
    return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":)" + nodes +
           R"(,"meshes":[{"name":"m","primitives":[{"attributes":{"POSITION":0})" + indices + R"(}]}],"accessors":[)" +
           accessor +
           R"(],"bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]})";
  };
  const std::string good = R"({"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"})";
  const std::string node = R"([{"mesh":0,"translation":[1,0,0]}])";
  EXPECT_EQ(kind(file(good, node), "x.gltf"), "none");
  EXPECT_EQ(kind(file(R"({"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"})", node), "x.gltf"),
            "face_bad_index");
  EXPECT_EQ(
      kind(file(R"({"bufferView":0,"byteOffset":4,"componentType":5126,"count":3,"type":"VEC3"})", node), "x.gltf"),
      "face_bad_index");
  EXPECT_EQ(kind(file(R"({"bufferView":0,"componentType":5126,"count":3,"type":"VEC2"})", node), "x.gltf"),
            "face_bad_index");
  EXPECT_EQ(kind(file(R"({"bufferView":9,"componentType":5126,"count":3,"type":"VEC3"})", node), "x.gltf"),
            "face_bad_index");
  EXPECT_EQ(kind(file(good, R"([{"mesh":7}])"), "x.gltf"), "face_bad_index");
  EXPECT_EQ(kind(file(good, R"([{"mesh":0,"children":[0]}])"), "x.gltf"), "face_bad_index");
  EXPECT_EQ(kind(file(good, node, R"(,"indices":0)"), "x.gltf"), "face_bad_index");
}

}  // namespace
}  // namespace nms::runtime
