#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <nms/runtime/face_x3d.h>
#include <nms/runtime/polygon_mesh.h>
#include <nms/stdlib/embedded.h>

#include "displacement_fields.h"
#include "fit_program.h"
#include "muscle_fit.h"

namespace nms::fit_muscles {
namespace {

using program::Muscle;

/// The skin of ada, thinned to 50 columns and rows or so: places enough for every muscle, few enough to be quick.
const runtime::PolygonMesh& thin_ada() {
  static const runtime::PolygonMesh mesh = [] {
    runtime::Face face;
    for (const auto& file : stdlib::embedded_files()) {
      if (file.path == "faces/ada.x3d") face = runtime::read_face_x3d(file.text, "ada.x3d", {0.5, 400'000}).value();
    }
    runtime::PolygonMesh made;
    const runtime::SparseMatrix& t = face.skin.surface;
    for (std::uint32_t v = 0; v < t.rows; ++v) {
      glm::dvec3 p(face.skin.offsets[v]);
      for (std::uint32_t k = t.row_begin[v]; k < t.row_begin[v + 1]; ++k) {
        p += static_cast<double>(t.value[k]) * face.skin.points[t.column[k]];
      }
      made.positions.push_back(1000.0 * p);  // mm
    }
    runtime::PolygonMesh::Piece piece;
    for (const runtime::Primitive& primitive : face.skin.primitives) {
      for (std::size_t i = 0; i + 2 < primitive.triangles.size(); i += 3) {
        piece.triangles.push_back({primitive.triangles[i], primitive.triangles[i + 1], primitive.triangles[i + 2]});
      }
    }
    made.pieces.push_back(std::move(piece));
    return made;
  }();
  return mesh;
}

std::string obj_text(const runtime::PolygonMesh& mesh, const std::vector<glm::dvec3>& moved_m) {
  std::string text;
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const glm::dvec3 p = mesh.positions[i] + (moved_m.empty() ? glm::dvec3(0.0) : 1000.0 * moved_m[i]);
    text += fmt::format("v {:.6f} {:.6f} {:.6f}\n", p.x, p.y, p.z);
  }
  for (const auto& [a, b, c] : mesh.pieces[0].triangles) text += fmt::format("f {} {} {}\n", a + 1, b + 1, c + 1);
  return text;
}

class FitMuscles : public testing::Test {
 protected:
  void compile(const std::vector<std::string>& units) {
    std::string said;
    image_ = compile_face({}, "ada", units, said);
    ASSERT_TRUE(image_.has_value()) << said;
    rest_ = rest_mesh(thin_ada(), 0.001);
    truth_.assign(program().muscles.begin(), program().muscles.end());
    shares_.clear();
    for (const program::Actuation& a : program().actuations) shares_.push_back(static_cast<double>(a.share));
  }

  const program::Program& program() { return image_->program(); }

  template <typename Change>
  void change(const std::string& muscle, Change how) {
    for (Muscle& m : truth_) {
      if (plain_muscle(program(), m) == muscle) how(m);
    }
  }

  /// What the true muscles show, through OBJ text as a file would bring it.
  Expression measured(const std::string& name) {
    const auto units = expression_of(name, thin_ada(), rest_, 0.001, program()).value().units;
    const auto moved = displacements(program(), truth_, shares_, rest_, units);
    const auto mesh = runtime::read_obj(obj_text(thin_ada(), moved), "moved.obj");
    return expression_of(name, mesh.value(), rest_, 0.001, program()).value();
  }

  tl::expected<FitResult, program::Failure> fit(std::span<const Expression> fields, const FitSettings& settings) {
    Measured all;
    all.rest = &rest_;
    all.fields = fields;
    return fit_muscles(program(), all, settings);
  }

  const Muscle& left(const std::vector<Muscle>& muscles, const std::string& name) {
    for (const Muscle& m : muscles) {
      if (m.side != program::Side::right && plain_muscle(program(), m) == name) return m;
    }
    ADD_FAILURE() << name;
    return muscles.front();
  }

  std::optional<program::Image> image_;
  RestMesh rest_;
  std::vector<Muscle> truth_;
  std::vector<double> shares_;
};

TEST_F(FitMuscles, a_linear_muscle_is_found_again) {
  compile({"AU12"});
  change("zygomatic_major", [](Muscle& m) {
    m.attachment_offset[0] += m.side == program::Side::right ? 0.004F : 0.004F;
    m.attachment_offset[1] -= 0.003F;
    m.angle *= 0.85F;
    m.insertion_radius += 0.005F;
    m.dissipation_radius += 0.009F;
    m.limit *= 1.2F;
  });
  FitSettings settings;
  settings.muscles = {"zygomatic_major"};
  settings.stiffness = 1e-8;
  const auto result = fit(std::array{measured("AU12")}, settings);
  ASSERT_TRUE(result.has_value()) << result.error().cause;
  ASSERT_EQ(result->errors.size(), 1U);
  EXPECT_GT(result->errors[0].before_rms_mm, 0.1);
  EXPECT_LT(result->errors[0].after_rms_mm, 0.01 * result->errors[0].before_rms_mm);
  EXPECT_LT(result->errors[0].after_max_mm, 0.05);
  const Muscle& found = left(result->muscles, "zygomatic_major");
  const Muscle& truth = left(truth_, "zygomatic_major");
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(found.attachment_offset[i], truth.attachment_offset[i], 0.0005) << i;
  }
  EXPECT_NEAR(found.angle, truth.angle, 0.02);
  EXPECT_NEAR(found.insertion_radius, truth.insertion_radius, 0.0005);
  EXPECT_NEAR(found.dissipation_radius, truth.dissipation_radius, 0.0005);
  // Nobody else was touched.
  EXPECT_EQ(left(result->muscles, "malar_pad").amount, left(truth_, "malar_pad").amount);
}

TEST_F(FitMuscles, sheets_sphincters_and_bulges_are_fitted_to_what_is_seen) {
  const std::array<std::array<const char*, 2>, 3> cases{
      {{"AU1", "frontalis_medialis"}, {"AU18", "incisivii"}, {"AU12", "malar_pad"}}};
  for (const auto& [unit, muscle] : cases) {
    compile({unit});
    const bool driven = std::any_of(truth_.begin(), truth_.end(),
                                    [&, name = muscle](const Muscle& m) { return plain_muscle(program(), m) == name; });
    ASSERT_TRUE(driven) << muscle;
    change(muscle, [](Muscle& m) {
      m.attachment_offset[1] += 0.003F;
      m.perpendicular_radius *= 1.15F;
      m.major_radius *= 0.9F;
      m.limit *= 1.15F;
      m.amount *= 1.2F;
    });
    FitSettings settings;
    settings.muscles = {muscle};
    settings.stiffness = 1e-7;
    const auto result = fit(std::array{measured(unit)}, settings);
    ASSERT_TRUE(result.has_value()) << result.error().cause;
    EXPECT_GT(result->errors[0].before_rms_mm, 0.02) << muscle;
    EXPECT_LT(result->errors[0].after_rms_mm, 0.05 * result->errors[0].before_rms_mm) << muscle;
  }
}

TEST_F(FitMuscles, a_share_of_a_second_unit_is_found_again) {
  compile({"AU12", "AU6"});
  const auto name = [&](program::StringId id) { return std::string(program().string(id)); };
  std::size_t changed = 0;
  for (std::size_t a = 0; a < shares_.size(); ++a) {
    const program::Actuation& x = program().actuations[a];
    const std::string unit = name(program().channels[static_cast<std::size_t>(x.channel)].name);
    const Muscle& muscle = program().muscles[static_cast<std::size_t>(x.muscle)];
    if (!unit.starts_with("AU6") || plain_muscle(program(), muscle) != "malar_pad") continue;
    shares_[a] = 0.7;
    ++changed;
  }
  ASSERT_EQ(changed, 2U) << "the cheek's pad serves both units, on both sides";
  FitSettings settings;
  settings.muscles = {"malar_pad"};
  settings.stiffness = 1e-8;
  const std::array expressions{measured("AU12"), measured("AU6")};
  const auto result = fit(expressions, settings);
  ASSERT_TRUE(result.has_value());
  ASSERT_EQ(result->shares.size(), 1U);
  EXPECT_EQ(result->shares[0].unit, "AU6");
  EXPECT_NEAR(result->shares[0].share, 0.7, 0.02);
  EXPECT_LT(result->errors[1].after_rms_mm, 0.05 * result->errors[1].before_rms_mm);
}

TEST_F(FitMuscles, the_same_input_gives_the_same_muscles) {
  compile({"AU12"});
  change("zygomatic_major", [](Muscle& m) { m.limit *= 1.3F; });
  FitSettings settings;
  settings.muscles = {"zygomatic_major"};
  settings.most_steps = 5;
  const std::array expressions{measured("AU12")};
  const auto a = fit(expressions, settings);
  const auto b = fit(expressions, settings);
  EXPECT_EQ(muscle_text(program(), *a), muscle_text(program(), *b));
}

TEST_F(FitMuscles, what_cannot_be_fitted_is_refused) {
  compile({"AU12"});
  const auto kind = [](const auto& made) { return made ? std::string("made") : made.error().kind; };
  runtime::PolygonMesh other = thin_ada();
  other.positions.pop_back();
  EXPECT_EQ(kind(expression_of("AU12", other, rest_, 0.001, program())), "fit_other_mesh");
  EXPECT_EQ(kind(expression_of("AU99", thin_ada(), rest_, 0.001, program())), "unknown_unit");
  EXPECT_EQ(kind(expression_of("", thin_ada(), rest_, 0.001, program())), "unknown_unit");
  FitSettings settings;
  settings.muscles = {"biceps"};
  const std::array expressions{measured("AU12")};
  EXPECT_EQ(kind(fit(expressions, settings)), "unknown_muscle");
  settings.muscles = {"frontalis_medialis"};
  EXPECT_EQ(kind(fit(expressions, settings)), "fit_nothing");
}

class FitCommand : public testing::Test {
 protected:
  FitCommand() : folder_(std::filesystem::temp_directory_path() / fmt::format("nms_fit_{}", ::getpid())) {
    std::filesystem::create_directories(folder_);
  }
  ~FitCommand() override {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }

