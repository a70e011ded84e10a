#pragma once

#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include <nms/lang/source.h>
#include <nms/program/failure.h>

namespace nms::cli {

/// Bytes of a file, or of standard input for "-". Failures: cannot_read, file_too_large.
[[nodiscard]] tl::expected<std::string, program::Failure> read_file(const std::string& path);

/// Source files as the core sees them: those on disk, then the stdlib's.
///
/// A file of the stdlib is known as "stdlib/NAME" wherever its text comes from, and a file on disk by its path relative
/// to the working folder, so that programs do not depend on where things are installed.
class SourceFiles : public lang::SourceProvider {
 public:
  /// @param stdlib_folder  takes the place of the embedded stdlib; empty: the embedded one
  explicit SourceFiles(std::string stdlib_folder) : stdlib_folder_(std::move(stdlib_folder)) {}

  /// A file the user named. Failures as read_file.
  [[nodiscard]] tl::expected<std::shared_ptr<const lang::Source>, program::Failure> open(const std::string& path);
  [[nodiscard]] std::shared_ptr<const lang::Source> find(std::string_view name, std::string_view from) override;
  /// A file of the stdlib, by its name there, or null.
  [[nodiscard]] std::shared_ptr<const lang::Source> stdlib(const std::string& name);
  /// Paths of all files that were read from disk so far, sorted.
  [[nodiscard]] std::vector<std::string> files_read() const { return {read_.begin(), read_.end()}; }
  /// All .nms files that were read so far, the library's too, by their names.
  [[nodiscard]] std::vector<std::shared_ptr<const lang::Source>> sources_read() const;

 private:
  [[nodiscard]] std::shared_ptr<const lang::Source> disk(const std::string& path);
  std::string stdlib_folder_;
  std::map<std::string, std::shared_ptr<const lang::Source>> known_;
  std::set<std::string> read_;
  std::set<std::string> on_disk_;  ///< those of them that a folder of the user's holds, should it be called stdlib/ too
};

}  // namespace nms::cli
