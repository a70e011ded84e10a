#include "source_files.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <sstream>

#include <fmt/format.h>

#include <nms/stdlib/embedded.h>

namespace nms::cli {
namespace {

namespace fs = std::filesystem;
constexpr std::string_view kStdlib = "stdlib/";

/// The path a program keeps: relative to the working folder, with forward slashes.
std::string shown(const std::string& path) {
  if (path == "-") return "<stdin>";
  std::error_code error;
  fs::path p = fs::path(path).lexically_normal();
  if (p.is_absolute()) {
    const fs::path here = fs::current_path(error);
    const fs::path relative = error ? p : p.lexically_relative(here);
    if (!relative.empty()) p = relative;
  }
  return p.generic_string();
}

}  // namespace

tl::expected<std::string, program::Failure> read_file(const std::string& path) {
  const auto fail = [&path](std::string cause, std::string remedy) {
    return tl::unexpected(program::Failure{"cannot_read", path, std::move(cause), std::move(remedy)});
  };
  std::ifstream file;
  std::error_code error;
  if (path != "-") {
    if (fs::is_directory(path, error)) return fail("it is a folder", "name a file");
    errno = 0;
    file.open(path, std::ios::binary);
    if (!file)
      return fail(errno != 0 ? std::strerror(errno) : "it cannot be opened", "check the path and its permissions");
  }
  std::istream& in = path == "-" ? std::cin : file;
  std::string text;
  // What a file says of its size may be wrong, and only saves moving the text while it grows.
  if (const auto size = path == "-" ? 0 : fs::file_size(path, error); !error && size <= lang::kMaxFileBytes)
    text.reserve(size);
  char block[65536];
  while (in.read(block, sizeof block) || in.gcount() > 0) {
    text.append(block, static_cast<std::size_t>(in.gcount()));
    if (text.size() > lang::kMaxFileBytes)
      return tl::unexpected(program::Failure{"file_too_large", path,
                                             fmt::format("it has more than {} bytes", lang::kMaxFileBytes),
                                             "split it into several files"});
  }
  if (in.bad()) return fail("reading stopped half-way", "check the disk");
  return text;
}

tl::expected<std::shared_ptr<const lang::Source>, program::Failure> SourceFiles::open(const std::string& path) {
  const std::string name = shown(path);
  if (const auto it = known_.find(name); it != known_.end() && it->second) return it->second;
  auto text = read_file(path);
  if (!text) return tl::unexpected(text.error());
  auto source = std::make_shared<const lang::Source>(name, std::move(*text));
  known_[name] = source;
  on_disk_.insert(name);
  if (path != "-") read_.insert(path);
  return source;
}

std::shared_ptr<const lang::Source> SourceFiles::disk(const std::string& path) {
  const std::string name = shown(path);
  if (const auto it = known_.find(name); it != known_.end()) return it->second;
  std::error_code error;
  if (!fs::is_regular_file(path, error)) return nullptr;
  auto opened = open(path);
  return opened ? *opened : nullptr;
}

std::shared_ptr<const lang::Source> SourceFiles::stdlib(const std::string& name) {
  const std::string path = std::string(kStdlib) + fs::path(name).lexically_normal().generic_string();
  if (const auto it = known_.find(path); it != known_.end()) return it->second;
  std::shared_ptr<const lang::Source> source;
  if (!stdlib_folder_.empty()) {
    const fs::path file = fs::path(stdlib_folder_) / name;
    std::error_code error;
    if (fs::is_regular_file(file, error))
      if (auto text = read_file(file.string())) {
        source = std::make_shared<const lang::Source>(path, std::move(*text));
        read_.insert(file.string());
      }
  } else {
    for (const stdlib::EmbeddedFile& f : stdlib::embedded_files())
      if (std::string_view(path).substr(kStdlib.size()) == f.path)
        source = std::make_shared<const lang::Source>(path, std::string(f.text));
  }
  if (source) known_[path] = source;
  return source;
}

std::shared_ptr<const lang::Source> SourceFiles::find(std::string_view name, std::string_view from) {
  if (name.empty() || name.find('\0') != std::string_view::npos) return nullptr;
  for (const std::string& spelled : {std::string(name), std::string(name) + ".nms"}) {
    if (from.starts_with(kStdlib) && on_disk_.count(std::string(from)) == 0 && known_.count(std::string(from)) != 0) {
      const fs::path folder = fs::path(std::string(from.substr(kStdlib.size()))).parent_path();
      if (auto source = stdlib((folder / spelled).generic_string())) return source;
    } else if (!from.empty()) {
      const fs::path folder = from == "<stdin>" ? fs::path() : fs::path(std::string(from)).parent_path();
      if (auto source = disk((folder / spelled).string())) return source;
    }
    if (auto source = stdlib(spelled)) return source;
  }
  return nullptr;
}

std::vector<std::shared_ptr<const lang::Source>> SourceFiles::sources_read() const {
  std::vector<std::shared_ptr<const lang::Source>> sources;
  for (const auto& [path, source] : known_)
    if (source && path.ends_with(".nms")) sources.push_back(source);
  return sources;
}

}  // namespace nms::cli
