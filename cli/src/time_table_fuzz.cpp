// Any bytes as a table of times: it is read or refused with a place, and what is read compiles or is refused.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <string>

#include <nms/compiler/compile.h>
#include <nms/lang/render.h>

#include "time_table_file.h"

namespace {

using namespace nms;

void require(bool holds) {
  if (!holds) std::abort();
}

class NoFiles : public lang::SourceProvider {
 public:
  std::shared_ptr<const lang::Source> find(std::string_view, std::string_view) override { return nullptr; }
};

/// Marks, signs of both hands that occur twice, and one that no table need give.
const std::shared_ptr<const lang::Source>& timed_source() {
  static const auto source = std::make_shared<const lang::Source>("timed.nms", R"(
track mouth { merge strongest; onset 100ms; offset 100ms }
au 12 "" sides { track mouth }
utterance u {
  signs { A B+ A as again }
  signs nd { C D }
  50% AU12 over A..again
  20% AU12 at mark m for 100ms
}
timeline t 2s { 20% AU12 at mark n for 100ms }
)");
  return source;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);  // bytes as text
  for (const char* path : {"times.csv", "times.json"}) {
    lang::Diagnostics diagnostics;
    const auto source = std::make_shared<const lang::Source>(path, text);
    auto table = cli::read_time_table(source, diagnostics);
    require(table.has_value() == (diagnostics.error_count() == 0));
    for (const lang::Diagnostic& d : diagnostics.all())
      require(d.range.begin <= d.range.end && d.range.end <= source->text().size());
    if (table) {
      NoFiles none;
      compiler::CompileOptions options;
      options.times.push_back(std::move(*table));
      const auto draft = compiler::compile({timed_source()}, none, diagnostics, options);
      require(draft.has_value() == (diagnostics.error_count() == 0));
    }
    diagnostics.sort();
    require(lang::render_text(diagnostics, false).empty() == diagnostics.all().empty());
  }
  return 0;
}
