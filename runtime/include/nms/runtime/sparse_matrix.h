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

/// Some rows of a sparse matrix, eight side by side. A block has the columns of all its rows; where a row lacks one,
/// its value is 0, which changes no sum: the same bits as above, four times as fast.
struct RowBlocks {
  static constexpr std::uint32_t kRows = 8;

  std::uint32_t columns = 0;
  std::vector<std::uint32_t> row;     ///< kRows for each block; the last row stands again where there are no more
  std::vector<std::uint32_t> begin;   ///< blocks + 1, into `column`
  std::vector<std::uint32_t> column;  ///< ascending in each block
  std::vector<float> value;           ///< kRows for each column of a block
};

/// @param rows  which ones, ascending
[[nodiscard]] RowBlocks row_blocks(const SparseMatrix& m, std::span<const std::uint32_t> rows);

/// out[r] = (m x)[r] + offsets[r] for the rows of the blocks; the others stay. No allocation.
/// @pre x.size() == m.columns; offsets and out have a place for every row
void multiply(const RowBlocks& m, std::span<const glm::vec3> x, std::span<const glm::vec3> offsets,
              std::span<glm::vec3> out);

}  // namespace nms::runtime
