#pragma once

#include <map>
#include <memory>
#include <string>
#include <string_view>

#include <nms/lang/source.h>
#include <nms/stdlib/embedded.h>

namespace nms {

/// The standard library's embedded files under their own paths: beside the using file, then from the library's root.
class EmbeddedLibrary : public lang::SourceProvider {
 public:
  std::shared_ptr<const lang::Source> find(std::string_view name, std::string_view from) override {
    const std::size_t folder = from.rfind('/');
    if (folder != std::string_view::npos)
      if (auto near = get(std::string(from.substr(0, folder + 1)) + std::string(name))) return near;
    return get(std::string(name));
  }

 private:
  std::shared_ptr<const lang::Source> get(const std::string& path) {
    if (const auto it = known_.find(path); it != known_.end()) return it->second;
    for (const auto& file : stdlib::embedded_files())
      if (file.path == path) return known_[path] = std::make_shared<const lang::Source>(path, std::string(file.text));
    return nullptr;
  }
  std::map<std::string, std::shared_ptr<const lang::Source>> known_;
};

}  // namespace nms
