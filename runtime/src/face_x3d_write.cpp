#include <algorithm>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <nms/runtime/face_x3d.h>

#include "face_x3d_color.h"

namespace nms::runtime {

namespace {

// The other way, by halving.
double srgb_of(double c) {
  double low = 0.0;
  double high = 1.0;
  for (int i = 0; i < 40; ++i) {
    const double mid = 0.5 * (low + high);
    (linear_of(mid) < c ? low : high) = mid;
  }
  return 0.5 * (low + high);
}

class Writer {
 public:
  explicit Writer(const FaceFile& file) : file_(file) {}

  std::string run() {
    line("<?xml version='1.0' encoding='UTF-8'?>");
    line("<!DOCTYPE X3D PUBLIC 'ISO//Web3D//DTD X3D 3.3//EN' 'http://www.web3d.org/specifications/x3d-3.3.dtd'>");
    line("<X3D profile='Immersive' version='3.3'>");
    line("<head>");
    line("<component name='NURBS' level='1'/>");
    line(fmt::format("<meta name='title' content='{}'/>", escaped(file_.title)));
    line(
        "<meta name='description' content='Metres; +x the left of the person shown, +y up, +z forward. Border curves "
        "own the seams.'/>");
    line("</head>");
    line("<Scene>");
    line("<Switch whichChoice='-1'>");
    for (const FaceFileCurve& c : file_.curves) curve(c);
    line("</Switch>");
    line("<Group DEF='half'>");
    for (const FaceFileSurface& s : file_.surfaces) {
      if (s.mirrored) surface(s);
    }
    line("</Group>");
    line("<Transform scale='-1 1 1'><Group USE='half'/></Transform>");
    for (const FaceFileSurface& s : file_.surfaces) {
      if (!s.mirrored) surface(s);
    }
    line("</Scene>");
    line("</X3D>");
    return std::move(out_);
  }

 private:
  static std::string escaped(const std::string& text) {
    std::string out;
    for (const char c : text) {
      if (c == '&')
        out += "&amp;";
      else if (c == '<')
        out += "&lt;";
      else if (c == '\'')
        out += "&apos;";
      else if (c == '"')
        out += "&quot;";
      else
        out += c;
    }
    return out;
  }

  void line(std::string_view text) {
    out_ += text;
    out_ += '\n';
  }

  // A number with at most `digits` after the point and no trailing zeros.
  static std::string number(double value, int digits) {
    std::string text = fmt::format("{:.{}f}", value, digits);
    if (text.find('.') != std::string::npos) {
      while (text.back() == '0') text.pop_back();
      if (text.back() == '.') text.pop_back();
    }
    return text == "-0" ? "0" : text;
  }

  template <typename T>
  static std::string list(const std::vector<T>& values, int digits) {
    std::string text;
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (i > 0) text += ' ';
      text += number(static_cast<double>(values[i]), digits);
    }
    return text;
  }

  void coordinates(const std::vector<glm::dvec3>& points) {
    out_ += "<Coordinate containerField='controlPoint' point='";
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (i > 0) out_ += i % 4 == 0 ? ",\n" : ", ";
      out_ += fmt::format("{} {} {}", number(points[i].x, 7), number(points[i].y, 7), number(points[i].z, 7));
    }
    line("'/>");
  }

  void regions(const std::map<std::string, std::vector<float>>& all) {
    for (const auto& [name, weights] : all) {
      if (std::all_of(weights.begin(), weights.end(), [](float w) { return w < 0.0005F; })) continue;
      line(fmt::format("<MetadataFloat containerField='value' name='region:{}' value='{}'/>", name, list(weights, 3)));
    }
  }

