#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <glm/vec3.hpp>

#include <nms/runtime/face.h>
#include <nms/runtime/face_scale.h>
#include <nms/runtime/rig.h>

/// What no face may show, looked for on all vertices of any face in any pose. Nothing here shares code with what holds
/// the surfaces apart (runtime/src/contact.cpp): depths are found on the triangles of skin, teeth and tongue
/// themselves.
///
/// Seams are not looked at: where surfaces meet they share one vertex (ada_seams_test.cpp).
///
/// What a face's file shows at rest is its own: it counts only as far as a pose makes it worse.
namespace nms::test {

struct Artefact {
  std::string kind;    ///< "skin in eyeball"
  std::string place;   ///< the nearest landmark
  glm::dvec3 at{0.0};  ///< at rest [m]
  double mm = 0.0;     ///< how deep, how wide, of folds the side of a square of their area; on a head of ada's size
};

/// What goes through what by less than this is let pass, on a head of ada's size.
inline constexpr double kArtefactDepth_mm = 0.2;

/// A row of teeth with its gums, in its frame at rest: how deep a place is inside.
class TeethRow {
 public:
  /// @param scale  of the face, against ada
  TeethRow(const runtime::Face& face, runtime::Frame frame, bool gums, double scale);

  /// 0 outside. [m]
  [[nodiscard]] double depth_m(const glm::dvec3& p) const;
  /// Of the row's front. [m]
  [[nodiscard]] double front_z() const { return front_; }
  [[nodiscard]] bool empty() const { return triangles_.empty(); }
  [[nodiscard]] const glm::dvec3& low() const { return low_; }
  [[nodiscard]] const glm::dvec3& high() const { return high_; }

 private:
  [[nodiscard]] static std::pair<int, int> columns(double from, double to);
  [[nodiscard]] double along(const glm::dvec3& p) const;
  [[nodiscard]] std::size_t cell(int column, int row) const;
  [[nodiscard]] int row_at(double y) const;

  double scale_ = 1.0;
  double back_ = 1.0;
  double front_ = -1.0;
  double largest_ = 0.0;
  glm::dvec3 low_{1e9}, high_{-1e9};
  /// A triangle of the row; which of its edges no other shares.
  struct Face {
    std::array<glm::dvec3, 3> corners;
    std::array<bool, 3> border{};  ///< from corner k to the next
  };
  /// How far p is behind the nearest place of the row; 0 where that is on a border: there is no behind.
  [[nodiscard]] double behind_nearest_m(const glm::dvec3& p, double at_most) const;

  std::vector<Face> triangles_;
  std::vector<std::vector<std::uint32_t>> cells_;
};

struct InspectorSettings {
  /// The mouth's lining deeper than the lips is held against teeth and gums too. Rows that are open behind have no
  /// inside there, and what it does is not seen.
  bool lining = true;
};

class Inspector {
 public:
  /// Keeps the face and the rig by reference.
  Inspector(const runtime::Face& face, const runtime::Rig& rig, runtime::Landmarks landmarks,
            InspectorSettings settings = {});

  /// What this pose shows: each kind once, where it is worst.
  [[nodiscard]] std::vector<Artefact> look(std::span<const float> values);

  /// What the face shows at rest: its file's own.
  [[nodiscard]] const std::vector<Artefact>& at_rest() const { return at_rest_; }

 private:
  using Triangle = std::array<std::uint32_t, 3>;
  struct Eye {
    glm::dvec3 centre{0.0};
    double radius = 0.0;  ///< [m]
    std::size_t state = 0;
    std::vector<std::uint32_t> triangles;  ///< of the skin about it
    std::vector<double> rest_depth;        ///< of each [m]
  };
  struct Lip {
    std::vector<std::uint32_t> vertices;
    std::vector<Triangle> triangles;
    std::vector<std::vector<std::uint32_t>> cells;  ///< triangles by x and z
  };

  void find_skin();
  void find_lips();
  void find_eyes();
  void add(const std::string& kind, std::uint32_t vertex, double metres);
  void add_at(const std::string& kind, const glm::dvec3& place, double metres);
  [[nodiscard]] glm::dvec3 now(std::uint32_t v) const { return glm::dvec3(pose_.positions[v]); }
  [[nodiscard]] bool folded(const Triangle& t) const;
  [[nodiscard]] std::size_t lip_cell(double x, double z) const;
  void fill(Lip& lip) const;
  [[nodiscard]] double past_lip(const Lip& lip, const glm::dvec3& p, bool lower_lip) const;
  [[nodiscard]] glm::dvec3 to_jaw(const glm::dvec3& p) const;
  [[nodiscard]] glm::dvec3 from_jaw(const glm::dvec3& p) const;
  void look_for_lost();
  void look_for_folds();
  void look_at_eyes();
  void look_at_shut(const Eye& eye);
  void look_at_lips();
  void look_at_teeth();
  void look_at_tongue();
  double beyond_rest(std::vector<double>& rest, std::size_t i, double depth) const;

  const runtime::Face& face_;
  const runtime::Rig& rig_;
  runtime::Landmarks landmarks_;
  double scale_ = 1.0;
  InspectorSettings settings_;
  runtime::Pose pose_;
  std::vector<glm::dvec3> rest_;
  std::vector<Triangle> skin_;
  std::vector<char> folded_at_rest_;
  std::vector<Eye> eyes_;
  std::array<Lip, 2> lips_;  ///< upper, lower
  std::vector<std::uint32_t> mouth_;
  TeethRow upper_row_, lower_row_, upper_teeth_, lower_teeth_;
  std::size_t tongue_ = 0;
  bool has_tongue_ = false;
  bool resting_ = true;  ///< what is found is noted as the file's own
  std::array<std::vector<double>, 2> rest_past_lip_;
  std::vector<double> rest_in_teeth_, rest_tongue_in_teeth_, rest_tongue_in_lip_;
  std::map<std::string, std::pair<double, glm::dvec3>> found_;
  std::vector<Artefact> at_rest_;
};

/// How much of a kind is let pass.
struct ArtefactLimit {
  std::string kind;
  double mm = 0.0;     ///< the worst pose
  double share = 0.0;  ///< of all poses that may show it [0, 1]
};

/// Gathers what many poses show, and says it.
class ArtefactTally {
 public:
  void add(const std::vector<Artefact>& found, const std::string& pose);
  /// A line for each kind, then its worst poses, at most `most` each.
  [[nodiscard]] std::string text(std::size_t most) const;
  [[nodiscard]] bool empty() const { return of_.empty(); }
  /// What goes past these, a line each; empty: nothing does. A kind that is not among them may not be shown at all.
  [[nodiscard]] std::string past(const std::vector<ArtefactLimit>& limits) const;

 private:
  int poses_ = 0;
  std::map<std::string, std::vector<std::pair<double, std::string>>> of_;
};

}  // namespace nms::test
