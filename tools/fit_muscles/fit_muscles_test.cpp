#include <sys/wait.h>
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

#include <nms/face_program/face_program.h>
#include <nms/runtime/face_x3d.h>
#include <nms/runtime/polygon_mesh.h>
#include <nms/runtime/rig.h>
#include <nms/stdlib/embedded.h>

#include "displacement_fields.h"
#include "muscle_fit.h"

namespace nms::fit_muscles {
namespace {

using program::Muscle;

/// Ada with half the rows and columns of vertices: places enough for every muscle, few enough to be quick.
const runtime::Face& thin_face() {
  static const runtime::Face face = [] {
    for (const auto& file : stdlib::embedded_files()) {
      if (file.path == "faces/ada.x3d") return runtime::read_face_x3d(file.text, "ada.x3d", {0.5, 400'000}).value();
    }
    ADD_FAILURE() << "no ada";
    return runtime::Face{};
  }();
  return face;
}

/// Her skin.
const runtime::PolygonMesh& thin_ada() {
  static const runtime::PolygonMesh mesh = [] {
    const runtime::Face& face = thin_face();
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
    image_ = face_program::compile_face({}, "ada", units, said);
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

  tl::expected<FitResult, program::Failure> fit(std::span<const UnitFigures> figures, const FitSettings& settings) {
    Measured all;
    all.face = &thin_face();
    all.figures = figures;
    return fit_muscles(program(), all, settings);
  }

  /// What the true muscles show, as figures.
  UnitFigures figures_of(const std::string& unit, const std::string& near) {
    UnitFigures asked;
    asked.unit = unit;
    asked.near = near;
    const auto target = FigureTarget::create(program(), thin_face(), std::array{asked});
    const UnitMovement m = target.value()->movements(truth_, shares_).at(0);
    asked.largest_mm = m.largest_mm;
    asked.direction = m.direction;
    asked.reach_mm = 15.0;
    asked.area = m.area;
    asked.gap_mm = m.gap_mm;
    asked.width = m.width;
    asked.opening = m.opening;
    return asked;
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

TEST_F(FitMuscles, figures_are_brought_back) {
  compile({"AU12"});
  change("zygomatic_major", [](Muscle& m) {
    m.attachment_offset[2] += 0.008F;
    m.angle *= 1.3F;
    m.limit *= 0.75F;
    m.dissipation_radius += 0.008F;
  });
  const std::array figures{figures_of("AU12", "mouth_corner_L")};
  FitSettings settings;
  settings.muscles = {"zygomatic_major"};
  settings.stiffness = 1e-6;
  settings.most_steps = 12;
  const auto result = fit(figures, settings);
  ASSERT_TRUE(result.has_value()) << result.error().cause;
  ASSERT_EQ(result->figures.size(), 1U);
  const UnitMovement& before = result->figures[0].before;
  const UnitMovement& after = result->figures[0].after;
  const UnitFigures& wanted = figures[0];
  // Off, to begin with.
  EXPECT_GT(std::abs(before.largest_mm - wanted.largest_mm), 0.15 * wanted.largest_mm);
  EXPECT_GT(degrees_between(before.direction, wanted.direction), 4.0);
  EXPECT_GT(std::abs(before.area - *wanted.area), 0.02);
  EXPECT_GT(std::abs(before.width - *wanted.width), 0.03);
  // And back. What is fitted is the largest displacement's neighbourhood, so a few percent are left.
  EXPECT_NEAR(after.largest_mm, wanted.largest_mm, 0.05 * wanted.largest_mm);
  EXPECT_LT(degrees_between(after.direction, wanted.direction), 3.0);
  EXPECT_NEAR(after.area, *wanted.area, 0.01);
  EXPECT_NEAR(after.width, *wanted.width, 0.01);
  EXPECT_NE(report_lines(*result).at(0).find("AU12: "), std::string::npos);
}

TEST_F(FitMuscles, lids_and_hinges_and_rolling_lips_are_fitted_to_figures) {
  compile({"AU5", "AU29", "AU28"});
  change("levator_palpebrae", [](Muscle& m) { m.angle *= 1.4F; });
  change("pterygoid", [](Muscle& m) { m.slide[2] *= 0.8F; });
  change("orbicularis_oris_suck_upper", [](Muscle& m) { m.slide[2] *= 1.6F; });
  change("orbicularis_oris_suck_lower", [](Muscle& m) { m.slide[2] *= 1.6F; });
  const std::array figures{figures_of("AU5", "lid_upper_mid_L"), figures_of("AU29", "menton"),
                           figures_of("AU28", "stomion")};
  FitSettings settings;
  settings.stiffness = 1e-6;
  settings.precision = 1e-3;
  settings.fit_shares = false;
  settings.muscles = {"levator_palpebrae", "pterygoid", "orbicularis_oris_suck_upper", "orbicularis_oris_suck_lower"};
  const auto result = fit(figures, settings);
  ASSERT_TRUE(result.has_value()) << result.error().cause;
  EXPECT_TRUE(result->left_out.empty());
  for (const FigureError& e : result->figures) {
    const double before = std::abs(e.before.largest_mm / e.measured.largest_mm - 1.0);
    EXPECT_GT(before, 0.05) << e.measured.unit;
    EXPECT_LT(std::abs(e.after.largest_mm / e.measured.largest_mm - 1.0), 0.5 * before) << e.measured.unit;
  }
  EXPECT_NEAR(left(result->muscles, "levator_palpebrae").angle, left(truth_, "levator_palpebrae").angle, 0.02);
  EXPECT_NEAR(left(result->muscles, "pterygoid").slide[2], left(truth_, "pterygoid").slide[2], 0.0005);
}

// What muscles do to an OBJ's points is what the runtime does to the face: AU10 is held to a region, AU16 kept out of
// one.
TEST_F(FitMuscles, points_of_a_mesh_know_their_regions) {
  for (const char* unit : {"AU10", "AU16"}) {
    compile({unit});
    const auto rig = runtime::bind(thin_face(), program());
    ASSERT_TRUE(rig.has_value()) << rig.error().cause;
    runtime::Pose pose = runtime::make_pose(thin_face(), *rig);
    const auto units = expression_of(unit, thin_ada(), rest_, 0.001, program()).value().units;
    std::vector<float> values(rig->channel_count(), 0.0F);
    for (const program::ChannelId channel : units) values[static_cast<std::size_t>(channel)] = 1.0F;
    runtime::pose_face(thin_face(), *rig, values, pose);
    const auto miss_mm = [&] {
      const auto moved = displacements(program(), truth_, shares_, rest_, units);
      double sum = 0.0;
      for (std::size_t i = 0; i < moved.size(); ++i) {
        const glm::dvec3 d = 1000.0 * (glm::dvec3(pose.positions[i]) - rest_.points[i] - moved[i]);
        sum += d.x * d.x + d.y * d.y + d.z * d.z;
      }
      return std::sqrt(sum / static_cast<double>(moved.size()));
    };
    const double without = miss_mm();
    take_regions(rest_, thin_face());
    const double with = miss_mm();
    EXPECT_LT(with, 0.5 * without) << unit << ": " << with << " and " << without << " mm rms";
  }
}

TEST(UnitFigures, tables_are_read_line_by_line) {
  const auto kind = [](std::string_view text) {
    const auto read = read_unit_figures(text, "t.tsv");
    return read ? std::string("read") : read.error().kind + " " + read.error().place;
  };
  const std::string good = "AU12 15.8 .46 .67 -.58 mouth_corner_L 10 20 0.0 28 - nose_tip,subnasale measured\n";
  const auto read =
      read_unit_figures("# a remark\n\n" + good + "AU5 3.5 0 2e-1 0 lid_upper_mid_L 12 - - - 131 - own", "t.tsv");
  ASSERT_TRUE(read.has_value()) << read.error().cause;
  ASSERT_EQ(read->size(), 2U);
  EXPECT_EQ(read->at(0).still, (std::vector<std::string>{"nose_tip", "subnasale"}));
  EXPECT_DOUBLE_EQ(read->at(0).area.value(), 0.2);
  EXPECT_DOUBLE_EQ(read->at(0).width.value(), 0.28);
  EXPECT_FALSE(read->at(0).opening.has_value());
  EXPECT_DOUBLE_EQ(read->at(1).direction.y, 1.0);
  EXPECT_TRUE(read->at(1).own);
  EXPECT_EQ(kind(""), "figures_none t.tsv");
  EXPECT_EQ(kind(good + good), "figures_twice t.tsv:2");
  EXPECT_EQ(kind("AU12 15.8\n"), "figures_bad_line t.tsv:1");
  for (const char* bad : {"nan", "1e9", "-1", "x", "1x", ""}) {
    std::string line = good;
    line.replace(line.find("15.8"), 4, bad);
    EXPECT_EQ(kind(line), "figures_bad_line t.tsv:1") << bad;
  }
  std::string still = good;
  still.replace(still.find("measured"), 8, "guessed");
  EXPECT_EQ(kind(still), "figures_bad_line t.tsv:1");
  EXPECT_EQ(kind("AU12 15.8 0 0 0 mouth_corner_L 10 - - - - - own"), "figures_bad_line t.tsv:1");
}

TEST_F(FitMuscles, figures_that_do_not_fit_the_face_are_refused) {
  compile({"AU12"});
  const auto kind = [&](const std::string& unit, const std::string& near) {
    UnitFigures f;
    f.unit = unit;
    f.near = near;
    f.largest_mm = 1.0;
    f.direction = {0.0, 1.0, 0.0};
    f.reach_mm = 10.0;
    const auto made = fit(std::array{f}, FitSettings{});
    return made ? std::string("made") : made.error().kind;
  };
  EXPECT_EQ(kind("AU99", "nasion"), "unknown_unit");
  EXPECT_EQ(kind("AU12", "elbow"), "missing_landmark");
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
  static std::string documented(std::string_view command) {
    std::ifstream page(std::string(NMS_SOURCE_DIR) + "/docs/for-faces-fit.md");
    for (std::string line; std::getline(page, line);) {
      if (line.starts_with(command)) return line.substr(std::string_view("nmsc-fit ").size());
    }
    ADD_FAILURE() << "the page shows no command";
    return {};
  }

  std::filesystem::path folder_;
};

TEST_F(FitCommand, writes_muscles_that_compile) {
  std::string said;
  const std::vector<std::string> units{"AU12"};
  const auto image = face_program::compile_face({}, "ada", units, said);
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
  ASSERT_EQ(run(documented("nmsc-fit --neutral ")), 0) << read("err");
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
  const auto again = face_program::compile_face(sources, "mine", units, said);
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

TEST_F(FitCommand, fits_to_figures) {
  std::filesystem::copy_file(std::string(NMS_SOURCE_DIR) + "/tools/fit_muscles/measured_units.tsv",
                             path("measured_units.tsv"));
#ifdef NMS_UNDER_SANITIZERS
  const std::string steps = " --steps 2";  // a minute and more otherwise
#else
  const std::string steps;
#endif
  ASSERT_EQ(run(documented("nmsc-fit --figures ") + steps), 0) << read("err");
  const std::string fitted = read("fitted.nms");
  EXPECT_NE(fitted.find("muscle frontalis_lateralis sides : sheet from forehead_outer"), std::string::npos) << fitted;
  EXPECT_NE(read("err").find("AU2: "), std::string::npos);
  write("bad.tsv", "AU2 8.6\n");
  EXPECT_NE(run("--figures bad.tsv -o out.nms"), 0);
  EXPECT_NE(read("err").find("figures_bad_line"), std::string::npos);
  EXPECT_NE(run("--figures measured_units.tsv --units AU98 -o out.nms"), 0);
  EXPECT_NE(run("-o out.nms"), 0);
  EXPECT_FALSE(std::filesystem::exists(path("out.nms")));
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
  // A mesh far from every landmark: another unit, or other coordinates.
  EXPECT_NE(run("--neutral neutral.obj --unit 1000mm --expression AU12=moved.obj -o out.nms"), 0);
  EXPECT_NE(read("err").find("neutral.obj: error fit_far: "), std::string::npos) << read("err");
  for (const char* stiffness : {"-1", "nan", "inf"}) {
    EXPECT_NE(run(fmt::format("--neutral neutral.obj --expression AU12=moved.obj --stiffness {}", stiffness)), 0);
    EXPECT_NE(read("err").find("--stiffness: error bad_quantity: "), std::string::npos) << read("err");
  }
  EXPECT_NE(run("--neutral neutral.obj --expression AU12=moved.obj --face nobody"), 0);
  EXPECT_NE(read("err").find("nobody: error unknown_face: "), std::string::npos) << read("err");
  EXPECT_EQ(WEXITSTATUS(run("--neutral")), 2);
  EXPECT_FALSE(std::filesystem::exists(path("out.nms")));
}

}  // namespace
}  // namespace nms::fit_muscles
