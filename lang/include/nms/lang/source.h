#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace nms::lang {

/// Half-open range of bytes in one file.
struct Range {
  std::uint32_t begin = 0;
  std::uint32_t end = 0;
  friend bool operator==(const Range&, const Range&) = default;
};

/// Line and column, both from 1; the column counts bytes.
struct Position {
  std::uint32_t line = 1;
  std::uint32_t column = 1;
};

/// Largest file that is read: a tree node keeps its beginning in 28 bits.
inline constexpr std::size_t kMaxFileBytes = std::size_t{256} * 1024 * 1024;

/// One source file: its path as diagnostics print it, its text, its lines. Immutable.
class Source {
 public:
  Source(std::string path, std::string text) : path_(std::move(path)), text_(std::move(text)) {}

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] std::string_view text() const { return text_; }
  [[nodiscard]] std::string_view slice(Range range) const {
    return std::string_view(text_).substr(range.begin, range.end - range.begin);
  }
  /// Line and column of a byte; offsets past the end give the end. Builds the line table on first use (not
  /// thread-safe).
  [[nodiscard]] Position position(std::uint32_t offset) const;
  /// The text of line `line` (from 1) without its line break.
  [[nodiscard]] std::string_view line(std::uint32_t line) const;

 private:
  std::string path_;
  std::string text_;
  mutable std::vector<std::uint32_t> line_begin_;
};

/// The one window through which the core sees source files. The command implements it over disk and the embedded
/// stdlib, tests over memory, a browser over its editor.
class SourceProvider {
 public:
  virtual ~SourceProvider() = default;
  /// The file that `name` means in a `use` of the file `from` ("" for the roots). Null: there is none.
  /// The same file must be given under the same path each time: paths are identity.
  [[nodiscard]] virtual std::shared_ptr<const Source> find(std::string_view name, std::string_view from) = 0;
};

}  // namespace nms::lang
