#include "ada_fixture.h"

#include <map>
#include <memory>
#include <tuple>
#include <utility>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <nms/compiler/compile.h>
#include <nms/lang/parse.h>
#include <nms/program/evaluate.h>
#include <nms/program/program.h>
#include <nms/runtime/face_file.h>
#include <nms/runtime/face_x3d.h>
#include <nms/runtime/places_at_rest.h>
#include <nms/runtime/region_shares.h>
#include <nms/runtime/rig.h>
#include <nms/stdlib/embedded.h>

namespace nms::ada {

std::string embedded(std::string_view path) {
  for (const auto& file : stdlib::embedded_files()) {
    if (file.path == path) return std::string(file.text);
  }
  ADD_FAILURE() << path << " is not in the standard library";
  return {};
}

namespace {

class Library : public lang::SourceProvider {
 public:
  std::shared_ptr<const lang::Source> find(std::string_view name, std::string_view from) override {
    const std::string beside = std::string(from.substr(0, from.rfind('/') + 1)) + std::string(name);
    for (const std::string& path : {beside, std::string(name)}) {
      if (const auto it = known_.find(path); it != known_.end()) return it->second;
      for (const auto& file : stdlib::embedded_files()) {
        if (file.path == path) {
          return known_[path] = std::make_shared<const lang::Source>(path, std::string(file.text));
        }
      }
    }
    return nullptr;
  }

 private:
  std::map<std::string, std::shared_ptr<const lang::Source>, std::less<>> known_;
};

}  // namespace

const runtime::Face& face() {
  static const runtime::Face read = runtime::read_face_x3d(embedded("faces/ada.x3d"), "ada.x3d").value();
  return read;
}

Bound bind_with(const std::string& source) {
  Library library;
  lang::Diagnostics diagnostics;
  compiler::CompileOptions options;
  options.face = "ada";
  const auto draft =
      compiler::compile({std::make_shared<const lang::Source>("test.nms", source), library.find("faces/ada.nms", "")},
                        library, diagnostics, options);
  for (const auto& d : diagnostics.all()) {
    if (!draft) ADD_FAILURE() << d.source->path() << ": " << d.kind << ": " << d.message;
  }
  program::Image image = std::move(program::Image::from(draft.value()).value());
  runtime::Rig rig = runtime::bind(face(), image.program()).value();
  return {std::move(image), std::move(rig)};
}

std::string expressions_of_all_units() {
  std::string source;
  Library library;
  lang::Diagnostics diagnostics;
  const auto tree = lang::parse(library.find("facs.nms", ""), diagnostics);
  for (const lang::NodeRef node : tree->root().children()) {
    if (!node.is(lang::NodeKind::au)) continue;
    const std::string number(node.child(lang::NodeKind::quantity).text());
    source += "expression e" + number + " 1s { 100%: AU" + number + " }\n";
  }
  return source;
}

const Bound& all_units() {
  static const Bound bound = bind_with(expressions_of_all_units());
  return bound;
}

const std::vector<glm::dvec3>& rest() {
  static const std::vector<glm::dvec3> places = runtime::places_at_rest(face().skin);
  return places;
}

bool is_shell(const runtime::Primitive& p) {
  const std::string& name = face().materials[p.material].name;
  return name == "brow" || name == "hair";
}

const std::vector<Triangle>& skin_triangles() {
  static const std::vector<Triangle> all = [] {
    std::vector<Triangle> out;
    for (const runtime::Primitive& p : face().skin.primitives) {
      if (is_shell(p)) continue;
      for (std::size_t i = 0; i + 2 < p.triangles.size(); i += 3) {
        out.push_back({p.triangles[i], p.triangles[i + 1], p.triangles[i + 2]});
      }
    }
    return out;
  }();
  return all;
}

const std::vector<int>& partners() {
  static const std::vector<int> all = [] {
    // Coordinates as the bits that the file gives them; shells have vertices of skin and offset, so both count.
    const auto places = rest();
    std::map<std::tuple<float, float, float>, std::vector<int>> at;
    const auto key = [](const glm::dvec3& p, float sign) {
      return std::tuple(sign * static_cast<float>(p.x) + 0.0F, static_cast<float>(p.y), static_cast<float>(p.z));
    };
    for (std::size_t v = 0; v < places.size(); ++v) at[key(places[v], 1.0F)].push_back(static_cast<int>(v));
    std::vector<int> out;
    for (const glm::dvec3& p : places) {
      const auto found = at.find(key(p, -1.0F));
      out.push_back(found == at.end() ? -1 : found->second.front());
    }
    return out;
  }();
  return all;
}

std::vector<float> mirrored(const program::Program& p, const std::vector<float>& values) {
  std::vector<float> out = values;
  for (std::size_t c = 0; c < p.channels.size(); ++c) {
    const program::Channel& channel = p.channels[c];
    if (channel.kind == program::ChannelKind::axis) {
      const bool sideways = channel.motion == program::Motion::rotate_y ||
                            channel.motion == program::Motion::rotate_z ||
                            channel.motion == program::Motion::translate_x;
      if (sideways) out[c] = -values[c];
      continue;
    }
    for (std::size_t other = 0; other < p.channels.size(); ++other) {
      const program::Channel& o = p.channels[other];
      const bool pair = (channel.side == program::Side::left && o.side == program::Side::right) ||
                        (channel.side == program::Side::right && o.side == program::Side::left);
      if (o.au == channel.au && o.kind == channel.kind && pair) out[other] = values[c];
    }
  }
  return out;
}

std::vector<float> vertex_weights(std::string_view region) { return runtime::region_shares(face(), region); }

std::vector<float> values_of(const Bound& b, const std::vector<std::string>& units, float amount) {
  const program::Program& p = b.image.program();
  std::vector<float> values(p.channels.size(), 0.0F);
  for (const std::string& unit : units) {
    bool known = false;
    for (std::size_t c = 0; c < p.channels.size(); ++c) {
      const program::Channel& channel = p.channels[c];
      const std::string_view name = p.string(channel.name);
      float sign = 0.0F;
      if (name == unit || name == unit + "L" || name == unit + "R") sign = 1.0F;
      if (channel.kind == program::ChannelKind::axis) {
        if (p.string(channel.positive) == unit) sign = 1.0F;
        if (p.string(channel.negative) == unit) sign = -1.0F;
      }
      if (sign == 0.0F) continue;
      values[c] = sign * amount;
      known = true;
    }
    if (!known) ADD_FAILURE() << "no unit " << unit;
  }
  return values;
}

glm::dvec3 landmark(const Bound& b, std::string_view name) {
  const program::Program& p = b.image.program();
  for (const program::Landmark& mark : p.landmarks) {
    if (p.string(mark.name) == name) return {mark.position[0], mark.position[1], mark.position[2]};
  }
  ADD_FAILURE() << "no landmark " << name;
  return glm::dvec3(0.0);
}

std::string nearest_landmark(const Bound& b, const glm::dvec3& p) {
  return runtime::nearest_landmark(runtime::landmarks_of(face(), b.image.program()), p);
}

}  // namespace nms::ada
