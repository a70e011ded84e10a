// What soft parts keep out of: the eyeballs, the rows of teeth, and one lip the other.
//
// Muscles move independent points; a surface between them may still cut a corner. So what must not be passed through is
// held twice: points with some room to spare, which keeps the shape whole, then the vertices themselves, exactly. A
// vertex on a seam is one vertex, so no seam opens.
#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include <glm/matrix.hpp>

#include "rig_parts.h"

namespace nms::runtime {

namespace {

// Room that points and vertices keep to the teeth.
constexpr double kPointRoom = 0.0010;     // [m]
constexpr double kVertexRoom = -0.00008;  // [m]
// Share of the room that what is pushed out of the teeth may take.
constexpr double kSoftShare = 0.3;
// How far from the arch, and above or below its gums, skin at rest may be and still touch it.
constexpr double kArchReach = 0.025;  // [m]
constexpr double kGumReach = 0.012;   // [m]
// Skin nearer to the eyeball than this is held out of it.
constexpr double kLidReach = 0.012;  // [m]
// What rests in the teeth by more than this is left out of them no further.
constexpr double kDeepest = -0.02;  // [m]
// Between lid and eyeball.
constexpr double kTearFilm = 0.00003;  // [m]
constexpr int kTriangleSamples = 5;
constexpr float kLipShare = 0.82F;
// What is nearer to the midline stands in the middle: rounding must not put it on one side.
constexpr float kMiddle = 0.00002F;  // [m]
// Where lips overlap the upper one, which lies on the teeth, gives way by this share.
constexpr double kUpperGives = 0.3;
// A lip may be past the line between the lips by less than this.
constexpr double kLipGive = 0.00007;  // [m]

// -1 at the far right of the arch, 0 in front, 1 at the far left; no angle, but it rises with one.
double along_arch(double x, double z) { return x / (std::abs(x) + z); }

int arch_column(double along) {
  const int c = static_cast<int>((along + 1.0) * 0.5 * TeethWall::kColumns);
  return std::clamp(c, 0, TeethWall::kColumns - 1);
}

float& cell(TeethWall& wall, int row, int column) {
  return wall.radius[static_cast<std::size_t>(row * TeethWall::kColumns + column)];
}

float cell(const TeethWall& wall, int row, int column) {
  return wall.radius[static_cast<std::size_t>(row * TeethWall::kColumns + column)];
}

template <typename Visit>
void visit_samples(const RigidMesh& mesh, Visit visit) {
  for (const Primitive& primitive : mesh.primitives) {
    for (std::size_t i = 0; i + 2 < primitive.triangles.size(); i += 3) {
      const glm::dvec3 a(mesh.positions[primitive.triangles[i]]);
      const glm::dvec3 b(mesh.positions[primitive.triangles[i + 1]]);
      const glm::dvec3 c(mesh.positions[primitive.triangles[i + 2]]);
      for (int u = 0; u <= kTriangleSamples; ++u) {
        for (int v = 0; u + v <= kTriangleSamples; ++v) {
          visit(a + (b - a) * (u / static_cast<double>(kTriangleSamples)) +
                (c - a) * (v / static_cast<double>(kTriangleSamples)));
        }
      }
    }
  }
}

bool starts_with(std::string_view text, std::string_view head) { return text.substr(0, head.size()) == head; }

// Holes take the largest of their neighbours, again and again; then both sides take the larger of the two.
void fill_wall(TeethWall& wall) {
  for (int round = 0; round < TeethWall::kColumns; ++round) {
    const std::vector<float> before = wall.radius;
    const auto old = [&](int row, int column) {
      if (row < 0 || row >= TeethWall::kRows || column < 0 || column >= TeethWall::kColumns) return 0.0F;
      return before[static_cast<std::size_t>(row * TeethWall::kColumns + column)];
    };
    bool holes = false;
    for (int row = 0; row < TeethWall::kRows; ++row) {
      for (int column = 0; column < TeethWall::kColumns; ++column) {
        if (old(row, column) > 0.0F) continue;
        cell(wall, row, column) =
            std::max({old(row - 1, column), old(row + 1, column), old(row, column - 1), old(row, column + 1)});
        holes = holes || cell(wall, row, column) == 0.0F;
      }
    }
    if (!holes) break;
  }
  for (int column = 0; column < TeethWall::kColumns / 2; ++column) {
    const int other = TeethWall::kColumns - 1 - column;
    for (int row = 0; row < TeethWall::kRows; ++row) {
      const float most = std::max(cell(wall, row, column), cell(wall, row, other));
      cell(wall, row, column) = cell(wall, row, other) = most;
    }
  }
  for (const float r : wall.radius) wall.largest = std::max(wall.largest, static_cast<double>(r));
}

}  // namespace

TeethWall make_teeth_wall(const Face& face, Frame frame) {
  TeethWall wall;
  wall.frame = frame;
  wall.upper = frame == Frame::head;
  glm::dvec3 low(1e9);
  glm::dvec3 high(-1e9);
  const auto counts = [&](const RigidMesh& mesh) {
    return mesh.frame == frame && (starts_with(mesh.name, "teeth") || starts_with(mesh.name, "gums"));
  };
  for (const RigidMesh& mesh : face.rigid) {
    if (!counts(mesh)) continue;
    for (const glm::vec3& p : mesh.positions) {
      low = glm::dvec3(std::min(low.x, static_cast<double>(p.x)), std::min(low.y, static_cast<double>(p.y)),
                       std::min(low.z, static_cast<double>(p.z)));
      high = glm::dvec3(std::max(high.x, static_cast<double>(p.x)), std::max(high.y, static_cast<double>(p.y)),
                        std::max(high.z, static_cast<double>(p.z)));
    }
  }
  if (!(low.x < high.x && low.y < high.y && low.z < high.z)) return wall;
  wall.back_z = low.z - 1e-4;
  wall.bottom_y = low.y;
  wall.row_height = (high.y - low.y) / TeethWall::kRows;
  wall.radius.assign(static_cast<std::size_t>(TeethWall::kRows * TeethWall::kColumns), 0.0F);
  wall.edge.fill(wall.upper ? 1e9 : -1e9);
  for (const RigidMesh& mesh : face.rigid) {
    if (!counts(mesh)) continue;
    const bool teeth = starts_with(mesh.name, "teeth");
    visit_samples(mesh, [&](const glm::dvec3& p) {
      const double z = p.z - wall.back_z;
      if (z <= 0.0) return;
      const int column = arch_column(along_arch(p.x, z));
      const int row = std::clamp(static_cast<int>((p.y - wall.bottom_y) / wall.row_height), 0, TeethWall::kRows - 1);
      float& r = cell(wall, row, column);
      r = std::max(r, static_cast<float>(std::sqrt(p.x * p.x + z * z)));
      if (!teeth) return;
      for (const int c : {column, TeethWall::kColumns - 1 - column}) {
        double& edge = wall.edge[static_cast<std::size_t>(c)];
        edge = wall.upper ? std::min(edge, p.y) : std::max(edge, p.y);
      }
    });
  }
  // Where an arch has gums and no teeth, its edge is the neighbour's.
  for (int column = TeethWall::kColumns / 2; column + 1 < TeethWall::kColumns; ++column) {
    double& next = wall.edge[static_cast<std::size_t>(column + 1)];
    if (std::abs(next) > 1.0) next = wall.edge[static_cast<std::size_t>(column)];
    wall.edge[static_cast<std::size_t>(TeethWall::kColumns - 2 - column)] = next;
  }
  fill_wall(wall);
  wall.exists = wall.largest > 0.0 && std::abs(wall.edge[TeethWall::kColumns / 2]) < 1.0;
  return wall;
}

double TeethWall::radius_at(double along, double y) const {
  const double column = std::clamp((along + 1.0) * 0.5 * kColumns - 0.5, 0.0, kColumns - 1.0);
  const double row = std::clamp((y - bottom_y) / row_height - 0.5, 0.0, kRows - 1.0);
  const int c = std::min(static_cast<int>(column), kColumns - 2);
  const int r = std::min(static_cast<int>(row), kRows - 2);
  const double u = column - c;
  const double v = row - r;
  const auto at = [&](int dr, int dc) { return static_cast<double>(cell(*this, r + dr, c + dc)); };
  const double below = at(0, 0) + u * (at(0, 1) - at(0, 0));
  const double above = at(1, 0) + u * (at(1, 1) - at(1, 0));
  return below + v * (above - below);
}

double TeethWall::edge_at(double along) const {
  const double column = std::clamp((along + 1.0) * 0.5 * kColumns - 0.5, 0.0, kColumns - 1.0);
  const int c = std::min(static_cast<int>(column), kColumns - 2);
  const double a = edge[static_cast<std::size_t>(c)];
  return a + (column - c) * (edge[static_cast<std::size_t>(c + 1)] - a);
}

namespace {

// Seen along the arch a row of teeth is a corner: a place is `depth` behind its front and `height` above its edge.
struct WayOut {
  double outwards = 0.0;  // [m]
  double off = 0.0;       // over the edge [m]
};

// Of what is nearer to a side than `rounding`, in which the corner is round: the shortest.
WayOut shortest_way(double depth, double height, double rounding) {
  const double a = std::max(rounding - depth, 0.0);
  const double b = std::max(rounding - height, 0.0);
  const double length = std::sqrt(a * a + b * b);
  if (length >= rounding || length == 0.0) return {};
  const double share = (rounding - length) / length;
  return {share * a, share * b};
}

// The shortest way parts two places that are near one another where front and edge are equally far. So there is a fan
// about the corner: what is on one rim of it goes straight outwards, on the other straight over the edge, and between
// them to all places between.
WayOut fanned_way(double depth, double height) {
  constexpr double kEdgeRim = 0.45;  // of height / (height + depth)
  constexpr double kFrontRim = 0.5;
  const double both = depth + height;
  const double u = std::clamp((height / both - kEdgeRim) / (kFrontRim - kEdgeRim), 0.0, 1.0);
  const double at = u * height - (1.0 - u) * depth;  // above the corner, or behind it
  return at >= 0.0 ? WayOut{depth, (1.0 - u) * both} : WayOut{u * both, height};
}

WayOut way_out(double depth, double height, double rounding) {
  const double deep = std::clamp(std::min(depth, height) / rounding, 0.0, 1.0);
  const WayOut fanned = fanned_way(depth, height);
  if (deep >= 1.0) return fanned;
  const WayOut shortest = shortest_way(depth, height, rounding);
  return {shortest.outwards + deep * (fanned.outwards - shortest.outwards),
          shortest.off + deep * (fanned.off - shortest.off)};
}

}  // namespace

glm::dvec3 TeethWall::push(glm::dvec3 p, double room) const {
  if (!reaches(p.x, p.z, room)) return glm::dvec3(0.0);
  const double z = p.z - back_z;
  const double squared = p.x * p.x + z * z;
  const double along = along_arch(p.x, z);
  const double height = upper ? p.y - (edge_at(along) - room) : edge_at(along) + room - p.y;
  if (height <= 0.0) return glm::dvec3(0.0);
  const double distance = std::sqrt(squared);
  const double depth = radius_at(along, p.y) + room - distance;
  if (depth <= 0.0) return glm::dvec3(0.0);
  const glm::dvec3 outwards(p.x / distance, 0.0, z / distance);
  const glm::dvec3 off(0.0, upper ? -1.0 : 1.0, 0.0);
  const WayOut way = way_out(depth, height, rounding);
  // Not all onto one plane: of what there is room for, what was deeper stays deeper, or a lip between the rows would be
  // flat and fold.
  const double soft = kSoftShare * std::max(room, 0.0);
  const double far = std::sqrt(way.outwards * way.outwards + way.off * way.off);
  if (far <= 0.0) return glm::dvec3(0.0);
  return far / (far + soft) * (way.outwards * outwards + way.off * off);
}

// ------------------------------------------------------------------------------------------------ binding

void RigParts::make_contacts() {
  const SparseMatrix& t = face.skin.surface;
  std::vector<glm::dvec3> places(t.rows);
  for (std::uint32_t v = 0; v < t.rows; ++v) {
    glm::dvec3 p(face.skin.offsets[v]);
    for (std::uint32_t k = t.row_begin[v]; k < t.row_begin[v + 1]; ++k) {
      p += static_cast<double>(t.value[k]) * face.skin.points[t.column[k]];
    }
    places[v] = p;
  }
  rig.walls = {make_teeth_wall(face, Frame::head), make_teeth_wall(face, Frame::jaw)};
  for (TeethWall& wall : rig.walls) wall.rounding *= rig.scale;
  const auto near_teeth = [&](const glm::dvec3& p) {
    for (const TeethWall& wall : rig.walls) {
      if (!wall.exists) continue;
      const double z = p.z - wall.back_z;
      if (z <= 0.0 || p.y < wall.bottom_y - kGumReach * rig.scale ||
          p.y > wall.bottom_y + wall.row_height * TeethWall::kRows + kGumReach * rig.scale)
        continue;
      const double reach = wall.largest + kArchReach * rig.scale;
      if (p.x * p.x + z * z < reach * reach) return true;
    }
    return false;
  };
  // The most room, up to the usual, that pushes nothing at rest.
  const auto room_at = [&](const glm::dvec3& p, double usual) {
    const auto clear = [&](double room) {
      for (const TeethWall& wall : rig.walls) {
        if (wall.exists && wall.push(p, room) != glm::dvec3(0.0)) return false;
      }
      return true;
    };
    if (clear(usual)) return usual;
    double low = kDeepest * rig.scale;
    for (int i = 0; i < 30; ++i) {
      const double middle = 0.5 * (low + usual);
      (clear(middle) ? low : usual) = middle;
    }
    return low;
  };
  for (std::uint32_t i = 0; i < face.skin.points.size(); ++i) {
    const glm::dvec3 p = face.skin.points[i];
    if (near_teeth(p)) rig.mouth_points.push_back({i, room_at(p, kPointRoom * rig.scale)});
  }
  const auto share = [&](const char* region, std::uint32_t v) {
    const auto found = face.regions.find(region);
    float sum = 0.0F;
    if (found == face.regions.end()) return sum;
    for (std::uint32_t k = t.row_begin[v]; k < t.row_begin[v + 1]; ++k) sum += t.value[k] * found->second[t.column[k]];
    return sum;
  };
  for (std::uint32_t v = 0; v < t.rows; ++v) {
    if (near_teeth(places[v])) rig.mouth_vertices.push_back({v, room_at(places[v], kVertexRoom * rig.scale)});
    if (share("lip_upper", v) >= kLipShare) rig.lip_vertices.push_back({v, true, 0.0});
    if (share("lip_lower", v) >= kLipShare) rig.lip_vertices.push_back({v, false, 0.0});
  }
  // What is past the line between the lips at rest may stay as far past it.
  LipLine line;
  line.width = rig.lip_column = lip_column_width(places);
  std::vector<glm::vec3> single(places.size());
  for (std::size_t v = 0; v < places.size(); ++v) single[v] = glm::vec3(places[v]);
  find_lip_line(rig.lip_vertices, single, line);
  for (RigTables::LipVertex& v : rig.lip_vertices) {
    const double y = static_cast<double>(single[v.vertex].y);
    const double over = line.height_at(single[v.vertex].x) - y;
    v.slack = std::max(v.upper ? over : -over, 0.0);
  }
  make_eyeballs(places);
}

// A column must hold vertices of both lips' edges, or the line between them jumps: it is wider than most triangles
// there.
double RigParts::lip_column_width(std::span<const glm::dvec3> places) const {
  constexpr double kOfEdge = 1.5;
  std::vector<bool> is_lip(places.size(), false);
  for (const RigTables::LipVertex& v : rig.lip_vertices) is_lip[v.vertex] = true;
  std::vector<double> edges;
  for (const Primitive& primitive : face.skin.primitives) {
    for (std::size_t i = 0; i + 2 < primitive.triangles.size(); i += 3) {
      const std::uint32_t* t = &primitive.triangles[i];
      if (!is_lip[t[0]] || !is_lip[t[1]] || !is_lip[t[2]]) continue;
      for (std::size_t k = 0; k < 3; ++k) edges.push_back(std::abs(places[t[k]].x - places[t[(k + 1) % 3]].x));
    }
  }
  const double usual = LipLine{}.width * rig.scale;
  if (edges.empty()) return usual;
  // Two edges of a triangle out of three lead sideways.
  const auto middle = edges.begin() + static_cast<std::ptrdiff_t>(2 * edges.size() / 3);
  std::nth_element(edges.begin(), middle, edges.end());
  return std::max(usual, kOfEdge * *middle);
}

void RigParts::make_eyeballs(std::span<const glm::dvec3> places) {
  for (std::size_t e = 0; e < kEyeCount; ++e) {
    if (!has_eye[e]) continue;
    RigTables::Eye& eye = rig.eyes[e];
    const Frame frame = e == 0 ? Frame::eye_left : Frame::eye_right;
    for (const RigidMesh& mesh : face.rigid) {
      if (mesh.frame != frame) continue;
      for (const glm::vec3& p : mesh.positions) {
        const glm::dvec3 v = glm::dvec3(p) - eye.centre;
        eye.radius = std::max(eye.radius, std::sqrt(dot(v, v)));
      }
    }
    if (eye.radius == 0.0) continue;
    for (std::uint32_t v = 0; v < places.size(); ++v) {
      const glm::dvec3 from = places[v] - eye.centre;
      const double distance = std::sqrt(dot(from, from));
      if (from.z <= 0.0 || distance > eye.radius + kLidReach * rig.scale) continue;
      // What rests inside (it should not) may stay.
      eye.vertices.push_back({v, std::min(eye.radius + kTearFilm * rig.scale, distance)});
    }
  }
}

// ------------------------------------------------------------------------------------------------ posing

void find_lip_line(std::span<const RigTables::LipVertex> lips, std::span<const glm::vec3> positions, LipLine& line) {
  line.low.fill(1e9);
  line.high.fill(-1e9);
  for (const RigTables::LipVertex& v : lips) {
    const glm::vec3& p = positions[v.vertex];
    // Columns mirror: those of the left are counted from the middle, and a point of the middle stands in both.
    const int step = static_cast<int>(std::abs(static_cast<double>(p.x)) / line.width);
    if (step >= LipLine::kSide) continue;
    const double y = static_cast<double>(p.y);
    const auto offer = [&](int c) {
      const auto i = static_cast<std::size_t>(c);
      if (v.upper) {
        line.low[i] = std::min(line.low[i], y);
      } else {
        line.high[i] = std::max(line.high[i], y);
      }
    };
    if (p.x >= -kMiddle) offer(LipLine::kSide + step);
    if (p.x <= kMiddle) offer(LipLine::kSide - 1 - step);
  }
  // Columns without both lips lie level with the next one inwards.
  const auto middle = [&](int c) {
    const auto i = static_cast<std::size_t>(c);
    if (line.low[i] >= 1.0 || line.high[i] <= -1.0) return 1e9;
    const double past = line.high[i] - line.low[i];
    return line.low[i] + (past > 0.0 ? kUpperGives : 0.5) * past;
  };
  double last = 0.0;
  for (int c = LipLine::kSide; c < 2 * LipLine::kSide; ++c) {
    const double y = middle(c);
    last = y < 1.0 ? y : last;
    line.middle[static_cast<std::size_t>(c)] = last;
  }
  for (int c = LipLine::kSide - 1; c >= 0; --c) {
    const double y = middle(c);
    if (c == LipLine::kSide - 1) last = line.middle[LipLine::kSide];
    last = y < 1.0 ? y : last;
    line.middle[static_cast<std::size_t>(c)] = last;
  }
}

double LipLine::height_at(double x) const {
  const double column = std::clamp(x / width + kSide - 0.5, 0.0, 2.0 * kSide - 1.0);
  const int c = std::min(static_cast<int>(column), 2 * kSide - 2);
  const double a = middle[static_cast<std::size_t>(c)];
  return a + (column - c) * (middle[static_cast<std::size_t>(c + 1)] - a);
}

// The upper row stands still in the head; the lower one has moved, so p is looked at from the jaw.
class Teeth {
 public:
  Teeth(const RigTables& t, const Placement& jaw)
      : upper_(t.walls[0]), lower_(t.walls[1]), jaw_(jaw), back_(glm::transpose(jaw.rotation)) {}

