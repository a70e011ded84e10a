#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include <nms/compiler/compile.h>
#include <nms/compiler/test.h>
#include <nms/lang/render.h>
#include <nms/program/text.h>

namespace {

using namespace nms;

void require(bool holds) {
  if (!holds) {
    std::abort();
  }
}

/// Enough of a library to reach everything the compiler does, small enough to be compiled thousands of times a second.
constexpr std::string_view kPrelude = R"(
track brows { merge strongest; onset 100ms; offset 200ms }
track mouth { merge strongest; onset 100ms; offset 100ms }
track head { merge sum; onset 200ms; offset 200ms }
track gaze { merge latest; onset 80ms; offset 80ms }
au 1 "" sides { track brows }
au 4 "" sides { track brows; m 100% }
au 12 "" sides { track mouth }
au 17 "" { track mouth }
axis head_yaw = AU51 - AU52 { track head; 100% = 50deg; frame head; motion rotate_y }
axis head_forward = AU57 - AU58 { track head; 100% = -50mm }
axis eyes_yaw = AU61 - AU62 { track gaze; 100% = 40deg }
muscle m sides : linear from a to b { angle 40deg; insertion 4mm; dissipation 8mm }
pose raise(amount = 60%) = amount * AU1
pose turn_left(by = 15deg) = by * AU51
pose gaze_left(by = 20deg) = by * AU61
motion shake(count = 2x, rate = 2Hz, by = 10deg, decay = 0%) = oscillate(head_yaw, count, rate, by, decay)
motion blink = (100ms: AU17; 100ms: 0% AU17)
)";
constexpr std::string_view kLexicon = R"(
lexicon asl "" {
  entry wh(intensity = 80%) : syntactic {
    label "whq"
    spreads clause
    intensity * AU4 { onset 150ms  offset 250ms  lead 200ms }
    turn(left) over sign wh else last sign
  }
  entry neg : affect { spreads phrase; shake fill; 60% AU4; gaze left }
  entry topic : syntactic { spreads topic; AU1 { lead 100ms  lag -50ms } }
  entry mm : morphological { spreads sign; AU17 }
  entry not_yet for sign "NOT-YET" { AU12; shake }
}
)";

class SmallLibrary : public lang::SourceProvider {
 public:
  std::shared_ptr<const lang::Source> find(std::string_view name, std::string_view /*from*/) override {
    if (name == "prelude.nms") return prelude_;
    if (name == "lexicons/asl.nms") return lexicon_;
    return nullptr;
  }

 private:
  std::shared_ptr<const lang::Source> prelude_ = std::make_shared<lang::Source>("prelude.nms", std::string(kPrelude));
  std::shared_ptr<const lang::Source> lexicon_ = std::make_shared<lang::Source>("asl.nms", std::string(kLexicon));
};

}  // namespace

/// Any text gives errors, or a program that passes its own check; and the same text the same ones.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  SmallLibrary library;
  const auto root =
      std::make_shared<const lang::Source>("fuzz.nms", std::string(reinterpret_cast<const char*>(data), size));
  lang::Diagnostics diagnostics;
  const auto draft = compiler::compile({root}, library, diagnostics);
  require(draft.has_value() == (diagnostics.error_count() == 0));
  require(!lang::render_text(diagnostics, false).empty() || diagnostics.all().empty());
  if (draft) require(program::Image::from(*draft).has_value());
  lang::Diagnostics of_tests;
  for (const compiler::TestResult& test : compiler::run_tests({root}, library, of_tests))
    for (const compiler::Expectation& e : test.expectations)
      if (!e.passed) compiler::report_failure(e, of_tests);
  require(draft.has_value() || of_tests.error_count() != 0);
  return 0;
}
