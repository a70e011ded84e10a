// fit_face SCAN.obj LAYOUT.txt OUT.x3d: a face file from a scan of a head. README.md says how.
#include <cstdio>
#include <fstream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <nms/face_program/face_program.h>
#include <nms/lang/parse.h>
#include <nms/program/program.h>
#include <nms/runtime/face_x3d.h>
#include <nms/stdlib/embedded.h>

#include "fit.h"
#include "layout.h"
#include "lids.h"
#include "materials.h"
#include "measure.h"
#include "parts.h"
#include "regions.h"
#include "scan.h"
#include "shells.h"
#include "skin_mesh.h"
#include "tint.h"
#include "unfold.h"

namespace nms::fit_face {
namespace {

std::uint32_t material_of(const std::string& part, const Materials& materials) {
  if (part == "lip") return materials.lips;
  if (part == "lining") return materials.mouth_lining;
  if (part == "nostril") return materials.dark;
  return materials.skin;
}

void add_net(const Model& m, const Materials& materials, runtime::FaceFile& file) {
  const Regions regions(m);
  const auto places = [&](const std::vector<runtime::Row>& rows) {
    std::vector<glm::dvec3> out;
    for (const runtime::Row& row : rows) out.push_back(m.at(row) * kMillimetres / 1000.0);  // metres
    return out;
  };
  file.nodes = m.nodes;
  for (std::size_t c = 0; c < m.net.curves.size(); ++c) {
    runtime::FaceFileCurve curve;
    curve.curve = m.net.curves[c];
    curve.points = places(m.seams.curves[c]);
    regions.add_to(curve);
    file.curves.push_back(std::move(curve));
  }
  const std::vector<runtime::SurfaceSamples> densities = samples(m.layout);
  for (std::size_t s = 0; s < m.net.surfaces.size(); ++s) {
    runtime::FaceFileSurface surface;
    surface.geometry = m.net.surfaces[s];
    surface.points = places(m.seams.surfaces[s]);
    surface.part = m.layout.surfaces[s].part;
    surface.samples = densities[s];
    surface.material = material_of(surface.part, materials);
    surface.mirrored = true;
    regions.add_to(surface);
    add_tint(m, surface);
    file.surfaces.push_back(std::move(surface));
  }
}

runtime::Face read_back(const std::string& text, const std::string& path, double density) {
  runtime::TessellationSettings settings;
  settings.density = density;
  auto face = runtime::read_face_x3d(text, path, settings);
  if (!face) fail(fmt::format("{}: {}", face.error().place, face.error().cause));
  return std::move(*face);
}

void print(const char* what, const Distances& d) {
  fmt::print("{}: mean {:.3f}, p99 {:.2f}, max {:.2f} mm ({} places)\n", what, d.mean, d.p99, d.max, d.count);
}

std::string write_face(const Model& model) {
  runtime::FaceFile file;
  file.title = "ada";
  const Materials materials = add_materials(file);
  add_net(model, materials, file);
  add_shells(model, materials, file);
  add_parts(model, materials, file);
  return runtime::write_face_x3d(file);
}

// The library's muscles, placed by ada's landmarks, under every unit.
program::Image all_units() {
  std::string source;
  for (const auto& file : stdlib::embedded_files()) {
    if (file.path != "facs.nms") continue;
    lang::Diagnostics diagnostics;
    const auto tree =
        lang::parse(std::make_shared<const lang::Source>(std::string(file.path), std::string(file.text)), diagnostics);
    for (const lang::NodeRef node : tree->root().children()) {
      if (!node.is(lang::NodeKind::au)) continue;
      const std::string number(node.child(lang::NodeKind::quantity).text());
      source += fmt::format("expression e{0} 1s {{ 100%: AU{0} }}\n", number);
    }
  }
  const std::vector<std::pair<std::string, std::string>> sources = {{"units.nms", source}};
  std::string said;
  auto image = face_program::compile_face(sources, "ada", {}, said);
  if (!image) fail(said);
  return std::move(*image);
}

void run(const std::string& scan_path, const std::string& layout_path, const std::string& out_path) {
  const Scan scan = read_scan(scan_path);
  const Layout layout = read_layout(layout_path);

  Model model = fit(scan, layout);
  shape_lid_backs(model);
  tuck_lining(model);
  part_corner(model);
  const program::Image muscles = all_units();
  if (!getenv("NOUNFOLD"))
    unfold(model, muscles.program(), [&](const Model& m) { return read_back(write_face(m), out_path, 1.0); });

  const std::string text = write_face(model);
  if (!(std::ofstream(out_path, std::ios::binary) << text)) fail("cannot write " + out_path);

  const Figures figures = measure(scan, layout, read_back(text, out_path, kMeasuringDensity));
  print("scan to surface", figures.scan_to_surface);
  print("surface to scan", figures.surface_to_scan);
  fmt::print("seam gap {:.1e} mm, {} folds\n", seam_gap(model), count_folds(read_back(text, out_path, 1.0)));
}

}  // namespace
}  // namespace nms::fit_face

int main(int argc, char** argv) {
  if (argc != 4) {
    fmt::print(stderr, "usage: fit_face SCAN.obj LAYOUT.txt OUT.x3d\n");
    return 2;
  }
  nms::fit_face::run(argv[1], argv[2], argv[3]);
  return 0;
}
