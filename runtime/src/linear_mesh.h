#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

namespace nms::runtime {

/// Vertices one after the other: from `begin` to before `end`.
struct VertexRun {
  std::uint32_t begin = 0;
  std::uint32_t end = 0;
};

/// A mesh as a file has it: what it is at rest, and straight displacements added by weight.
struct LinearMesh {
  std::vector<glm::vec3> positions;  ///< V at rest                                        [m]
  std::vector<glm::vec3> normals;    ///< V, unit
  struct Target {
    std::vector<glm::vec3> moved;   ///< V                                                  [m]
    std::vector<glm::vec3> turned;  ///< V, difference of normals
  };
  std::vector<Target> targets;
  /// Where each of the first targets is not 0, for the sums below: most targets move a small part of a face.
  std::vector<std::vector<VertexRun>> reach;

  /// Notes the reach of targets that have been added. Those before may not change any more.
  void note_reach();

  /// positions + sum of weights x moved. @param weights one for each target  @param out V
  void place(std::span<const float> weights, std::span<glm::vec3> out) const;
  /// The same of the normals; not of unit length.
  void turn(std::span<const float> weights, std::span<glm::vec3> out) const;
};

/// Displacements that straight targets lack, as few as will do.
///
/// A field of displacements r is fitted by sum_j w_j b_j with the least sum of squares. Of what remains, the worst
/// field seen becomes the next b: matching pursuit (Mallat and Zhang 1993), with all weights solved anew (its
/// orthogonal form).
class ResidualBasis {
 public:
  explicit ResidualBasis(std::size_t vertices) : vertices_(vertices) {}

  [[nodiscard]] std::size_t size() const { return fields_.size(); }
  [[nodiscard]] const std::vector<glm::vec3>& field(std::size_t j) const { return fields_[j]; }
  void add(std::vector<glm::vec3> field);

  /// @param residual V  @param weights out, size() of them
  void fit(std::span<const glm::vec3> residual, std::span<double> weights) const;
  /// residual - sum of weights x fields, in place.
  void subtract(std::span<const double> weights, std::span<glm::vec3> residual) const;

 private:
  std::size_t vertices_;
  std::vector<std::vector<glm::vec3>> fields_;
  std::vector<std::vector<VertexRun>> reach_;  // where the field is not 0
  std::vector<std::vector<double>> factor_;    // Cholesky factor of the fields' products, row by row
};

/// Largest length among V vectors, and where.
struct Largest {
  std::size_t index = 0;
  double length = 0.0;
};
[[nodiscard]] Largest largest(std::span<const glm::vec3> vectors);

}  // namespace nms::runtime
