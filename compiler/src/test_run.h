#pragma once

#include <memory>
#include <string_view>
#include <unordered_map>
#include <vector>

#include <nms/compiler/test.h>

#include "lower_discourse.h"
#include "movement.h"

namespace nms::compiler {

/// What a test plays: a clip, its curves once somebody asks for them, and the signs that its places speak of.
struct TestSubject;

/// Checks `test` declarations, and runs them. One for a compilation.
class TestRun {
 public:
  TestRun(Evaluator& evaluator, Discourses& discourses);
  ~TestRun();
  TestRun(const TestRun&) = delete;
  TestRun& operator=(const TestRun&) = delete;

  /// Reports what is wrong with a test: names, units, places.
  void check(const Declaration& test) { (void)walk(test, false); }
  /// The same, and how its expectations come out.
  [[nodiscard]] TestResult run(const Declaration& test) { return walk(test, true); }

 private:
  using Subject = std::shared_ptr<TestSubject>;
  [[nodiscard]] TestResult walk(const Declaration& test, bool run);
  [[nodiscard]] Subject play(lang::NodeRef play, std::uint32_t file);
  [[nodiscard]] Subject play_clip(const Declaration& d, lang::NodeRef play, lang::NodeRef duration, const Scope& scope);
  [[nodiscard]] Subject play_entry(const Declaration& d, lang::NodeRef play, std::int64_t length_ns,
                                   const Scope& scope);
  [[nodiscard]] Subject play_movement(const Declaration& d, lang::NodeRef play, std::int64_t length_ns,
                                      const Scope& scope);
  [[nodiscard]] const Declaration* find_entry(std::string_view name, std::uint32_t file) const;
  void expect(lang::NodeRef expect, const Subject& subject, const Scope& scope, TestResult* result);

  Evaluator& evaluator_;
  Discourses& discourses_;
  std::unordered_map<const Declaration*, Subject> played_;  ///< clips without arguments: played once for all tests
};

}  // namespace nms::compiler
