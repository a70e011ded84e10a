#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <random>
#include <sstream>
#include <tuple>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <nms/runtime/face_x3d.h>

namespace nms::runtime {
namespace {

std::string slurp(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

const tl::expected<Face, program::Failure>& ada() {
  static const auto face = read_face_x3d(slurp(NMS_SOURCE_DIR "/stdlib/faces/ada.x3d"), "ada.x3d");
  return face;
}

std::vector<glm::dvec3> positions(const Skin& skin, const std::vector<glm::dvec3>& x) {
  std::vector<glm::dvec3> out;
  for (std::uint32_t r = 0; r < skin.surface.rows; ++r) {
    glm::dvec3 p(skin.offsets[r]);
    for (std::uint32_t i = skin.surface.row_begin[r]; i < skin.surface.row_begin[r + 1]; ++i) {
      p += static_cast<double>(skin.surface.value[i]) * x[skin.surface.column[i]];
    }
    out.push_back(p);
  }
  return out;
}

bool is_shell(const Skin& skin, std::uint32_t v) { return skin.offsets[v] != glm::vec3(0.0F); }

// The skin without brows and hair.
std::vector<std::array<std::uint32_t, 3>> bare_triangles(const Skin& skin) {
  std::vector<std::array<std::uint32_t, 3>> out;
  for (const Primitive& p : skin.primitives) {
    for (std::size_t i = 0; i < p.triangles.size(); i += 3) {
      const std::array<std::uint32_t, 3> t{p.triangles[i], p.triangles[i + 1], p.triangles[i + 2]};
      if (std::none_of(t.begin(), t.end(), [&](std::uint32_t v) { return is_shell(skin, v); })) out.push_back(t);
    }
  }
  return out;
}

TEST(Ada, RowsSumToOne) {
  ASSERT_TRUE(ada()) << ada().error().place << ": " << ada().error().cause;
  const SparseMatrix& t = ada()->skin.surface;
  EXPECT_GE(t.rows, 10'000U);
  EXPECT_LE(t.rows, 26'000U);
  for (std::uint32_t r = 0; r < t.rows; ++r) {
    double sum = 0.0;
    for (std::uint32_t i = t.row_begin[r]; i < t.row_begin[r + 1]; ++i) sum += static_cast<double>(t.value[i]);
    EXPECT_NEAR(sum, 1.0, 1e-6);
  }
}

// A crack would show as edges with one triangle: only the bust's border and the far ends of pockets may have them.
TEST(Ada, OnlyTheIntendedBordersAreOpen) {
  ASSERT_TRUE(ada());
  const Skin& skin = ada()->skin;
  const auto at = positions(skin, skin.points);
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const auto& t : bare_triangles(skin)) {
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(++edges[std::pair(t[k], t[(k + 1) % 3])], 1);
    }
  }
  std::map<std::uint32_t, std::uint32_t> next;
  for (const auto& [e, n] : edges) {
    if (edges.count({e.second, e.first}) == 0) next[e.first] = e.second;
  }
  std::vector<glm::dvec3> centres;
  while (!next.empty()) {
    glm::dvec3 sum{0.0};
    double count = 0.0;
    std::uint32_t v = next.begin()->first;
    while (next.count(v) > 0) {
      sum += at[v];
      count += 1.0;
      const std::uint32_t following = next[v];
      next.erase(v);
      v = following;
    }
    centres.push_back(sum / count);
    std::printf("open loop of %.0f edges at %.1f %.1f %.1f mm\n", count, centres.back().x * 1e3, centres.back().y * 1e3,
                centres.back().z * 1e3);
  }
  // The bust; behind each lid; and, where no surface closes them, nostrils, ear canals and the throat.
  EXPECT_LE(centres.size(), 8U);
}

// Vertices in one place are one vertex, so they stay in one place wherever the points go.
TEST(Ada, SeamsStayShutWhenPointsMove) {
  ASSERT_TRUE(ada());
  const Skin& skin = ada()->skin;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> any(-0.005, 0.005);
  auto moved = skin.points;
  for (auto& p : moved) p += glm::dvec3(any(random), any(random), any(random));
  const auto rest = positions(skin, skin.points);
  const auto after = positions(skin, moved);
  std::map<std::tuple<long long, long long, long long>, std::uint32_t> seen;
  double worst = 0.0;
  std::vector<char> used(rest.size(), 0);
  for (const auto& t : bare_triangles(skin)) {
    for (const auto v : t) used[v] = 1;
  }
  for (std::uint32_t v = 0; v < rest.size(); ++v) {
    if (!used[v]) continue;
    const auto key =
        std::tuple(std::llround(rest[v].x * 1e6), std::llround(rest[v].y * 1e6), std::llround(rest[v].z * 1e6));
    const auto [found, fresh] = seen.try_emplace(key, v);
    if (!fresh) worst = std::max(worst, glm::length(after[v] - after[found->second]));
  }
  EXPECT_LE(worst, 1e-6);
}

TEST(Ada, HalvesMirrorBitForBit) {
  ASSERT_TRUE(ada());
  const Skin& skin = ada()->skin;
  std::vector<glm::vec3> x(skin.points.begin(), skin.points.end());
  std::vector<glm::vec3> y(skin.surface.rows);
  multiply(skin.surface, x, y);
  const auto key = [](const glm::vec3& p) { return std::tuple(p.x + 0.0F, p.y, p.z); };
  const auto check = [&](const std::vector<glm::vec3>& all) {
    std::map<std::tuple<float, float, float>, int> count;
    for (const auto& p : all) ++count[key(p)];
    std::size_t lonely = 0;
    for (const auto& p : all) lonely += count.count(key({-p.x, p.y, p.z})) == 0 ? 1 : 0;
    EXPECT_EQ(lonely, 0U);
  };
  check(x);
  check(y);
}

double distance_to(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
  const auto to_segment = [&](const glm::dvec3& s, const glm::dvec3& e) {
    const glm::dvec3 d = e - s;
    const double t = std::clamp(glm::dot(p - s, d) / std::max(glm::dot(d, d), 1e-30), 0.0, 1.0);
    return glm::length(p - s - t * d);
  };
  const glm::dvec3 n = glm::cross(b - a, c - a);
  const double area = glm::dot(n, n);
  if (area > 0.0 && glm::dot(glm::cross(b - a, p - a), n) >= 0.0 && glm::dot(glm::cross(c - b, p - b), n) >= 0.0 &&
      glm::dot(glm::cross(a - c, p - c), n) >= 0.0) {
    return std::abs(glm::dot(p - a, n)) / std::sqrt(area);
  }
  return std::min({to_segment(a, b), to_segment(b, c), to_segment(c, a)});
}

// Against the scan she was fitted to, where it is at hand. Left out is what is made by rule, behind the lids' edges and
// in the mouth, and what the scan goes on with beyond the surface's open borders: the pockets of nose, ear and mouth.
TEST(Ada, LiesOnTheScan) {
  const char* variable = std::getenv("NMS_SCAN");
  const std::string path =
      variable != nullptr ? variable : NMS_SOURCE_DIR "/../shared/data/faces/ict/generic_neutral_mesh.obj";
  std::ifstream in(path);
  if (!in) GTEST_SKIP() << "no scan: set NMS_SCAN to generic_neutral_mesh.obj of ICT-FaceKit";
  std::vector<glm::dvec3> scan;
  for (std::string line; std::getline(in, line) && scan.size() <= 9408;) {
    std::istringstream words(line);
    std::string kind;
    glm::dvec3 p;
    if (words >> kind && kind == "v" && words >> p.x >> p.y >> p.z) scan.push_back(p * 0.01);
  }
  ASSERT_EQ(scan.size(), 9409U);
  const auto face = read_face_x3d(slurp(NMS_SOURCE_DIR "/stdlib/faces/ada.x3d"), "ada.x3d", {2.0, 400'000});
  ASSERT_TRUE(face);
  const auto at = positions(face->skin, face->skin.points);
  const auto triangles = bare_triangles(face->skin);
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const auto& t : triangles) {
    for (std::size_t k = 0; k < 3; ++k) ++edges[std::pair(t[k], t[(k + 1) % 3])];
  }
  std::vector<char> border(at.size(), 0);
  for (const auto& [e, n] : edges) {
    if (edges.count({e.second, e.first}) == 0) border[e.first] = border[e.second] = 1;
  }
  std::vector<char> at_border;
  for (const auto& t : triangles) at_border.push_back(border[t[0]] || border[t[1]] || border[t[2]]);
  const std::vector<float>& lining = face->regions.at("lining");
  const auto inside_mouth = [&](std::uint32_t t) {
    const SparseMatrix& m = face->skin.surface;
    double weight = 0.0;
    for (const std::uint32_t r : triangles[t]) {
      for (std::uint32_t i = m.row_begin[r]; i < m.row_begin[r + 1]; ++i) {
        weight += static_cast<double>(m.value[i]) * static_cast<double>(lining[m.column[i]]) / 3.0;
      }
    }
    return weight > 0.3;
  };
  // Buckets of 4 mm, each holding the triangles within 2 mm of it.
  constexpr double kCell = 0.004;
  std::map<std::array<int, 3>, std::vector<std::uint32_t>> cells;
  const auto cell = [&](const glm::dvec3& p) {
    return std::array<int, 3>{static_cast<int>(std::floor(p.x / kCell)), static_cast<int>(std::floor(p.y / kCell)),
                              static_cast<int>(std::floor(p.z / kCell))};
  };
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    const auto& q = triangles[t];
    const auto low = cell(glm::min(at[q[0]], glm::min(at[q[1]], at[q[2]])) - glm::dvec3(0.002));
    const auto high = cell(glm::max(at[q[0]], glm::max(at[q[1]], at[q[2]])) + glm::dvec3(0.002));
    for (int i = low[0]; i <= high[0]; ++i) {
      for (int j = low[1]; j <= high[1]; ++j) {
        for (int k = low[2]; k <= high[2]; ++k) cells[{i, j, k}].push_back(t);
      }
    }
  }
  const glm::dvec3 eye(0.03116, 0.03602, 0.07982);
  std::vector<double> gaps;
  double sum = 0.0;
  std::size_t left_out = 0;
  for (const glm::dvec3& p : scan) {
    if (glm::length(glm::dvec3(std::abs(p.x), p.y, p.z) - eye) < 0.0175) continue;  // lids' edges and what is behind
    const glm::dvec3 q(std::abs(p.x), p.y, p.z);  // the corner's inside is drawn inwards by rule
    if (q.x > 0.019 && q.x < 0.024 && q.y > -0.0365 && q.y < -0.031 && q.z < 0.1022) continue;
    double best = 1.0;
    std::uint32_t nearest = 0;
    const auto attempt = [&](std::uint32_t t) {
      const double d = distance_to(p, at[triangles[t][0]], at[triangles[t][1]], at[triangles[t][2]]);
      if (d < best) {
        best = d;
        nearest = t;
      }
    };
    if (const auto found = cells.find(cell(p)); found != cells.end()) {
      for (const std::uint32_t t : found->second) attempt(t);
    }
    if (best > 0.002) {  // a bucket knows only what is nearer than that
      for (std::uint32_t t = 0; t < triangles.size(); ++t) attempt(t);
    }
    if (at_border[nearest] || best > 0.002 ||
        inside_mouth(nearest)) {  // deep in a pocket, the skin outside may be nearer than the border
      ++left_out;
      continue;
    }
    gaps.push_back(best * 1e3);
    sum += best * 1e3;
  }
  std::sort(gaps.begin(), gaps.end());
  const double mean = sum / static_cast<double>(gaps.size());
  const double most = gaps[gaps.size() * 99 / 100];
  std::printf("scan to surface: %zu vertices (%zu in pockets), mean %.3f, 99 %% %.3f, max %.3f mm\n", gaps.size(),
              left_out, mean, most, gaps.back());
  RecordProperty("mean_um", static_cast<int>(mean * 1e3));
  EXPECT_LE(left_out, scan.size() / 8);  // or it is not only pockets
  // The triangles' own distance from the surface, at twice the usual density, is in these.
  EXPECT_LE(mean, 0.12);
  EXPECT_LE(most, 0.7);
}

}  // namespace
}  // namespace nms::runtime
