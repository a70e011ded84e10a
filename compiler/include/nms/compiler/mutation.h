#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <nms/lang/diagnostic.h>
#include <nms/lang/source.h>

#include <nms/compiler/test.h>

/// What tests do not notice: parts of lexicon entries are taken out, one at a time, and the tests are run again.
namespace nms::compiler {

struct MutationOptions {
  /// Times from outside, for marks and for signs.
  std::vector<TimeTable> times = {};
  /// Of all removals this call tries those whose number leaves `share` when divided by `shares`: who has several
  /// processors asks several times, each with sources of its own.
  std::uint32_t share = 0;
  std::uint32_t shares = 1;
};

/// One part of an entry without which the tests were run.
struct Removal {
  enum class Part : std::uint8_t {
    component,  ///< a placement, alone or as an alternative
    term,       ///< of a sum
    step,       ///< of a motion that is written in the entry
    phase,      ///< onset, apex, offset, lead, lag, easing, held
    profile,
    span,  ///< over, at, on, fill, per cycle, and what the entry spreads over
  };
  enum class Fate : std::uint8_t {
    untried,     ///< another share's
    noticed,     ///< a test fails without it
    unnoticed,   ///< tests play the entry, and all of them pass
    untested,    ///< no test plays the entry
    impossible,  ///< without it the source has errors
  };
  std::shared_ptr<const lang::Source> source;
  lang::Range range;  ///< what was taken out
  std::string lexicon;
  std::string entry;
  Part part = Part::component;
  Fate fate = Fate::untried;
  std::uint32_t tests = 0;  ///< how many play the entry
};

struct MutationResult {
  std::vector<Removal> removals;    ///< in the order of the sources; empty if a test fails as it is
  std::vector<TestResult> failing;  ///< tests that fail with everything in place
};

/// What a part is called: "component", "term" ...
[[nodiscard]] std::string_view name_of(Removal::Part part);

/// Takes parts out of the entries of all lexicons that the roots declare, `use` or name with `in`, and runs the roots'
/// tests that play such an entry, each root by itself. An entry that a lexicon takes over counts where it is written.
/// @returns nothing in it if an error was reported
[[nodiscard]] MutationResult mutate(const std::vector<std::shared_ptr<const lang::Source>>& roots,
                                    lang::SourceProvider& provider, lang::Diagnostics& diagnostics,
                                    const MutationOptions& options = {});

/// A removal that no test noticed, as a diagnostic.
struct RemovalUnnoticed {
  static constexpr std::string_view kKind = "removal_unnoticed";
  static constexpr lang::Severity kSeverity = lang::Severity::error;
  const Removal& removal;
  [[nodiscard]] lang::Description describe() const;
};

}  // namespace nms::compiler