  std::string path(const std::string& name) { return (folder_ / name).string(); }
  void write(const std::string& name, const std::string& text) { std::ofstream(path(name), std::ios::binary) << text; }
  std::string read(const std::string& name) {
    std::ifstream file(path(name), std::ios::binary);
    std::stringstream text;
    text << file.rdbuf();
    return text.str();
  }
  int run(const std::string& arguments) {
    const std::string command = fmt::format("cd \"{}\" && \"{}\" {} >out 2>err", folder_.string(), NMSC_FIT, arguments);
    return std::system(command.c_str());
  }

  /// The arguments of the page's command.
  static std::string documented() {
    std::ifstream page(std::string(NMS_SOURCE_DIR) + "/docs/for-faces-fit.md");
    const std::string_view command = "nmsc-fit ";
    for (std::string line; std::getline(page, line);) {
      if (line.starts_with(command)) return line.substr(command.size());
    }
    ADD_FAILURE() << "the page shows no command";
    return {};
  }

  std::filesystem::path folder_;
};

TEST_F(FitCommand, writes_muscles_that_compile) {
  std::string said;
  const std::vector<std::string> units{"AU12"};
  const auto image = compile_face({}, "ada", units, said);
  ASSERT_TRUE(image.has_value());
  const RestMesh rest = rest_mesh(thin_ada(), 0.001);
  std::vector<Muscle> truth(image->program().muscles.begin(), image->program().muscles.end());
  for (Muscle& m : truth) {
    if (plain_muscle(image->program(), m) == "zygomatic_major") m.limit *= 1.3F;
  }
  std::vector<double> shares;
  for (const program::Actuation& a : image->program().actuations) shares.push_back(static_cast<double>(a.share));
  const auto channels = expression_of("AU12", thin_ada(), rest, 0.001, image->program()).value().units;
  write("neutral.obj", obj_text(thin_ada(), {}));
  write("smile.obj", obj_text(thin_ada(), displacements(image->program(), truth, shares, rest, channels)));
  ASSERT_EQ(run(documented()), 0) << read("err");
  const std::string fitted = read("fitted.nms");
  EXPECT_NE(fitted.find("muscle zygomatic_major sides : linear from zygomatic"), std::string::npos) << fitted;
  EXPECT_NE(read("err").find("AU12: rms "), std::string::npos);
  if (std::getenv("NMS_SHOW") != nullptr) fmt::print("{}\n{}", read("err"), fitted);
  // A face's own muscles take the place of the library's.
  std::string face;
  for (const auto& file : stdlib::embedded_files()) {
    if (file.path == "faces/ada.nms") face = file.text;
  }
  face.replace(face.find("face ada"), 8, "face mine");
  face.insert(face.rfind('}'), fitted);
  const std::vector<std::pair<std::string, std::string>> sources{{"mine.nms", face}};
  const auto again = compile_face(sources, "mine", units, said);
  ASSERT_TRUE(again.has_value()) << said << face;
  bool found = false;
  for (const Muscle& m : again->program().muscles) {
    if (plain_muscle(again->program(), m) != "zygomatic_major") continue;
    found = true;
    for (const Muscle& t : truth) {
      if (plain_muscle(image->program(), t) == "zygomatic_major" && t.side == m.side) {
        EXPECT_NEAR(m.limit, t.limit, 0.02);
      }
    }
  }
  EXPECT_TRUE(found);
}

TEST_F(FitCommand, hostile_files_are_refused_and_nothing_is_written) {
  write("neutral.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  write("moved.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  write("index.obj", "v 0 0 0\nf 1 2 3\n");
  write("nan.obj", "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  write("fewer.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 1\nf 1 2 3\n");
  write("empty.obj", "");
  for (const char* bad : {"index.obj", "nan.obj", "fewer.obj", "empty.obj", "nowhere.obj", "."}) {
    EXPECT_NE(run(fmt::format("--neutral neutral.obj --expression AU12={} -o out.nms", bad)), 0) << bad;
    EXPECT_NE(read("err").find("error "), std::string::npos) << bad;
    EXPECT_FALSE(std::filesystem::exists(path("out.nms"))) << bad;
  }
  EXPECT_NE(run("--neutral neutral.obj --expression AU12 -o out.nms"), 0);
  EXPECT_NE(run("--neutral neutral.obj --expression AU99=moved.obj -o out.nms"), 0);
  EXPECT_NE(run("--neutral neutral.obj --unit 3s --expression AU12=moved.obj -o out.nms"), 0);
  // A mesh far from every muscle: nothing to fit to, and no crash.
  EXPECT_EQ(run("--neutral neutral.obj --unit 1000mm --expression AU12=moved.obj -o out.nms"), 0) << read("err");
}

}  // namespace
}  // namespace nms::fit_muscles
