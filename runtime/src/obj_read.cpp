#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <string>

#include <fast_float/fast_float.h>
#include <fmt/format.h>

#include <nms/runtime/polygon_mesh.h>

namespace nms::runtime {

namespace {

using program::Failure;
using Maybe = std::optional<Failure>;

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\0'; }

/// The words of a line.
class Words {
 public:
  explicit Words(std::string_view line) : rest_(line) {}

  std::string_view next() {
    while (!rest_.empty() && is_blank(rest_.front())) rest_.remove_prefix(1);
    std::size_t n = 0;
    while (n < rest_.size() && !is_blank(rest_[n])) ++n;
    const std::string_view word = rest_.substr(0, n);
    rest_.remove_prefix(n);
    return word;
  }

  /// What is left, blanks about it aside: names may have blanks inside.
  std::string_view all() const {
    std::string_view text = rest_;
    while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
    while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
    return text;
  }

 private:
  std::string_view rest_;
};

class ObjReader {
 public:
  ObjReader(std::string_view name, const PolygonLimits& limits) : name_(name), limits_(limits) {}

  tl::expected<PolygonMesh, Failure> run(std::string_view text) {
    if (text.size() > limits_.bytes) return tl::unexpected(too_large(fmt::format("it has {} bytes", text.size())));
    std::string joined;  // a line that ends with \ goes on in the next
    while (!text.empty()) {
      const std::size_t end = std::min(text.find('\n'), text.size());
      std::string_view line = text.substr(0, end);
      text.remove_prefix(std::min(end + 1, text.size()));
      ++line_;
      while (!line.empty() && is_blank(line.back())) line.remove_suffix(1);
      if (!line.empty() && line.back() == '\\') {
        joined.append(line.substr(0, line.size() - 1));
        joined += ' ';
        continue;
      }
      if (!joined.empty()) {
        joined.append(line);
        line = joined;
      }
      if (auto failure = read_line(line)) return tl::unexpected(std::move(*failure));
      joined.clear();
    }
    if (triangles_ == 0) {
      return tl::unexpected(
          Failure{"face_empty", std::string(name_), "it has no polygons", "give it faces: lines such as f 1 2 3"});
    }
    return std::move(mesh_);
  }

 private:
  std::string place() const { return fmt::format("{}:{}", name_, line_); }
  Failure too_large(std::string cause) const {
    return {"face_too_large", place(), std::move(cause), "a head of 200,000 vertices is plenty: simplify it"};
  }

  Maybe read_line(std::string_view line) {
    Words words(line);
    const std::string_view key = words.next();
    if (key == "v" || key == "f") {
      words = Words(line.substr(0, line.find('#')));  // names may hold a #, numbers end before it
      words.next();
      return key == "v" ? vertex(words) : polygon(words);
    }
    if (key == "g") {
      groups_.clear();
      for (std::string_view g = words.next(); !g.empty() && groups_.size() < 16; g = words.next())
        groups_.emplace_back(g);
      piece_ = nullptr;
    } else if (key == "o") {
      object_ = words.all();
      piece_ = nullptr;
    } else if (key == "usemtl") {
      material_ = words.all();
      piece_ = nullptr;
    }
    return std::nullopt;
  }

  Maybe vertex(Words& words) {
    if (mesh_.positions.size() >= limits_.vertices)
      return too_large(fmt::format("it has more than {} vertices", limits_.vertices));
    glm::dvec3 p(0.0);
    for (int k = 0; k < 3; ++k) {
      std::string_view word = words.next();
      if (word.starts_with('+') && !word.starts_with("+-")) word.remove_prefix(1);
      const auto [end, error] = fast_float::from_chars(word.data(), word.data() + word.size(), p[k]);
      if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(p[k]) || std::abs(p[k]) > 1e9) {
        return Failure{"face_bad_number", place(), fmt::format("\"{}\" is no coordinate", word.substr(0, 40)),
                       "give three numbers: v 0.1 0.2 0.3"};
      }
    }
    mesh_.positions.push_back(p);
    return std::nullopt;
  }

