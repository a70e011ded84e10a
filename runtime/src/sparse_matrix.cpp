#include <nms/runtime/sparse_matrix.h>

#include <cassert>

namespace nms::runtime {

void multiply(const SparseMatrix& m, std::span<const glm::vec3> x, std::span<glm::vec3> out) {
  assert(x.size() == m.columns && out.size() == m.rows);
  for (std::uint32_t row = 0; row < m.rows; ++row) {
    glm::vec3 sum(0.0F);
    for (std::uint32_t k = m.row_begin[row]; k < m.row_begin[row + 1]; ++k) sum += m.value[k] * x[m.column[k]];
    out[row] = sum;
  }
}

}  // namespace nms::runtime