  /// Most of what is asked about is not. Numbers, not vectors: this is asked for every vertex about the mouth.
  [[nodiscard]] bool reach(double x, double y, double z, double room) const {
    if (upper_.reaches(x, z, room)) return true;
    const double from_x = x - jaw_.translation.x;
    const double from_y = y - jaw_.translation.y;
    const double from_z = z - jaw_.translation.z;
    const double in_jaw_x = back_[0].x * from_x + back_[1].x * from_y + back_[2].x * from_z;
    const double in_jaw_z = back_[0].z * from_x + back_[1].z * from_y + back_[2].z * from_z;
    return lower_.reaches(in_jaw_x, in_jaw_z, room);
  }

  [[nodiscard]] glm::dvec3 outside(const glm::dvec3& at, double room) const {
    glm::dvec3 p = at;
    if (upper_.exists) p += upper_.push(p, room);
    if (!lower_.exists) return p;
    const glm::dvec3 push = lower_.push(back_ * (p - jaw_.translation), room);
    return push == glm::dvec3(0.0) ? p : p + jaw_.rotation * push;
  }

 private:
  const TeethWall& upper_;
  const TeethWall& lower_;
  const Placement& jaw_;
  glm::dmat3 back_;
};

void hold_points_off_teeth(const Rig& rig, Pose& pose) {
  const RigTables& t = rig.tables();
  const Placement jaw = jaw_in_head(rig, pose);
  const Teeth teeth(t, jaw);
  for (const RigTables::MouthPoint& p : t.mouth_points) {
    glm::dvec3& point = pose.points[p.index];
    if (!teeth.reach(point.x, point.y, point.z, p.room)) continue;
    point = teeth.outside(point, p.room);
  }
}

// Whether any had to move.
static bool hold_lips_apart(const RigTables& t, Pose& pose) {
  find_lip_line(t.lip_vertices, pose.positions, pose.lip_line);
  bool moved = false;
  for (const RigTables::LipVertex& v : t.lip_vertices) {
    glm::vec3& p = pose.positions[v.vertex];
    const double line = pose.lip_line.height_at(p.x);
    const double y = static_cast<double>(p.y);
    const double past = (v.upper ? line - y : y - line) - v.slack;
    // Not all onto the line: what is further past it stays further, or a lip pressed flat would fold.
    const double held = past <= 0.0 ? y : y + (v.upper ? 1.0 : -1.0) * past * past / (past + kLipGive * t.scale);
    moved = moved || held != y;
    p.y = static_cast<float>(held);
  }
  return moved;
}

void hold_vertices_apart(const Rig& rig, Pose& pose) {
  const RigTables& t = rig.tables();
  for (std::size_t e = 0; e < kEyeCount; ++e) {
    const RigTables::Eye& eye = t.eyes[e];
    for (const RigTables::EyeVertex& v : eye.vertices) {
      const glm::dvec3 from = glm::dvec3(pose.positions[v.vertex]) - eye.centre;
      const double squared = dot(from, from);
      if (squared >= v.least * v.least || squared <= 0.0) continue;
      pose.positions[v.vertex] = glm::vec3(eye.centre + v.least / std::sqrt(squared) * from);
    }
  }
  bool moved = hold_lips_apart(t, pose);
  const Placement jaw = jaw_in_head(rig, pose);
  const Teeth teeth(t, jaw);
  for (const RigTables::MouthPoint& p : t.mouth_vertices) {
    const glm::vec3& vertex = pose.positions[p.index];
    if (!teeth.reach(vertex.x, vertex.y, vertex.z, p.room)) continue;
    const glm::dvec3 at(vertex);
    const glm::dvec3 outside = teeth.outside(at, p.room);
    if (outside == at) continue;
    pose.positions[p.index] = glm::vec3(outside);
    moved = true;
  }
  // What was pushed off the teeth may have gone past the line again.
  if (moved) hold_lips_apart(t, pose);
}

}  // namespace nms::runtime
