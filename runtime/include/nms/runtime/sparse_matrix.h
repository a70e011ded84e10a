#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

namespace nms::runtime {

/// A constant sparse matrix, compressed by rows. Columns of a row ascend; no entry is repeated.
struct SparseMatrix {
  std::uint32_t rows = 0;
  std::uint32_t columns = 0;
  std::vector<std::uint32_t> row_begin;  ///< rows + 1, ascending, last = number of entries
  std::vector<std::uint32_t> column;     ///< one for each entry, < columns
  std::vector<float> value;              ///< one for each entry
};

/// out = m x. Sums run along each row in order, in single precision without contraction, so every machine agrees.
/// @pre x.size() == m.columns, out.size() == m.rows
void multiply(const SparseMatrix& m, std::span<const glm::vec3> x, std::span<glm::vec3> out);

}  // namespace nms::runtime
