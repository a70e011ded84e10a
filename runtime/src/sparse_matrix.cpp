#include <nms/runtime/sparse_matrix.h>

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstring>

#include <nms/program/several_processors.h>

namespace nms::runtime {

void multiply(const SparseMatrix& m, std::span<const glm::vec3> x, std::span<glm::vec3> out) {
  assert(x.size() == m.columns && out.size() == m.rows);
  for (std::uint32_t row = 0; row < m.rows; ++row) {
    glm::vec3 sum(0.0F);
    for (std::uint32_t k = m.row_begin[row]; k < m.row_begin[row + 1]; ++k) sum += m.value[k] * x[m.column[k]];
    out[row] = sum;
  }
}

RowBlocks row_blocks(const SparseMatrix& m, std::span<const std::uint32_t> rows) {
  RowBlocks blocks;
  blocks.columns = m.columns;
  blocks.row.assign(rows.begin(), rows.end());
  while (blocks.row.size() % RowBlocks::kRows != 0) blocks.row.push_back(blocks.row.back());
  blocks.begin.push_back(0);
  std::vector<std::uint32_t> columns;
  for (std::size_t first = 0; first < blocks.row.size(); first += RowBlocks::kRows) {
    columns.clear();
    for (std::size_t l = 0; l < RowBlocks::kRows; ++l) {
      const std::uint32_t row = blocks.row[first + l];
      columns.insert(columns.end(), m.column.begin() + m.row_begin[row], m.column.begin() + m.row_begin[row + 1]);
    }
    std::sort(columns.begin(), columns.end());
    columns.erase(std::unique(columns.begin(), columns.end()), columns.end());
    const std::size_t at = blocks.column.size();
    blocks.column.insert(blocks.column.end(), columns.begin(), columns.end());
    blocks.value.resize(blocks.column.size() * RowBlocks::kRows, 0.0F);
    for (std::size_t l = 0; l < RowBlocks::kRows; ++l) {
      const std::uint32_t row = blocks.row[first + l];
      std::size_t j = 0;
      for (std::uint32_t k = m.row_begin[row]; k < m.row_begin[row + 1]; ++k) {
        while (columns[j] != m.column[k]) ++j;
        blocks.value[(at + j) * RowBlocks::kRows + l] = m.value[k];
      }
    }
    blocks.begin.push_back(static_cast<std::uint32_t>(blocks.column.size()));
  }
  return blocks;
}

namespace {

// A vector of the compiler's: what no processor has that wide is done in parts, with the same result.
using Eight = float __attribute__((vector_size(RowBlocks::kRows * sizeof(float))));

}  // namespace

NMS_FOR_SEVERAL_PROCESSORS
static void multiply_blocks(const RowBlocks& m, const glm::vec3* __restrict x, const glm::vec3* __restrict offsets,
                            glm::vec3* __restrict out) {
  const std::uint32_t* __restrict row = m.row.data();
  const float* __restrict values = m.value.data();
  for (std::size_t b = 0; b + 1 < m.begin.size(); ++b) {
    Eight sum_x{};
    Eight sum_y{};
    Eight sum_z{};
    for (std::size_t k = m.begin[b]; k < m.begin[b + 1]; ++k) {
      const glm::vec3& p = x[m.column[k]];
      Eight value;
      std::memcpy(&value, values + RowBlocks::kRows * k, sizeof value);
      sum_x += value * p.x;
      sum_y += value * p.y;
      sum_z += value * p.z;
    }
    for (std::size_t l = 0; l < RowBlocks::kRows; ++l) {
      const std::uint32_t r = row[b * RowBlocks::kRows + l];
      out[r] = glm::vec3(sum_x[l], sum_y[l], sum_z[l]) + offsets[r];
    }
  }
}

void multiply(const RowBlocks& m, std::span<const glm::vec3> x, std::span<const glm::vec3> offsets,
              std::span<glm::vec3> out) {
  assert(x.size() == m.columns && offsets.size() == out.size());
  multiply_blocks(m, x.data(), offsets.data(), out.data());
}

}  // namespace nms::runtime
