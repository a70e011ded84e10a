#include "scan.h"

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include <fmt/format.h>
#include <glm/geometric.hpp>

namespace nms::fit_face {

void fail(const std::string& text) {
  fmt::print(stderr, "fit_face: {}\n", text);
  std::exit(1);
}

Scan read_scan(const std::string& path) {
  Scan scan;
  std::ifstream in(path);
  if (!in) fail("cannot read " + path);
  std::string line, material;
  while (std::getline(in, line)) {
    std::istringstream words(line);
    std::string key;
    words >> key;
    if (key == "v") {
      glm::dvec3 p;
      words >> p.x >> p.y >> p.z;
      scan.positions.push_back(p);
    } else if (key == "usemtl") {
      words >> material;
    } else if (key == "f") {
      std::vector<std::uint32_t> f;
      std::string corner;
      while (words >> corner) f.push_back(static_cast<std::uint32_t>(std::stoul(corner)) - 1);
      if (f.size() == 4 && (material == "M_Face" || material == "M_BackHead"))
        scan.quads.push_back({f[0], f[1], f[2], f[3]});
    }
  }
  scan.normals.assign(scan.positions.size(), glm::dvec3(0.0));
  for (const auto& q : scan.quads) {
    const glm::dvec3 n =
        glm::cross(scan.positions[q[2]] - scan.positions[q[0]], scan.positions[q[3]] - scan.positions[q[1]]);
    for (const auto v : q) scan.normals[v] += n;
  }
  for (auto& n : scan.normals) n = glm::length(n) > 0 ? glm::normalize(n) : n;
  return scan;
}

}  // namespace nms::fit_face
