#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <nms/lang/diagnostic.h>
#include <nms/lang/quantity.h>
#include <nms/lang/source.h>

#include <nms/compiler/time_table.h>

namespace nms::compiler {

struct TestOptions {
  std::string filter;  ///< only tests whose name holds this text; all are checked. Empty: all.
  /// Times from outside, for marks and for signs.
  std::vector<TimeTable> times = {};
};

/// A value of what is expected of, in the unit of its expectation: a share of 1, degrees or millimetres.
struct TestValue {
  std::int64_t time_ns = 0;
  double value = 0.0;
};

/// A source line that moved what an expectation speaks of, when it failed.
struct TestCause {
  std::shared_ptr<const lang::Source> source;
  lang::Range range;
  std::string entry;    ///< the lexicon entry or expression; may be empty
  std::string channel;  ///< "AU4L", "head_yaw"
  double value = 0.0;   ///< what it asks of the channel then, before merging: a share of 1
  bool then = true;     ///< false: it moves the channel at other times of the clip only
};

/// How one `expect` came out. Where AUs without a side are meant, it is the side that failed first.
struct Expectation {
  std::shared_ptr<const lang::Source> source;
  lang::Range range;      ///< the `expect` statement
  lang::Range sum_range;  ///< what it speaks of
  bool passed = false;
  std::string subject;   ///< "AU4L"; "AU1 + AU2, left"
  std::string expected;  ///< ">= 50%", "rises", "never >= 20%", as written
  lang::Unit unit = lang::Unit::percent;
  std::int64_t from_ns = 0;
  std::int64_t to_ns = 0;  ///< the same as from_ns: at a point
  // Of a failure:
  TestValue first;                ///< where it first does not hold
  TestValue worst;                ///< where it is farthest from holding
  TestValue before;               ///< of `rises` and `falls`: the value it went back from, or had at the start
  std::vector<TestValue> around;  ///< values before, at and after `first`
  std::vector<TestCause> causes;  ///< what made the value at `first`
};

/// An entry that a test plays: where it is written.
struct PlayedEntry {
  std::string name;
  std::string file;
  std::uint32_t begin = 0;  ///< of its declaration, doc comments included
  friend bool operator==(const PlayedEntry&, const PlayedEntry&) = default;
};

/// How one `test` came out.
struct TestResult {
  std::string name;
  std::shared_ptr<const lang::Source> source;
  lang::Range range;               ///< its name
  lang::Range whole;               ///< all of it
  std::vector<PlayedEntry> plays;  ///< each once, in the order they are used
  std::vector<Expectation> expectations;

  [[nodiscard]] bool passed() const {
    for (const Expectation& e : expectations)
      if (!e.passed) return false;
    return true;
  }
};

/// Compiles sources as `compile` does and runs the tests of the roots, in order.
/// @returns nothing if an error was reported, which an expectation that fails is not.
[[nodiscard]] std::vector<TestResult> run_tests(const std::vector<std::shared_ptr<const lang::Source>>& roots,
                                                lang::SourceProvider& provider, lang::Diagnostics& diagnostics,
                                                const TestOptions& options = {});

/// An expectation that failed, as a diagnostic: the line, the values around the failure, the lines that made them.
struct ExpectationFailed {
  static constexpr std::string_view kKind = "expectation_failed";
  static constexpr lang::Severity kSeverity = lang::Severity::error;
  const Expectation& expectation;
  [[nodiscard]] lang::Description describe() const;
};
lang::Diagnostic& report_failure(const Expectation& failed, lang::Diagnostics& diagnostics);

}  // namespace nms::compiler
