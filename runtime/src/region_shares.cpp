#include <nms/runtime/region_shares.h>

#include <string>

namespace nms::runtime {

std::vector<float> region_shares(const Face& face, std::string_view region) {
  const SparseMatrix& t = face.skin.surface;
  std::vector<float> shares(t.rows, 0.0F);
  const auto found = face.regions.find(std::string(region));
  if (found == face.regions.end()) return shares;
  for (std::uint32_t v = 0; v < t.rows; ++v) {
    for (std::uint32_t k = t.row_begin[v]; k < t.row_begin[v + 1]; ++k)
      shares[v] += t.value[k] * found->second[t.column[k]];
  }
  return shares;
}

}  // namespace nms::runtime
