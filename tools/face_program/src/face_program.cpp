#include <nms/face_program/face_program.h>

#include <map>
#include <memory>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include <nms/compiler/compile.h>
#include <nms/stdlib/embedded.h>

namespace nms::face_program {
namespace {

/// The library's own files; `from` is looked beside first.
class Library : public lang::SourceProvider {
 public:
  std::shared_ptr<const lang::Source> find(std::string_view name, std::string_view from) override {
    const std::size_t folder = from.rfind('/');
    if (folder != std::string_view::npos) {
      if (auto near = get(std::string(from.substr(0, folder + 1)) + std::string(name))) return near;
    }
    return get(std::string(name));
  }

 private:
  std::shared_ptr<const lang::Source> get(const std::string& path) {
    if (const auto it = known_.find(path); it != known_.end()) return it->second;
    for (const auto& file : stdlib::embedded_files()) {
      if (file.path == path) return known_[path] = std::make_shared<const lang::Source>(path, std::string(file.text));
    }
    return nullptr;
  }

  std::map<std::string, std::shared_ptr<const lang::Source>> known_;
};

}  // namespace

std::optional<program::Image> compile_face(std::span<const std::pair<std::string, std::string>> sources,
                                           const std::string& face, std::span<const std::string> units,
                                           std::string& said) {
  Library library;
  std::string text;
  for (std::size_t i = 0; i < units.size(); ++i) {
    std::string sum = units[i];
    for (std::size_t at = sum.find('+'); at != std::string::npos; at = sum.find('+', at + 3)) sum.replace(at, 1, " + ");
    text += fmt::format("pose fit_{} = {}\n", i + 1, sum);
  }
  std::vector<std::shared_ptr<const lang::Source>> roots;
  for (const auto& [path, source] : sources) roots.push_back(std::make_shared<const lang::Source>(path, source));
  roots.push_back(std::make_shared<const lang::Source>("<units>", text));
  if (auto declared = library.find(fmt::format("faces/{}.nms", face), "")) roots.push_back(std::move(declared));
  lang::Diagnostics diagnostics;
  compiler::CompileOptions options;
  options.face = face;
  const auto draft = compiler::compile(roots, library, diagnostics, options);
  for (const auto& d : diagnostics.all()) {
    said += fmt::format("{}: {} {}: {}\n", d.source ? d.source->path() : std::string(),
                        d.severity == lang::Severity::error ? "error" : "warning", d.kind, d.message);
  }
  if (!draft) return std::nullopt;
  auto image = program::Image::from(*draft);
  if (!image) {
    said += image.error().cause + "\n";
    return std::nullopt;
  }
  return std::move(*image);
}

}  // namespace nms::face_program