  // 12, 12/3, 12//5 or -1: the vertex is all that counts.
  std::optional<std::uint32_t> corner(std::string_view word) const {
    std::int64_t number = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    if (error != std::errc() || (end != word.data() + word.size() && *end != '/')) return std::nullopt;
    const auto count = static_cast<std::int64_t>(mesh_.positions.size());
    const std::int64_t index = number > 0 ? number - 1 : count + number;
    if (number == 0 || index < 0 || index >= count) return std::nullopt;
    return static_cast<std::uint32_t>(index);
  }

  Maybe polygon(Words& words) {
    corners_.clear();
    for (std::string_view word = words.next(); !word.empty(); word = words.next()) {
      if (corners_.size() == limits_.corners)
        return too_large(fmt::format("a polygon has more than {} corners", limits_.corners));
      const auto index = corner(word);
      if (!index) {
        return Failure{
            "face_bad_index", place(),
            fmt::format("\"{}\" is none of the {} vertices before it", word.substr(0, 40), mesh_.positions.size()),
            "vertices count from 1, or backwards from -1"};
      }
      corners_.push_back(*index);
    }
    if (corners_.size() < 3) {
      return Failure{"face_bad_index", place(), fmt::format("a polygon has {} corners", corners_.size()),
                     "give three or more"};
    }
    if (corners_.size() == 4 && cut_from_second()) std::rotate(corners_.begin(), corners_.begin() + 1, corners_.end());
    for (std::size_t i = 1; i + 1 < corners_.size(); ++i) {
      const std::array<std::uint32_t, 3> t{corners_[0], corners_[i], corners_[i + 1]};
      if (t[0] == t[1] || t[1] == t[2] || t[0] == t[2]) continue;
      if (++triangles_ > limits_.triangles)
        return too_large(fmt::format("it has more than {} triangles", limits_.triangles));
      if (auto failure = find_piece()) return failure;
      piece_->triangles.push_back(t);
    }
    return std::nullopt;
  }

  // Whether the diagonal from the second corner is the shorter one.
  bool cut_from_second() const {
    const auto squared = [&](std::size_t a, std::size_t b) {
      const glm::dvec3 d = mesh_.positions[corners_[a]] - mesh_.positions[corners_[b]];
      return d.x * d.x + d.y * d.y + d.z * d.z;
    };
    return squared(1, 3) < squared(0, 2);
  }

  Maybe find_piece() {
    if (piece_ != nullptr) return std::nullopt;
    std::vector<std::string> names = groups_;
    for (const std::string& name : {object_, material_})
      if (!name.empty()) names.push_back(name);
    const auto [at, fresh] = known_.try_emplace(std::pair(names, material_), mesh_.pieces.size());
    if (fresh) {
      if (mesh_.pieces.size() >= limits_.pieces)
        return too_large(fmt::format("it has more than {} groups", limits_.pieces));
      mesh_.pieces.push_back({std::move(names), material_, std::nullopt, {}});
    }
    piece_ = &mesh_.pieces[at->second];
    return std::nullopt;
  }

  std::string_view name_;
  const PolygonLimits& limits_;
  std::size_t line_ = 0;
  std::size_t triangles_ = 0;
  std::vector<std::string> groups_;
  std::string object_;
  std::string material_;
  std::vector<std::uint32_t> corners_;
  std::map<std::pair<std::vector<std::string>, std::string>, std::size_t> known_;
  PolygonMesh::Piece* piece_ = nullptr;  // until the next name
  PolygonMesh mesh_;
};

}  // namespace

tl::expected<PolygonMesh, Failure> read_obj(std::string_view text, std::string_view name, const PolygonLimits& limits) {
  return ObjReader(name, limits).run(text);
}

}  // namespace nms::runtime
