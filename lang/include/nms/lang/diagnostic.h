#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nms/lang/source.h>

namespace nms::lang {

enum class Severity : std::uint8_t { error, warning };

/// A second place that explains the first.
struct Label {
  std::shared_ptr<const Source> source;
  Range range;
  std::string text;
};

/// A fact about a diagnostic for programs: "name" = "AU99", "nearest" = "AU9 AU66".
struct Field {
  std::string name;
  std::string value;
};

/// What the author's text has wrong, where, why, and what to do. Made by `report` from a kind's struct; drawn
/// elsewhere.
struct Diagnostic {
  std::string_view kind;  ///< stable, snake_case, static storage
  Severity severity = Severity::error;
  std::shared_ptr<const Source> source;
  Range range;
  std::string message;  ///< what was seen, lower case, the author's own words
  std::vector<Label> labels;
  std::vector<std::string> helps;  ///< what to do
  std::vector<Field> fields;
};

/// What a kind's `describe()` returns: its words.
struct Description {
  std::string message;
  std::vector<std::string> helps;
  std::vector<Field> fields;
};

/// A diagnostic kind is a struct like this, and its words live in its describe():
///   struct UnknownName {
///     static constexpr std::string_view kKind = "unknown_name";
///     static constexpr Severity kSeverity = Severity::error;
///     std::string name; std::string what; std::vector<std::string> nearest;
///     Description describe() const;
///   };
/// Kinds of the language stand in <nms/lang/diagnostic_kinds.h>, those of the compiler in its own header.
class Diagnostics {
 public:
  /// After this many errors the rest are counted and not kept.
  static constexpr std::size_t kMaxKept = 1000;

  template <typename Kind>
  Diagnostic& report(const std::shared_ptr<const Source>& source, Range range, const Kind& kind) {
    Description d = kind.describe();
    return add(Diagnostic{Kind::kKind,
                          Kind::kSeverity,
                          source,
                          range,
                          std::move(d.message),
                          {},
                          std::move(d.helps),
                          std::move(d.fields)});
  }
  Diagnostic& add(Diagnostic diagnostic);

  /// Adds a place to one already reported, the n-th of `all()`; nothing where it has that place, or eight.
  void add_label(std::size_t n, Label label);

  [[nodiscard]] const std::vector<Diagnostic>& all() const { return all_; }
  [[nodiscard]] std::size_t error_count() const { return errors_; }
  [[nodiscard]] std::size_t warning_count() const { return warnings_; }
  [[nodiscard]] std::size_t dropped() const { return dropped_; }
  /// Takes out the warnings of which `unwanted(kind)` is true.
  template <typename Unwanted>
  void leave_out_warnings(Unwanted unwanted) {
    const std::size_t before = all_.size();
    std::erase_if(all_, [&](const Diagnostic& d) { return d.severity == Severity::warning && unwanted(d.kind); });
    warnings_ -= before - all_.size();
  }
  /// By file (in the order first reported), then place, then as reported.
  void sort();

 private:
  std::vector<Diagnostic> all_;
  std::size_t errors_ = 0;
  std::size_t warnings_ = 0;
  std::size_t dropped_ = 0;
  Diagnostic overflow_;  ///< what `add` hands back once the list is full
};

/// Names nearest to `name` among `candidates` (case-folded edit distance with transpositions, at most a third of the
/// name's length and at least one edit), best first, at most `count`. Ties keep the candidates' order.
[[nodiscard]] std::vector<std::string> nearest(std::string_view name, const std::vector<std::string>& candidates,
                                               std::size_t count = 2);

}  // namespace nms::lang