  void curve(const FaceFileCurve& c) {
    line(fmt::format("<Shape><NurbsCurve DEF='{}' order='{}' knot='{}'>", c.curve.name, c.curve.degree + 1,
                     list(c.curve.knots, 6)));
    line("<MetadataSet containerField='metadata' name='curve'>");
    for (std::size_t e = 0; e < 2; ++e) {
      const CurveEnd& end = c.curve.ends[e];
      const char* key = e == 0 ? "start" : "end";
      if (end.node != kNoIndex) {
        line(fmt::format("<MetadataString containerField='value' name='{}' value='\"node\" \"{}\"'/>", key,
                         file_.nodes[end.node]));
        continue;
      }
      line(fmt::format("<MetadataString containerField='value' name='{}' value='\"curve\" \"{}\"'/>", key,
                       file_.curves[end.curve].curve.name));
      line(fmt::format("<MetadataDouble containerField='value' name='{}_at' value='{}'/>", key, number(end.at, 6)));
    }
    regions(c.regions);
    line("</MetadataSet>");
    coordinates(c.points);
    line("</NurbsCurve></Shape>");
  }

  void surface(const FaceFileSurface& s) {
    const NetSurface& g = s.geometry;
    out_ += "<Shape><Appearance>";
    const Material& m = file_.materials[s.material];
    if (std::find(written_.begin(), written_.end(), s.material) != written_.end()) {
      out_ += fmt::format("<Material USE='{}'/>", m.name);
    } else {
      written_.push_back(s.material);
      out_ += fmt::format(
          "<Material DEF='{}' diffuseColor='{} {} {}' transparency='{}'><MetadataSet containerField='metadata' "
          "name='look'><MetadataFloat containerField='value' name='roughness' value='{}'/></MetadataSet></Material>",
          m.name, number(srgb_of(static_cast<double>(m.base_color.r)), 4),
          number(srgb_of(static_cast<double>(m.base_color.g)), 4),
          number(srgb_of(static_cast<double>(m.base_color.b)), 4), number(1.0 - static_cast<double>(m.base_color.a), 3),
          number(static_cast<double>(m.roughness), 3));
    }
    line("</Appearance>");
    out_ += fmt::format(
        "<NurbsPatchSurface DEF='{}' uDimension='{}' vDimension='{}' uOrder='{}' vOrder='{}' uKnot='{}' vKnot='{}'",
        g.name, g.count_u(), g.count_v(), g.degree_u + 1, g.degree_v + 1, list(g.knots_u, 6), list(g.knots_v, 6));
    if (!g.weights.empty()) out_ += fmt::format(" weight='{}'", list(g.weights, 9));
    line(fmt::format(" solid='{}'>", m.double_sided ? "false" : "true"));
    line("<MetadataSet containerField='metadata' name='surface'>");
    line(fmt::format("<MetadataString containerField='value' name='part' value='\"{}\"'/>", s.part));
    if (!s.frame.empty())
      line(fmt::format("<MetadataString containerField='value' name='frame' value='\"{}\"'/>", s.frame));
    if (!s.rides.empty())
      line(fmt::format("<MetadataString containerField='value' name='rides' value='\"{}\"'/>", s.rides));
    line(fmt::format("<MetadataInteger containerField='value' name='samples' value='{} {}'/>", s.samples.u,
                     s.samples.v));
    if (g.sides) {
      std::string names;
      std::vector<double> from, to;
      for (const SurfaceSide& side : *g.sides) {
        names += fmt::format("{}\"{}\"", names.empty() ? "" : " ", file_.curves[side.curve].curve.name);
        from.push_back(side.from);
        to.push_back(side.to);
      }
      line(fmt::format("<MetadataString containerField='value' name='sides' value='{}'/>", names));
      line(fmt::format("<MetadataDouble containerField='value' name='side_from' value='{}'/>", list(from, 6)));
      line(fmt::format("<MetadataDouble containerField='value' name='side_to' value='{}'/>", list(to, 6)));
    }
    if (!s.tint.empty()) {
      std::vector<double> flat;
      for (const glm::vec3& t : s.tint) flat.insert(flat.end(), {t.x, t.y, t.z});
      line(fmt::format("<MetadataFloat containerField='value' name='tint' value='{}'/>", list(flat, 3)));
    }
    regions(s.regions);
    line("</MetadataSet>");
    coordinates(s.points);
    line("</NurbsPatchSurface></Shape>");
  }

  const FaceFile& file_;
  std::vector<std::uint32_t> written_;
  std::string out_;
};

}  // namespace

std::string write_face_x3d(const FaceFile& file) { return Writer(file).run(); }

}  // namespace nms::runtime
