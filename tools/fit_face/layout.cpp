#include "layout.h"

#include <fstream>
#include <sstream>

#include "scan.h"

namespace nms::fit_face {

Layout read_layout(const std::string& path) {
  Layout layout;
  std::ifstream in(path);
  if (!in) fail("cannot read " + path);
  std::string line;
  while (std::getline(in, line)) {
    if (line.empty() || line[0] == '#') continue;
    std::vector<std::string> fields;
    std::istringstream split(line);
    for (std::string f; std::getline(split, f, '|');) fields.push_back(f);
    std::istringstream head(fields[0]);
    std::string what;
    head >> what;
    if (what == "curve") {
      LayoutCurve c;
      std::string kind;
      head >> c.name >> kind;
      c.feature = kind == "feature";
      c.midline = kind == "midline";
      std::istringstream knots(fields[1]);
      for (std::string k; knots >> k;) {
        const auto at = k.find('@');
        c.knots.emplace_back(std::stoul(k.substr(0, at)), std::stod(k.substr(at + 1)));
      }
      std::istringstream vertices(fields[2]);
      for (std::uint32_t v; vertices >> v;) c.vertices.push_back(v);
      layout.curves.push_back(std::move(c));
    } else {
      LayoutSurface s;
      head >> s.name >> s.samples_u >> s.samples_v >> s.part;
      for (std::size_t k = 0; k < 4; ++k) {
        std::istringstream side(fields[k + 1]);
        side >> s.sides[k].curve >> s.sides[k].from >> s.sides[k].to;
      }
      layout.surfaces.push_back(std::move(s));
    }
  }
  return layout;
}

}  // namespace nms::fit_face
